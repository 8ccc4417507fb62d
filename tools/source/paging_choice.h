// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/pager.h>

#include <string>
#include <vector>

namespace terrane::tools {

/// What a --policy chooses chunks by.
enum class PagingChoice {
    deadline,  ///< PagingPolicy::deadline
    distance,  ///< PagingPolicy::distance
    oracle,    ///< PagingPolicy::deadline that is told the true future of cameras and bodies
};

/// As PagingChoice numbers them.
std::vector<std::string> paging_choice_names();
const char* name_of(PagingChoice choice);
PagingPolicy pager_policy(PagingChoice choice);

}  // namespace terrane::tools
