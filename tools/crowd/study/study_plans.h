// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/schemes/cell_grids.h"
#include "crowd/study/study.h"

#include <functional>
#include <vector>

namespace terrane::tools {

/// Width of the published room, metres: 40 cells of the dense grid, each as wide as a body of radius 1.
inline constexpr double kPublishedRoom = 80.0;
/// Bodies of the published tables of detail and radius and of the comparison.
inline constexpr std::size_t kPublishedCount = 20;
/// Published updates of 1 and of 50 bodies, ms.
inline constexpr double kFirstUpdateMs = 0.024, kLastUpdateMs = 0.149;
/// Lists of the published dense grid.
inline constexpr std::size_t kDenseLists = kDenseCells * kDenseCells * kDenseCells;
/// Published means of the comparison for bodies of equal size, ms.
inline constexpr double kSweepQueryMs = 3.164, kSweepUpdateMs = 0.099;
inline constexpr double kDenseQueryMs = 0.527, kDenseUpdateMs = 65.0;

/// A line of a table: what it changes of each point's layout.
struct StudySeries {
    CrowdScheme scheme = CrowdScheme::sap;
    bool is_dented = false;
    double own_room_share = 0.0;  ///< above 0: share of a room of their own that the spheres take
};

/// A table before it is measured.
struct StudyPlan {
    StudyTable table;
    std::vector<StudySeries> series;   ///< in the order of the table's names
    std::vector<CrowdLayout> layouts;  ///< by point
};

/// The tables of the study, without measurements.
std::vector<StudyPlan> make_study_plans(const StudySettings& settings);

/// Measures plans one after another, as run_study() does.
std::vector<StudyTable> run_plans(std::vector<StudyPlan> plans, const StudySettings& settings,
                                  const std::function<void(double)>& show);

}  // namespace terrane::tools
