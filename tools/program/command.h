// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <tl/expected.hpp>

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace terrane::tools {

/// Exit codes of the program.
enum ExitCode : int {
    exit_done = 0,
    exit_failed = 1,  ///< a run-time failure: a file, a disk, a device
    exit_usage = 2,   ///< the command line is invalid, whatever the files contain
};

/// Why a command failed: one line, without a full stop, that names the thing and the value.
struct CommandError {
    ExitCode exit_code = exit_failed;
    std::string message;

    CommandError(ExitCode code, std::string text) : exit_code(code), message(std::move(text)) {}
    /// Converts a library error, with exit_failed. Implicit, so that the error of a Result can be returned.
    CommandError(const Error& error) : message(error.message) {}
};

/// A value, or the error that ends the program.
template <class T>
using CommandResult = tl::expected<T, CommandError>;

/// `return usage_error("--budget must be at least 1, got 0");` in a function that returns a
/// CommandResult.
inline tl::unexpected<CommandError> usage_error(std::string message) {
    return tl::unexpected<CommandError>(CommandError(exit_usage, std::move(message)));
}

/// `return failure("cannot write " + path);`
inline tl::unexpected<CommandError> failure(std::string message) {
    return tl::unexpected<CommandError>(CommandError(exit_failed, std::move(message)));
}

/// `return pass_on(result.error());` for the Error of a library Result.
inline tl::unexpected<CommandError> pass_on(const Error& error) {
    return tl::unexpected<CommandError>(CommandError(error));
}
inline tl::unexpected<CommandError> pass_on(const CommandError& error) {
    return tl::unexpected<CommandError>(error);
}

/// The subcommand to run after parsing.
struct CommandContext {
    std::function<CommandResult<void>()> run;  ///< set by the parsed subcommand
};

/// Each function adds one subcommand with its options. The context must outlive the app's parse() and run().
void add_info_command(CLI::App& app, CommandContext& context);
void add_fly_command(CLI::App& app, CommandContext& context);
void add_mesh_command(CLI::App& app, CommandContext& context);
void add_view_command(CLI::App& app, CommandContext& context);
void add_query_command(CLI::App& app, CommandContext& context);
void add_drop_command(CLI::App& app, CommandContext& context);
void add_drive_command(CLI::App& app, CommandContext& context);
void add_walk_command(CLI::App& app, CommandContext& context);
void add_page_command(CLI::App& app, CommandContext& context);
void add_bodies_command(CLI::App& app, CommandContext& context);
void add_bake_command(CLI::App& app, CommandContext& context);
void add_simplify_command(CLI::App& app, CommandContext& context);
void add_heightmap_command(CLI::App& app, CommandContext& context);
void add_trade_command(CLI::App& app, CommandContext& context);

/// The first of the `words` nearest to `word`, if the edit distance is at most a third of the letters of `word`,
/// rounded up. Otherwise the first one that begins with `word`, if `word` has four letters or more. Otherwise "".
std::string nearest_word(std::string_view word, std::span<const std::string> words);

/// "; did you mean X?", or "" if no word is near.
std::string did_you_mean(std::string_view word, std::span<const std::string> words);

/// Flags that have an effect only under a condition.
struct ConditionalFlags {
    std::vector<std::string> flags;
    bool has_effect = false;  ///< whether the condition is met
    std::string condition;    ///< text of the message after the flag: "goes with --policy distance"
};

/// Fails with exit_usage if a given flag has no effect: "--radius goes with --policy distance".
CommandResult<void> refuse_idle_flags(const CLI::App& command,
                                      const std::vector<ConditionalFlags>& rules);

/// Whether a flag of the command was on the command line.
bool is_given(const CLI::App& command, const std::string& flag);

/// One line for a command line that cannot be parsed: names the wrong flag or word and suggests the nearest one.
///
/// @param app       the parser, with its subcommands
/// @param arguments words of the command line, without the program's name
std::string explain_parse_error(const CLI::App& app, const CLI::ParseError& error,
                                const std::vector<std::string>& arguments);

}  // namespace terrane::tools
