// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <tl/expected.hpp>

#include <functional>
#include <string>
#include <utility>

namespace CLI {
class App;
}

namespace terrane::tools {

/// Exit codes of the program.
enum ExitCode : int {
    exit_done = 0,
    exit_failed = 1,  ///< a run-time failure: a file, a disk, a device
    exit_usage = 2,   ///< invalid command line, whatever the files hold
};

/// Why a command failed: one line, without a full stop, that names the thing and the value.
struct CommandError {
    ExitCode exit_code = exit_failed;
    std::string message;

    CommandError(ExitCode code, std::string text) : exit_code(code), message(std::move(text)) {}
    /// An error of a library is a failure, not a usage error. Implicit, for returning the error of a Result.
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

/// `return pass_on(result.error());` for the Error of a library's Result.
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

/// Each adds one subcommand with its options. The context must outlive the app's parse() and run().
void add_info_command(CLI::App& app, CommandContext& context);
void add_fly_command(CLI::App& app, CommandContext& context);
void add_mesh_command(CLI::App& app, CommandContext& context);
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

}  // namespace terrane::tools
