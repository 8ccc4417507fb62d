// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace terrane::tools {

enum class Rounding { nearest, up, down };

/// A number with `digits` significant digits; without an exponent from 1e-4 to 1e15: "5334", "0.01235".
///
/// @param digits 1 to 17
std::string rounded_text(double value, int digits, Rounding rounding);

/// A value of a summary formatted for people, by its key: measured figures with 4 digits; certified bounds rounded up
/// to 4; coordinates, grid sizes and heights with 9; echoes of the command line, counts and words unchanged.
std::string figure_text(const std::string& key, const nlohmann::ordered_json& value);

/// The meaning of a key with its unit: "Depth, m" for depth_m.
std::string figure_title(const std::string& key);

/// A caveat for the reader of a figure of this summary; "" for most.
std::string figure_note(const std::string& key, const nlohmann::ordered_json& summary);

/// Prints the summary of a command on standard output: one line of JSON with round-trip numbers for scripts, or one
/// line "key   value" for each key for people, rounded by figure_text().
void print_summary(const nlohmann::ordered_json& summary, bool as_json);

/// Writes text to standard output. Failures are reported at the end of the program.
void print_text(std::string_view text);

/// The text of print_summary(), with line ends.
std::string format_summary(const nlohmann::ordered_json& summary, bool as_json);

/// One line of JSON. Invalid UTF-8 (in a path, an echo of input) is replaced instead of failing.
std::string to_line(const nlohmann::ordered_json& value);

/// The number, or null.
nlohmann::ordered_json number_or_null(const std::optional<double>& number);

}  // namespace terrane::tools
