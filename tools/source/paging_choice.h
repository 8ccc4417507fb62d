// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/pager.h>

#include <string>
#include <vector>

namespace terrane::tools {

/// Values of --policy.
enum class PagingChoice {
    deadline,  ///< PagingPolicy::deadline
    distance,  ///< PagingPolicy::distance
    oracle,    ///< PagingPolicy::deadline with the true trajectories of cameras and bodies
};

/// In the order of PagingChoice.
std::vector<std::string> paging_choice_names();
const char* name_of(PagingChoice choice);
PagingPolicy pager_policy(PagingChoice choice);

}  // namespace terrane::tools
