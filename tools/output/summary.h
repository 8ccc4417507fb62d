// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace terrane::tools {

/// What a command found out, on standard output: one line of JSON for machines, whose numbers read back the same; or
/// a line "key   value" for each key for people, rounded as figure_text() says.
void print_summary(const nlohmann::ordered_json& summary, bool as_json);

/// The text that print_summary() prints, line ends included.
std::string format_summary(const nlohmann::ordered_json& summary, bool as_json);

/// One line of JSON. Text that is no UTF-8 (a path, an echo of input) is made so instead of failing.
std::string to_line(const nlohmann::ordered_json& value);

}  // namespace terrane::tools
