// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/pager.h>

#include <optional>
#include <string_view>

namespace terrane::tools {

/// What a --policy chooses chunks by.
enum class PagingChoice {
    deadline,  ///< PagingPolicy::deadline
    distance,  ///< PagingPolicy::distance
    oracle,    ///< PagingPolicy::deadline that is told the true future of cameras and bodies
};

inline constexpr std::string_view kPagingChoices = "deadline, distance or oracle";

std::optional<PagingChoice> parse_paging_choice(std::string_view name);
const char* name_of(PagingChoice choice);
PagingPolicy pager_policy(PagingChoice choice);

}  // namespace terrane::tools
