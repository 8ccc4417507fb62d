// SPDX-License-Identifier: MIT
#include "objects/level_choice.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terrane::internal {
namespace log_scale_test {

TEST(LogScale, IsWithinTwoMillionthsOfTheLogarithm) {
    double worst = 0.0;
    for (double x = 1e-37; x < 1e38; x *= 1.00037) {
        const auto value = static_cast<float>(x);
        worst = std::max(worst, std::abs(static_cast<double>(log2_of(value)) -
                                         std::log2(static_cast<double>(value))));
    }
    // beside the rounding of the result, which has up to seven bits before the point
    EXPECT_LT(worst, 2e-6 + 0x1p-18);
}

TEST(LogScale, BinsEncloseTheirErrors) {
    test::Random random(5);
    for (int i = 0; i < 100'000; ++i) {
        const auto log2_px = static_cast<float>(random.between(-9.9, 19.9));
        const double px = std::exp2(static_cast<double>(log2_px));
        const int above = ErrorBins::bin_above(log2_px), below = ErrorBins::bin_below(log2_px);
        ASSERT_GE(ErrorBins::upper_px(above) * (1.0 + 1e-6), px);
        ASSERT_LE(ErrorBins::upper_px(below) * (1.0 - 1e-6), px);
        ASSERT_LE(above - below, 1);
    }
    EXPECT_EQ(ErrorBins::bin_above(-1e30f), 0);
    EXPECT_EQ(ErrorBins::bin_below(-1e30f), -1);
    EXPECT_EQ(ErrorBins::bin_above(1e30f), ErrorBins::kCount - 1);
    EXPECT_EQ(ErrorBins::bin_below(1e30f), ErrorBins::kCount - 2);
    EXPECT_TRUE(std::isinf(ErrorBins::upper_px(ErrorBins::kCount - 1)));
}

TEST(DemandHistogram, BoundsTheSumAtEveryThreshold) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        test::Random random(seed);
        struct Interval {
            float low, high;
            std::uint32_t triangles;
        };
        std::vector<Interval> intervals;
        DemandHistogram histogram;
        histogram.clear();
        for (int i = random.below(30); i > 0; --i) {
            const auto low = static_cast<float>(random.between(-14.0, 22.0));
            const auto high = low + static_cast<float>(random.between(0.0, 5.0));
            const auto triangles = static_cast<std::uint32_t>(random.below(1 << 20));
            intervals.push_back({low, high, triangles});
            histogram.add(high, triangles);
            histogram.remove(low, triangles);
        }
        std::vector<TriangleDemand> demands;
        histogram.append_to(demands);
        for (double log2_px = -15.0; log2_px < 24.0; log2_px += 0.01) {
            const double px = std::exp2(log2_px);
            std::size_t drawn = 0, bound = 0;
            for (const Interval& interval : intervals) {
                if (log2_px >= static_cast<double>(interval.low) &&
                    log2_px < static_cast<double>(interval.high))
                    drawn += interval.triangles;
            }
            for (const TriangleDemand& demand : demands)
                bound += demand.threshold_px > px ? demand.triangles : 0;
            ASSERT_LE(drawn, bound) << px;
        }
    }
}

}  // namespace log_scale_test
}  // namespace terrane::internal
