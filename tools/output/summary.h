// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace terrane::tools {

/// Prints the summary of a command on standard output: one line of JSON with round-trip numbers for scripts, or one
/// line "key   value" for each key for people, rounded by figure_text().
void print_summary(const nlohmann::ordered_json& summary, bool as_json);

/// The text of print_summary(), with line ends.
std::string format_summary(const nlohmann::ordered_json& summary, bool as_json);

/// One line of JSON. Invalid UTF-8 (in a path, an echo of input) is replaced instead of failing.
std::string to_line(const nlohmann::ordered_json& value);

}  // namespace terrane::tools
