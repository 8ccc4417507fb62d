// SPDX-License-Identifier: MIT
#include "options/idle_flags.h"

#include <CLI/CLI.hpp>

namespace terrane::tools {

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

}  // namespace terrane::tools
