// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <string>

namespace terrane {

/// A number as messages show it: at most six significant digits ("0.1", "1e+300", "nan"), with a decimal point
/// whatever the locale. At most 12 characters.
std::string number_text(double value);

/// Whole numbers have all their digits.
template <std::integral Integer>
std::string number_text(Integer value) {
    return std::to_string(value);
}

}  // namespace terrane
