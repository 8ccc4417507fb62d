// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace terrane::internal {

/// How long loads have taken lately, by level: what the pager reckons with.
class LoadTimes {
public:
    void take(int level, double seconds) {
        take_into(levels_[index(level)], seconds);
        take_into(all_, seconds);
    }

    /// Seconds that a load of a level may take: the mean and twice the mean deviation of the last
    /// dozen or so. What was never loaded takes as long as all others do.
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
    static constexpr double kShare = 0.1;  // of each new time
    static constexpr int kEnough = 4;
    static constexpr double kUnknown_s = 0.05;

    static std::size_t index(int level) { return static_cast<std::size_t>(level); }
    static void take_into(Times& times, double seconds) {
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
