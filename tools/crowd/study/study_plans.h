// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study/study.h"

#include <vector>

namespace terrane::tools {

/// Width of the published room, metres: 40 cells of the dense grid, each as wide as a body of radius 1.
inline constexpr double kPublishedRoom = 80.0;
/// Bodies of the published tables of detail and radius and of the comparison.
inline constexpr std::size_t kPublishedCount = 20;
/// Published means of the comparison for bodies of equal size, ms.
inline constexpr double kSweepQueryMs = 3.164, kSweepUpdateMs = 0.099;
inline constexpr double kDenseQueryMs = 0.527, kDenseUpdateMs = 65.0;

/// A line of a table: what it changes of each point's layout.
struct StudySeries {
    CrowdScheme scheme = CrowdScheme::sap;
    bool is_dented = false;
};

/// A table before it is measured.
struct StudyPlan {
    StudyTable table;
    std::vector<StudySeries> series;   ///< in the order of the table's names
    std::vector<CrowdLayout> layouts;  ///< by point
};

/// The tables of the study, without measurements.
std::vector<StudyPlan> make_study_plans(const StudySettings& settings);

}  // namespace terrane::tools
