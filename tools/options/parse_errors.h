// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace terrane::tools {

/// One line for a command line that cannot be parsed: names the wrong flag or word and suggests the nearest one.
///
/// @param app       the parser, with its subcommands
/// @param arguments of the program, without its name
std::string explain_parse_error(const CLI::App& app, const CLI::ParseError& error,
                                const std::vector<std::string>& arguments);

}  // namespace terrane::tools
