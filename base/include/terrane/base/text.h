// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <string>

namespace terrane {

/// A number for messages: at most six significant digits ("0.1", "1e+300", "nan"), with a decimal point in every
/// locale. At most 12 characters.
std::string number_text(double value);

/// An integer, with all its digits.
template <std::integral Integer>
std::string number_text(Integer value) {
    return std::to_string(value);
}

}  // namespace terrane
