// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/base/text.h>

#include <string>

namespace terrane {

/// Fails: invalid_argument, naming the field and its value, unless least <= value <= most
template <class Number>
Result<void> check_range(const char* name, Number value, Number least, Number most) {
    if (value >= least && value <= most) return {};
    return fail(ErrorCode::invalid_argument, std::string(name) + " must be " + number_text(least) +
                                                 " to " + number_text(most) + ", got " +
                                                 number_text(value));
}

/// Checks the octave settings that FractalSettings and DetailSettings share.
inline Result<void> check_octaves(int octave_count, double gain) {
    TERRANE_TRY(check_range("octave_count", octave_count, 1, 24));
    if (gain > 0.0 && gain <= 1.0) return {};
    return fail(ErrorCode::invalid_argument,
                "gain must be above 0 and at most 1, got " + number_text(gain));
}

}  // namespace terrane
