// SPDX-License-Identifier: MIT
#include "support/fractal_kind_name.h"
#include "support/random.h"
#include "terrain/source/bound_checks.h"

#include <terrane/terrain/check_source.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

// Worlds of 25 levels: four root squares of 2^31 spacings.
namespace terrane {
namespace endless_fractal_test {

constexpr std::uint64_t kSeed = 23;

std::shared_ptr<const HeightSource> make(FractalSettings settings) {
    settings.root_size_log2 = settings.finest_spacing_log2 + 31;
    const auto source = FractalHeights::create(settings);
    EXPECT_TRUE(source.has_value()) << source.error().message;
    return source.value_or(nullptr);
}

class EndlessFractal : public testing::TestWithParam<FractalKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EndlessFractal, test::kAllFractalKinds);

/// Samples of a 5 x 4 grid of a lattice whose south-western corner is nearest to a place.
std::vector<double> samples_near(const HeightSource& source, double x, double y) {
    const Lattice& l = source.lattice();
    const SampleGrid grid{{static_cast<std::int64_t>(std::floor((x - l.origin_x) / l.spacing)),
                           static_cast<std::int64_t>(std::floor((y - l.origin_y) / l.spacing))},
                          1,
                          5,
                          4};
    std::vector<double> heights(grid.size());
    EXPECT_TRUE(source.sample(grid, heights).has_value());
    EXPECT_EQ(heights[0], source.height(l.x(grid.corner.x), l.y(grid.corner.y)));
    return heights;
}

TEST_P(EndlessFractal, HeightsAreThoseOfEveryOtherWorldOfTheSeed) {
    for (const int spacing_log2 : {-10, 0}) {
        const FractalSettings settings{
            .seed = 5, .kind = GetParam(), .finest_spacing_log2 = spacing_log2};
        const auto endless = make(settings);
        FractalSettings small = settings;
        small.root_size_log2 = spacing_log2 + 10;
        const auto near = FractalHeights::create(small).value();
        const double side = std::ldexp(1.0, spacing_log2 + 31);
        for (const double place : {0.0, 1e6, 65536.0, -1e9, 1e9, 1.05e9}) {
            FractalSettings moved = settings;
            moved.origin_x = std::floor(place / side) * side;
            moved.origin_y = -std::floor(place / side) * side;
            const auto around = make(moved);
            EXPECT_EQ(around->lattice().origin_x, moved.origin_x);
            EXPECT_EQ(around->extent().east, moved.origin_x + side);
            const std::vector<double> heights = samples_near(*near, place, -place);
            EXPECT_EQ(samples_near(*endless, place, -place), heights) << place;
            EXPECT_EQ(samples_near(*around, place, -place), heights) << place;
        }
    }
}

TEST_P(EndlessFractal, BoundsBeyondTheFirstWavelengthAreOneAndAtLeastThoseBelow) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
    const auto source = make({.seed = 6, .kind = GetParam(), .wavelength_log2 = 9});
    const HeightInterval range = source->interval({-1e9, -1e9, 1e9, 1e9});
    float coarse = 0.0f;
    for (int log2 = 31; log2 >= 7; --log2) {
        const std::int64_t step = std::int64_t{1} << log2;
        const SampleGrid grid = test::random_grid(step, 10, 17, 17, random);
        std::vector<float> bounds = test::vertex_bounds(*source, grid);
        const std::vector<float> cells = test::cell_bounds(*source, grid);
        const auto [least, most] = std::ranges::minmax(cells);
        const float of_vertices = std::ranges::max(bounds);
        if (log2 > 9) {
            std::erase(bounds, 0.0f);  // points of coarser spacings
            EXPECT_EQ(least, most) << log2;
            EXPECT_EQ(std::ranges::min(bounds), most) << log2;
            EXPECT_EQ(of_vertices, most) << log2;
            EXPECT_GE(static_cast<double>(most), range.high - range.low);
            coarse = most;
        }
        EXPECT_LE(of_vertices, coarse) << log2;
        EXPECT_LE(most, coarse) << log2;
    }
}

TEST_P(EndlessFractal, KeepsEveryLawOnAllLevelsFarAway) {
    {
        const double place = 1e9;
        SourceCheckSettings settings{.seed = kSeed, .places = 1, .points = 1};
        settings.region = WorldRect{place - 4e3, place - 4e3, place + 4e3, place + 4e3};
        const Result<SourceReport> report =
            check_source(*make({.seed = 7, .kind = GetParam()}), settings);
        ASSERT_TRUE(report) << report.error().message;
        EXPECT_TRUE(report->is_clean()) << to_text(*report);
    }
}

TEST(FractalOrigin, IsAMultipleOfARootSquare) {
    const auto refusal = [](double origin_x, double origin_y) {
        const auto source = FractalHeights::create({.origin_x = origin_x, .origin_y = origin_y});
        return source ? std::string() : source.error().message;
    };
    EXPECT_EQ(refusal(-0x1p31, 65536.0), "");
    EXPECT_EQ(refusal(100.0, 0.0),
              "origin_x must be a multiple of a root square's side, 2^16 m, got 100");
    EXPECT_NE(refusal(0.0, 1.0).find("origin_y"), std::string::npos);
    EXPECT_NE(refusal(std::numeric_limits<double>::quiet_NaN(), 0.0).find("nan"),
              std::string::npos);
    EXPECT_NE(refusal(0.0, 0x1p39).find("origin_y"), std::string::npos);
    EXPECT_NE(refusal(0x1p38, 0.0).find("2^38"), std::string::npos) << "a root square beyond";
}

}  // namespace endless_fractal_test
}  // namespace terrane
