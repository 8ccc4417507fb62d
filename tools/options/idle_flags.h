// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"

#include <string>
#include <vector>

namespace terrane::tools {

/// Flags that have an effect under a condition only.
struct ConditionalFlags {
    std::vector<std::string> flags;
    bool has_effect = false;  ///< whether the condition is met
    std::string condition;    ///< in words that follow the flag: "goes with --policy distance"
};

/// Refuses a flag that was given and does nothing, so that nobody takes it to have done something. Fails with
/// exit_usage: "--radius goes with --policy distance".
CommandResult<void> refuse_idle_flags(const CLI::App& command,
                                      const std::vector<ConditionalFlags>& rules);

/// Whether a flag of the command was on the command line.
bool is_given(const CLI::App& command, const std::string& flag);

}  // namespace terrane::tools
