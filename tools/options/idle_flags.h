// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"

#include <string>
#include <vector>

namespace terrane::tools {

/// Flags that only have an effect under a condition.
struct ConditionalFlags {
    std::vector<std::string> flags;
    bool has_effect = false;  ///< whether the condition is met
    std::string condition;    ///< text after the flag: "goes with --policy distance"
};

/// Fails with exit_usage where a given flag has no effect: "--radius goes with --policy distance".
CommandResult<void> refuse_idle_flags(const CLI::App& command,
                                      const std::vector<ConditionalFlags>& rules);

/// Whether a flag of the command was on the command line.
bool is_given(const CLI::App& command, const std::string& flag);

}  // namespace terrane::tools
