// SPDX-License-Identifier: MIT
#include "scene/mesh/text_numbers.h"

#include <algorithm>
#include <charconv>

namespace terrane::tools {
namespace {

constexpr std::string_view kSpaces = " \t\r\n\v\f";

template <class Number>
std::optional<Number> number_of(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || rest != word.data() + word.size()) return std::nullopt;
    return value;
}

}  // namespace

std::string_view take_line(std::string_view& text) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

std::string_view take_word(std::string_view& text) {
    text.remove_prefix(std::min(text.find_first_not_of(kSpaces), text.size()));
    const std::string_view word = text.substr(0, text.find_first_of(kSpaces));
    text.remove_prefix(word.size());
    return word;
}

std::optional<double> real_number(std::string_view word) { return number_of<double>(word); }
std::optional<std::int64_t> whole_number(std::string_view word) {
    return number_of<std::int64_t>(word);
}

}  // namespace terrane::tools
