// SPDX-License-Identifier: MIT
#pragma once

#include "lab/crowd.h"
#include "lab/study.h"

#include <functional>
#include <map>
#include <optional>
#include <string>
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

/// A series of a table: its changes to each point's layout.
struct StudySeries {
    CrowdScheme scheme = CrowdScheme::sap;
    bool is_dented = false;
    double own_room_share =
        0.0;  ///< above 0: the series has its own room, filled by the spheres to this share
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

/// Estimates the time of a step (an update and a query) of many bodies from measured steps of fewer.
class StepTimes {
public:
    /// Records the time of a step, seconds, for a number of bodies of a kind: a scheme and a layout except its count.
    void add(const std::string& kind, std::size_t bodies, double seconds);

    /// Extrapolates from the largest count below `bodies` with the power between it and the previous count, 1 to 2: of
    /// the kind, or of `similar` if the kind has only one count, or 2 if neither has two counts. Absent if the kind has
    /// none.
    std::optional<double> seconds_at(const std::string& kind, const std::string& similar,
                                     std::size_t bodies) const;

private:
    std::optional<double> power_at(const std::string& kind, std::size_t bodies) const;

    std::map<std::string, std::map<std::size_t, double>> seconds_;
};

/// Adds findings: how schemes slow down along the table's parameter, which is the fastest, which ones need similar
/// bodies, and which points were left out.
void judge_limits(const StudyTable& table, std::vector<std::string>& findings);

}  // namespace terrane::tools
