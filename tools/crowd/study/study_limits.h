// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study/study.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// Estimates the time of a step (an update and a query) of many bodies from measured steps of fewer.
class StepTimes {
public:
    /// Records the seconds of a step of that many bodies of a kind: a scheme, and everything of a layout but its count.
    void add(const std::string& kind, std::size_t bodies, double seconds);

    /// From the largest count below `bodies`, by the power of the bodies between it and the one before: of the kind, or
    /// where it has only one count of `similar`, at least 1 and at most 2. 2 where neither has two counts. Absent where
    /// the kind has none.
    std::optional<double> seconds_at(const std::string& kind, const std::string& similar,
                                     std::size_t bodies) const;

private:
    std::optional<double> power_at(const std::string& kind, std::size_t bodies) const;

    std::map<std::string, std::map<std::size_t, double>> seconds_;
};

/// How schemes slow down along the table's parameter, which of them is the fastest, which ones need similar bodies, and
/// what was left out. Computed from the table.
void judge_limits(const StudyTable& table, std::vector<std::string>& findings);

}  // namespace terrane::tools
