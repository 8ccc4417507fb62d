// SPDX-License-Identifier: MIT
//
// Sources:
//   F. J. Damerau. A technique for computer detection and correction of spelling errors. Communications of the ACM
//   7(3), 1964 (optimal string alignment: no letter is edited twice).
#include "program/command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace terrane::tools {
namespace {

// Edit distance: the smallest number of insertions, removals, replacements and swaps of adjacent letters that turn one
// word into the other.
std::size_t spelling_distance(std::string_view a, std::string_view b) {
    // costs[i][j]: distance between the first i letters of a and the first j letters of b
    std::vector<std::vector<std::size_t>> costs(a.size() + 1,
                                                std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i) {
        for (std::size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                costs[i][j] = i + j;
                continue;
            }
            const std::size_t replaced = costs[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            std::size_t least = std::min({replaced, costs[i - 1][j] + 1, costs[i][j - 1] + 1});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
                least = std::min(least, costs[i - 2][j - 2] + 1);
            }
            costs[i][j] = least;
        }
    }
    return costs[a.size()][b.size()];
}

}  // namespace

std::string nearest_word(std::string_view word, std::span<const std::string> words) {
    constexpr std::size_t kLongest = 100;  // no flag is longer
    if (word.size() > kLongest) return "";
    std::string nearest;
    std::size_t least = (word.size() + 2) / 3 + 1;
    for (const std::string& each : words) {
        const std::size_t distance = spelling_distance(word, each);
        if (distance >= least) continue;
        least = distance;
        nearest = each;
    }
    if (!nearest.empty() || word.size() < 4) return nearest;
    const auto longer = std::find_if(words.begin(), words.end(), [word](const std::string& each) {
        return each.starts_with(word);
    });
    return longer == words.end() ? "" : *longer;
}

std::string did_you_mean(std::string_view word, std::span<const std::string> words) {
    const std::string nearest = nearest_word(word, words);
    return nearest.empty() ? "" : "; did you mean " + nearest + "?";
}

bool is_given(const CLI::App& command, const std::string& flag) {
    return command.get_option(flag)->count() > 0;
}

CommandResult<void> refuse_idle_flags(const CLI::App& command,
                                      const std::vector<ConditionalFlags>& rules) {
    for (const ConditionalFlags& rule : rules) {
        if (rule.has_effect) continue;
        for (const std::string& flag : rule.flags) {
            if (is_given(command, flag)) return usage_error(flag + " " + rule.condition);
        }
    }
    return {};
}

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

// The flag of an argument: "--budget" for "--budget=5".
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

// Message for arguments that a subcommand does not accept: names the first of them that is a flag, otherwise the first.
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
