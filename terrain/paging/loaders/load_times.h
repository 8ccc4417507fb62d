// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace terrane::internal {

/// Running mean and deviation of load times by level.
class LoadTimes {
public:
    void add(int level, double seconds) {
        add_to(levels_[index(level)], seconds);
        add_to(all_, seconds);
    }

    /// Expected time of a load of a level, seconds: mean plus twice the mean deviation, weighted over about
    /// the last ten. Levels with fewer than four loads use those of all levels.
    double expected_s(int level) const {
        const Times& own = levels_[index(level)];
        const Times& times = own.count >= kEnough ? own : all_;
        return times.count > 0 ? times.mean_s + 2.0 * times.deviation_s : kUnknown_s;
    }

private:
    struct Times {
        double mean_s = 0.0;
        double deviation_s = 0.0;
        int count = 0;
    };
    static constexpr double kShare = 0.1;  // weight of a new time
    static constexpr int kEnough = 4;
    static constexpr double kUnknown_s = 0.05;

    static std::size_t index(int level) { return static_cast<std::size_t>(level); }
    static void add_to(Times& times, double seconds) {
        const double off = std::abs(seconds - times.mean_s);
        if (times.count == 0) {
            times.mean_s = seconds;
        } else {
            times.mean_s += kShare * (seconds - times.mean_s);
            times.deviation_s += kShare * (off - times.deviation_s);
        }
        times.count = std::min(times.count + 1, kEnough);
    }

    std::array<Times, 32> levels_;
    Times all_;
};

}  // namespace terrane::internal
