// SPDX-License-Identifier: MIT
// The program `terrane`: chooses a subcommand, runs it, and turns whatever goes wrong into one line
// and an exit code.
#include "command.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>

namespace {

using namespace terrane::tools;

/// Prints the one line that a failure gets, whatever the message holds.
int report(ExitCode code, std::string message) {
    std::replace(message.begin(), message.end(), '\n', ' ');
    while (!message.empty() && (message.back() == ' ' || message.back() == '.')) message.pop_back();
    std::fflush(stdout);
    std::fprintf(stderr, "terrane: %s\n", message.c_str());
    return code;
}

int run(int argument_count, char** arguments) {
    CLI::App app{
        "Terrane: ground to see and ground to stand on.\n"
        "Every subcommand takes its terrain from --dem, --seed or --scene; see 'terrane COMMAND "
        "--help'.",
        "terrane"};
    app.set_version_flag("--version", "terrane " TERRANE_VERSION);
    app.footer("Example: terrane info --dem tools/data/jacksboro.tif");
    app.require_subcommand(1);

    CommandContext context;
    add_info_command(app, context);
    add_fly_command(app, context);
    add_mesh_command(app, context);
    add_query_command(app, context);
    add_drop_command(app, context);
    add_drive_command(app, context);
    add_page_command(app, context);
    add_bodies_command(app, context);

    try {
        app.parse(argument_count, arguments);
    } catch (const CLI::Success& success) {
        app.exit(success);  // --help or --version: prints it
    } catch (const CLI::RequiredError& error) {
        if (!app.get_subcommands().empty()) return report(exit_usage, error.what());
        if (argument_count < 2)
            return report(exit_usage, "no subcommand given; see terrane --help");
        const std::string first = arguments[1];
        return report(exit_usage, (first.starts_with('-') ? "unknown flag '" : "no subcommand '") +
                                      first + "'; see terrane --help");
    } catch (const CLI::ParseError& error) {
        return report(exit_usage, error.what());
    }

    if (context.run) {
        const CommandResult<void> result = context.run();
        if (!result) return report(result.error().exit_code, result.error().message);
    }
    // A full disk shows only here.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
        return report(exit_failed,
                      std::string("cannot write to standard output: ") + std::strerror(errno));
    }
    return exit_done;
}

}  // namespace

int main(int argument_count, char** arguments) {
    try {
        return run(argument_count, arguments);
    } catch (const std::bad_alloc&) {
        return report(exit_failed, "out of memory");
    } catch (const std::exception& error) {
        return report(exit_failed, error.what());
    }
}
