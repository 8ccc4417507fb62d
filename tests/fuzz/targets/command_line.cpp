// SPDX-License-Identifier: MIT
// Command lines of the program: words are split at line ends. Parsed, never run.
#include "program/command.h"
#include "support/input.h"

#include <CLI/CLI.hpp>

using namespace terrane;

namespace {

void add_commands(CLI::App& app, tools::CommandContext& context) {
    app.set_version_flag("--version", "terrane");
    app.require_subcommand(1);
    tools::add_info_command(app, context);
    tools::add_fly_command(app, context);
    tools::add_mesh_command(app, context);
    tools::add_query_command(app, context);
    tools::add_drop_command(app, context);
    tools::add_drive_command(app, context);
    tools::add_walk_command(app, context);
    tools::add_page_command(app, context);
    tools::add_bodies_command(app, context);
    tools::add_bake_command(app, context);
    tools::add_simplify_command(app, context);
    tools::add_heightmap_command(app, context);
    tools::add_trade_command(app, context);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    std::vector<std::string> words;
    for (const std::string_view line : input.rest_as_lines(64)) {
        // A word has no null character, as no argument of a program has.
        words.emplace_back(line.substr(0, line.find('\0')));
    }
    CLI::App app{"Terrane", "terrane"};
    tools::CommandContext context;
    add_commands(app, context);
    std::string name = "terrane";
    std::vector<char*> arguments = {name.data()};
    for (std::string& word : words) arguments.push_back(word.data());
    try {
        app.parse(static_cast<int>(arguments.size()), arguments.data());
        fuzz::require(static_cast<bool>(context.run), "a command line that is parsed can be run");
    } catch (const CLI::Success&) {
        fuzz::require(!app.help().empty(), "there is a help text");
    } catch (const CLI::ParseError& error) {
        const std::string message = tools::explain_parse_error(app, error, words);
        fuzz::require(!message.empty(), "a refused command line has a message");
    }
    return 0;
}
