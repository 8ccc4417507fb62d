// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace terrane::tools {

enum class Rounding { nearest, up, down };

/// A number with `digits` significant digits: "5334", "0.01235". Magnitudes from 1e-4 to 1e15 have no exponent.
///
/// @param digits 1 to 17
std::string rounded_text(double value, int digits, Rounding rounding);

/// A value of a summary formatted for people, depending on its key: measured figures have 4 digits; certified bounds
/// have 4, rounded up; coordinates, grid sizes and heights have 9; values of flags, counts and words are unchanged.
std::string figure_text(const std::string& key, const nlohmann::ordered_json& value);

/// The title of the figure with a key, with its unit: "Depth, m" for depth_m.
std::string figure_title(const std::string& key);

/// A note that explains a figure of this summary to its reader; "" for most figures.
std::string figure_note(const std::string& key, const nlohmann::ordered_json& summary);

/// Prints the summary of a command on standard output. For scripts (`as_json`): one line of JSON, whose numbers have
/// all digits. For people: a line "key value" for each key, with values formatted by figure_text().
void print_summary(const nlohmann::ordered_json& summary, bool as_json);

/// Writes text to standard output. Failures are reported at the end of the program.
void print_text(std::string_view text);
/// Writes a note of one line to standard error, after the program's name.
void print_note(std::string_view note);

/// The text of print_summary(), with line ends.
std::string format_summary(const nlohmann::ordered_json& summary, bool as_json);

/// A value as one line of JSON. Invalid UTF-8, for instance in a path, is replaced and is no error.
std::string to_line(const nlohmann::ordered_json& value);

/// The number, or null.
nlohmann::ordered_json number_or_null(const std::optional<double>& number);

}  // namespace terrane::tools
