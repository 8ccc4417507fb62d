// SPDX-License-Identifier: MIT
#include "options/parse_errors.h"

#include "options/spelling.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>

namespace terrane::tools {
namespace {

std::vector<std::string> names_of_commands(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        names.push_back(command->get_name());
    }
    return names;
}

std::vector<std::string> flags_of(const CLI::App& command) {
    std::vector<std::string> flags;
    for (const CLI::Option* option : command.get_options()) {
        for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
    }
    return flags;
}

// "--budget" of "--budget=5".
std::string without_value(const std::string& argument) {
    return argument.substr(0, argument.find('='));
}

// Message for a command line without a known subcommand.
std::string explain_missing_command(const CLI::App& app,
                                    const std::vector<std::string>& arguments) {
    const std::vector<std::string> commands = names_of_commands(app);
    if (arguments.empty()) return "no subcommand given; see terrane --help";
    const std::string& first = arguments.front();
    if (!first.starts_with('-')) {
        const std::string meant = did_you_mean(first, commands);
        return fmt::format("no subcommand '{}'{}", first,
                           meant.empty() ? "; see terrane --help" : meant);
    }
    const std::string flag = without_value(first);
    for (const std::string& command : commands) {
        const std::vector<std::string> flags = flags_of(*app.get_subcommand(command));
        if (std::find(flags.begin(), flags.end(), flag) == flags.end()) continue;
        return fmt::format(
            "{} stands before the subcommand; flags go behind it, as in 'terrane {} {} ...'", flag,
            command, flag);
    }
    return fmt::format("unknown flag '{}'; see terrane --help", flag);
}

// Message for arguments that a subcommand does not take: names the first flag, else the first word.
std::string explain_extras(const CLI::App& command, const std::vector<std::string>& arguments) {
    const std::vector<std::string> extras = command.remaining();
    const auto is_extra = [&extras](const std::string& argument) {
        return std::find(extras.begin(), extras.end(), argument) != extras.end();
    };
    const auto flag = std::find_if(
        arguments.begin(), arguments.end(),
        [&](const std::string& each) { return each.starts_with('-') && is_extra(each); });
    if (flag != arguments.end()) {
        const std::string name = without_value(*flag);
        return fmt::format("{} is not a flag of {}{}", name, command.get_name(),
                           did_you_mean(name, flags_of(command)));
    }
    const auto word = std::find_if(arguments.begin(), arguments.end(), is_extra);
    return fmt::format("'{}' is not expected: {} takes only flags, which begin with --",
                       word != arguments.end() ? *word : extras.front(), command.get_name());
}

}  // namespace

std::string explain_parse_error(const CLI::App& app, const CLI::ParseError& error,
                                const std::vector<std::string>& arguments) {
    const std::vector<CLI::App*> chosen = app.get_subcommands();
    const bool has_flag_before = !arguments.empty() && arguments.front().starts_with('-');
    if (chosen.empty() || has_flag_before) return explain_missing_command(app, arguments);
    const bool has_extras = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
    if (has_extras && !chosen.front()->remaining().empty()) {
        return explain_extras(*chosen.front(), arguments);
    }
    const std::string message = error.what();
    if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) == nullptr) return message;
    // "--budget: 1 required N missing", "--budget: At Most 1 required but received 2"
    const std::string flag = message.substr(0, message.find(':'));
    const bool is_repeated = message.find("received") != std::string::npos;
    return flag + (is_repeated ? " is given more than once" : " needs a value");
}

}  // namespace terrane::tools
