// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study/study.h"

#include <string>
#include <vector>

namespace terrane::tools {

/// A published time beside ours.
struct Comparison {
    std::string what;  ///< "query, sweep-and-prune, 20 bodies"
    double published_ms = 0.0;
    double our_ms = 0.0;
    std::string reason;  ///< one sentence: why they differ, with the figures of this run
};

/// Every published time of a table beside ours for the same scheme: sweep-and-prune, and the dense grid for bodies of
/// equal size. Empty for a table without published times.
///
/// The machine of the published study is unknown: its speed is an unknown factor, common to all ratios.
std::vector<Comparison> compare_with_published(const StudyTable& table);

/// Whether the hashed grid queries as fast as the published dense one and updates at least 100 times faster, and which
/// share of a dense update is the clearing of its lists.
void judge_grids(const StudyTable& table, std::vector<std::string>& findings);

}  // namespace terrane::tools
