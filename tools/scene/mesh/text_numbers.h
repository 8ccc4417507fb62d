// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace terrane::tools {

/// Removes the first line of a text, and gives it without its end.
std::string_view take_line(std::string_view& text);

/// Removes the first word of a text, and gives it; empty where there is none. Words are parted by spaces, tabs and
/// ends of lines.
std::string_view take_word(std::string_view& text);

/// The number that a word is, whatever the locale; none for another word. A leading + is allowed; "nan" and "inf" are
/// numbers.
std::optional<double> real_number(std::string_view word);
std::optional<std::int64_t> whole_number(std::string_view word);

}  // namespace terrane::tools
