// SPDX-License-Identifier: MIT
#include "objects/level_choice.h"
#include "support/random.h"

#include <terrane/scene/frame_governor.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

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

}  // namespace log_scale_test
}  // namespace terrane::internal

namespace terrane::test::frame_governor {
namespace {

// The cost of a frame: a constant, a part in proportion, and noise.
struct Model {
    double constant_ms = 2.0, ms_per_triangle = 2e-5, noise = 0.03;
    std::size_t needed = 10'000'000;  ///< triangles that the error target needs

    std::size_t drawn(std::size_t budget) const { return std::min(budget, needed); }
    double cost(std::size_t triangles, Random& random) const {
        return (constant_ms + ms_per_triangle * static_cast<double>(triangles)) *
               (1.0 + random.between(-noise, noise));
    }
};

FrameGovernor make(std::size_t first = 50'000) {
    return FrameGovernor::create({.frame_ms = 16.0, .most_budget = 100'000'000}, first).value();
}

// The time of a frame that draws as many triangles as the governor allows and the model needs, milliseconds; an outlier
// takes `factor` times as long.
double run_frame(FrameGovernor& governor, const Model& model, Random& random, double factor = 1.0) {
    const std::size_t triangles = model.drawn(governor.budget());
    const double ms = model.cost(triangles, random) * factor;
    governor.add_frame(ms, triangles, triangles < model.needed);
    return ms;
}

// The times of frames from the 31st on, milliseconds.
std::vector<double> settled_times(const Model& model, int frames, Random& random) {
    FrameGovernor governor = make();
    std::vector<double> times;
    for (int frame = 0; frame < frames; ++frame) {
        const double ms = run_frame(governor, model, random);
        if (frame >= 30) times.push_back(ms);
    }
    return times;
}

double mean_of(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(FrameGovernor, SettlesWithinATenthOfItsTimeInThirtyFrames) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Model model;
        model.constant_ms = random.between(0.0, 4.0);
        model.ms_per_triangle = std::exp2(random.between(-17.0, -14.0));
        const std::vector<double> times = settled_times(model, 60, random);
        EXPECT_LT(*std::max_element(times.begin(), times.end()), 16.0 * 1.1);
        EXPECT_NEAR(mean_of(times), 16.0, 1.6);
    }
}

// On a busy machine the mean of the frames keeps the time, not the longest of them.
TEST(FrameGovernor, NoiseDoesNotLowerTheBudget) {
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Model model;
        model.noise = random.between(0.05, 0.2);
        model.ms_per_triangle = std::exp2(random.between(-17.0, -14.0));
        EXPECT_NEAR(mean_of(settled_times(model, 150, random)), 16.0, 1.6)
            << "noise " << model.noise;
    }
}

TEST(FrameGovernor, AnOutlierCostsOneFrame) {
    Random random(4);
    FrameGovernor governor = make();
    for (int frame = 0; frame < 300; ++frame) {
        const bool is_outlier = frame % 20 == 19;
        const double ms = run_frame(governor, {}, random, is_outlier ? 3.0 : 1.0);
        if (frame < 60) continue;
        if (frame % 20 == 0) {
            ASSERT_LT(ms, 0.7 * 16.0)
                << "the frame after an outlier has a smaller budget, frame " << frame;
        } else if (!is_outlier) {
            ASSERT_NEAR(ms, 16.0, 2.4) << "frame " << frame;
        }
    }
}

TEST(FrameGovernor, ASuddenCrowdIsOverInFiveFrames) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Model model;
        FrameGovernor governor = make();
        for (int frame = 0; frame < 60; ++frame) run_frame(governor, model, random);
        // triangles cost up to five times as much from one frame to the next
        model.ms_per_triangle *= random.between(1.5, 5.0);
        int over = 0;
        for (int frame = 0; frame < 40; ++frame) {
            const double ms = run_frame(governor, model, random);
            if (ms <= 16.0 * 1.1) continue;
            ++over;
            ASSERT_LT(frame, 5) << "frame " << frame << " took " << ms;
        }
        EXPECT_GE(over, 1) << "the first frame of the crowd is too long whatever the governor does";
    }
}

TEST(FrameGovernor, ABudgetThatIsNotNeededDoesNotGrowWithoutEnd) {
    Random random(1);
    Model model;
    model.needed = 100'000;  // 4 ms
    FrameGovernor governor = make();
    for (int frame = 0; frame < 300; ++frame) {
        run_frame(governor, model, random);
        ASSERT_LE(static_cast<double>(governor.budget()), 100'000.0 * std::pow(1.15, 3.0));
    }
    // when more is needed it comes, and is not too much
    model.needed = 10'000'000;
    for (int frame = 0; frame < 60; ++frame)
        ASSERT_LT(run_frame(governor, model, random), 16.0 * 1.1);
    EXPECT_GT(governor.budget(), 500'000u);
}

// Nothing is seen, then all, in turn: what was learnt of the cost of triangles stays, so that the first frames that see
// something again have nearly their budget, and none exceeds the time for long.
TEST(FrameGovernor, FramesWithoutTrianglesDoNotChangeWhatTrianglesCost) {
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Model model;
        model.ms_per_triangle = std::exp2(random.between(-17.0, -14.0));
        FrameGovernor governor = make();
        for (int turn = 0; turn < 3; ++turn) {
            for (const std::size_t needed : {std::size_t{0}, std::size_t{100'000'000}}) {
                model.needed = needed;
                for (int frame = 0; frame < 40; ++frame) {
                    const double ms = run_frame(governor, model, random);
                    ASSERT_LT(ms, 16.0 * 1.1) << "frame " << frame;
                    if (needed == 0 || turn == 0) continue;
                    ASSERT_GT(ms, 16.0 * 0.8) << "frame " << frame;
                }
            }
        }
    }
}

// Objects of one kind come by the thousand: no triangle at all, or many.
TEST(FrameGovernor, GrowsThroughBudgetsThatDrawNoMoreThanTheOnesBefore) {
    const Model model;
    for (const std::size_t step : {3'000u, 20'000u, 150'000u}) {
        Random random(step);
        FrameGovernor governor = make(2'000);
        double last_ms = 0.0;
        for (int frame = 0; frame < 90; ++frame) {
            const std::size_t triangles = governor.budget() / step * step;
            last_ms = model.cost(triangles, random);
            governor.add_frame(last_ms, triangles, true);
            ASSERT_LT(last_ms, 16.0 * 1.1);
        }
        const double of_a_step = model.ms_per_triangle * static_cast<double>(step);
        EXPECT_GT(last_ms, 16.0 * 0.9 - of_a_step) << step;
    }
}

TEST(FrameGovernor, KeepsToItsRangeWhateverTheTimes) {
    Random random(2);
    const GovernorSettings settings{.frame_ms = 16.0, .least_budget = 5'000, .most_budget = 80'000};
    FrameGovernor governor = FrameGovernor::create(settings, 1'000'000).value();
    EXPECT_EQ(governor.budget(), 80'000u);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (int frame = 0; frame < 2000; ++frame) {
        double ms = std::exp2(random.between(-20.0, 30.0));
        if (random.below(10) == 0) ms = nan;
        if (random.below(10) == 0) ms = -1.0;
        if (random.below(10) == 0) ms = std::numeric_limits<double>::infinity();
        const std::size_t drawn = random.below(5) == 0 ? 0 : governor.budget();
        governor.add_frame(ms, drawn, random.below(2) == 0);
        ASSERT_GE(governor.budget(), 5'000u);
        ASSERT_LE(governor.budget(), 80'000u);
    }
    // frames that cannot be kept go to the least budget
    for (int frame = 0; frame < 50; ++frame) governor.add_frame(1e3, governor.budget(), true);
    EXPECT_EQ(governor.budget(), 5'000u);
}

TEST(FrameGovernor, RefusesSettingsOutOfRangeByTheirNames) {
    const auto message = [](const GovernorSettings& settings) {
        const auto made = FrameGovernor::create(settings, 1);
        return made ? std::string() : made.error().message;
    };
    EXPECT_EQ(message({.frame_ms = 0.0}), "frame_ms must be 0.001 to 1e+06, got 0");
    EXPECT_EQ(message({.least_budget = 0}), "least_budget must be 1 to 1000000000, got 0");
    EXPECT_EQ(message({.least_budget = 9, .most_budget = 8}),
              "most_budget must be 9 to 1000000000, got 8");
}

}  // namespace
}  // namespace terrane::test::frame_governor
