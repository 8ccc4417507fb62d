// SPDX-License-Identifier: MIT
// The program `terrane`: parses the command line, runs the subcommand, and reports an error as one line on standard
// error and an exit code.
#include "program/command.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <vector>

namespace {

using namespace terrane::tools;

/// Prints the message of a failure as one line.
int report(ExitCode code, std::string message) {
    std::replace(message.begin(), message.end(), '\n', ' ');
    while (!message.empty() && (message.back() == ' ' || message.back() == '.')) message.pop_back();
    std::fflush(stdout);
    std::fprintf(stderr, "terrane: %s\n", message.c_str());
    return code;
}

/// The flags that determine the subcommand's memory use, as part of a message: "; drop needs memory for --count 1000".
std::string memory_flags(const CLI::App& app) {
    if (app.get_subcommands().empty()) return "";
    const CLI::App& command = *app.get_subcommands().front();
    std::string text;
    for (const char* flag : {"--count", "--budget", "--memory-mb", "--cache-mb", "--size",
                             "--bodies", "--most-bodies"}) {
        const CLI::Option* option = command.get_option_no_throw(flag);
        if (option == nullptr) continue;
        const std::string value =
            option->count() > 0 ? option->results().back() : option->get_default_str();
        text += (text.empty() ? "; " + command.get_name() + " needs memory for " : ", ") +
                std::string(flag) + " " + value;
    }
    return text;
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
    add_view_command(app, context);
    add_mesh_command(app, context);
    add_query_command(app, context);
    add_drop_command(app, context);
    add_drive_command(app, context);
    add_walk_command(app, context);
    add_page_command(app, context);
    add_bodies_command(app, context);
    add_bake_command(app, context);
    add_simplify_command(app, context);
    add_heightmap_command(app, context);
    add_trade_command(app, context);

    try {
        app.parse(argument_count, arguments);
    } catch (const CLI::Success& success) {
        app.exit(success);  // prints the text of --help or --version
    } catch (const CLI::ParseError& error) {
        const std::vector<std::string> words(arguments + std::min(argument_count, 1),
                                             arguments + argument_count);
        return report(exit_usage, explain_parse_error(app, error, words));
    }

    if (context.run) {
        try {
            const CommandResult<void> result = context.run();
            if (!result) return report(result.error().exit_code, result.error().message);
        } catch (const std::bad_alloc&) {
            return report(exit_failed, "out of memory" + memory_flags(app));
        }
    }
    // the system may report a full disk only when the buffer is flushed
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
        return report(exit_failed,
                      std::string("cannot write to standard output: ") + std::strerror(errno));
    }
    return exit_done;
}

}  // namespace

int main(int argument_count, char** arguments) {
    // a write beyond the shell's limit of file sizes fails with EFBIG, and no signal ends the program
    std::signal(SIGXFSZ, SIG_IGN);
    try {
        return run(argument_count, arguments);
    } catch (const std::bad_alloc&) {
        return report(exit_failed, "out of memory");
    } catch (const std::exception& error) {
        return report(exit_failed, error.what());
    }
}
