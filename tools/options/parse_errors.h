// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace terrane::tools {

/// One line for a command line that could not be parsed. It names the flag or the word that is wrong and, where one is
/// near, what was probably meant.
///
/// @param app       that parsed, with its subcommands
/// @param arguments of the program, without its name, in order
std::string explain_parse_error(const CLI::App& app, const CLI::ParseError& error,
                                const std::vector<std::string>& arguments);

}  // namespace terrane::tools
