// SPDX-License-Identifier: MIT
#include "terrain/source/bound_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <set>
#include <string>
#include <vector>

namespace terrane::fractal_heights_test {

constexpr std::uint64_t kSeed = 21;

std::shared_ptr<const HeightSource> make(const FractalSettings& settings) {
    const auto source = FractalHeights::create(settings);
    EXPECT_TRUE(source.has_value()) << source.error().message;
    return source.value_or(nullptr);
}

/// Rough ground whose last octaves are finer than the lattice.
FractalSettings rough(FractalKind kind = FractalKind::fbm) {
    return {.seed = 3,
            .kind = kind,
            .octave_count = 14,
            .amplitude = 300.0,
            .wavelength_log2 = 10,
            .gain = 0.55};
}

/// Promises of every kind of fractal.
class FractalHeightsOfKind : public testing::TestWithParam<FractalKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, FractalHeightsOfKind, test::kAllFractalKinds);

std::string refusal(const FractalSettings& settings) {
    const auto source = FractalHeights::create(settings);
    EXPECT_FALSE(source.has_value());
    if (source) return "";
    EXPECT_EQ(source.error().code, ErrorCode::invalid_argument);
    return source.error().message;
}

TEST_P(FractalHeightsOfKind, HeightAtALatticePointIsItsSampleBitForBit) {
    test::SeededRandom random(kSeed);
    for (const int spacing_log2 : {-16, -3, 0, 5}) {
        FractalSettings settings = rough(GetParam());
        settings.finest_spacing_log2 = spacing_log2;
        settings.root_size_log2 = spacing_log2 + 20;
        const auto source = make(settings);
        for (const std::int64_t step : {1, 2, 64, 4096}) {
            const SampleGrid grid = test::random_grid(step, 100'000, 9, 7, random);
            std::vector<double> heights(grid.size());
            ASSERT_TRUE(source->sample(grid, heights).has_value());
            for (int row = 0; row < grid.rows; ++row) {
                for (int column = 0; column < grid.columns; ++column) {
                    const double x = source->lattice().x(grid.corner.x + step * column);
                    const double y = source->lattice().y(grid.corner.y + step * row);
                    EXPECT_EQ(heights[static_cast<std::size_t>(row * grid.columns + column)],
                              source->height(x, y));
                }
            }
        }
    }
}

TEST_P(FractalHeightsOfKind, BoundsAreNeverBelowTheTrueDeviation) {
    test::SeededRandom random(kSeed);
    const auto source = make(rough(GetParam()));
    for (const std::int64_t step : {1, 2, 4, 16, 64, 512}) {
        double closest = 0.0;
        for (int place = 0; place < 4; ++place) {
            closest = std::max(
                closest, test::check_bounds(
                             *source, test::random_grid(step, 10'000, 10, 11, random), 60, random));
        }
        // the bound of a product assumes that all factors are at their maximum
        EXPECT_GE(closest, GetParam() == FractalKind::hybrid ? 0.2 : 0.3)
            << "a bound that is never near says little, step " << step;
    }
}

TEST_P(FractalHeightsOfKind, BoundsHoldFarBelowTheFinestWavelengthAndFarAbove) {
    test::SeededRandom random(kSeed);
    FractalSettings settings = rough(GetParam());
    settings.finest_spacing_log2 = -12;
    settings.root_size_log2 = 12;
    settings.octave_count = 6;
    const auto smooth = make(settings);
    test::check_bounds(*smooth, test::random_grid(1, 1'000'000, 10, 10, random), 60, random);
    settings.finest_spacing_log2 = 8;
    settings.root_size_log2 = 20;
    settings.octave_count = 20;
    const auto white = make(settings);
    test::check_bounds(*white, test::random_grid(64, 1000, 10, 10, random), 60, random);
}

TEST_P(FractalHeightsOfKind, BoundsAreNestedExactlyWithinASpacing) {
    test::SeededRandom random(kSeed);
    for (const double gain : {0.4, 0.55, 0.9}) {
        FractalSettings settings = rough(GetParam());
        settings.gain = gain;
        const auto source = make(settings);
        for (std::int64_t step = 1; step <= 2048; step *= 2) {
            test::check_nesting_of_spacing(*source,
                                           test::random_grid(step, 10'000, 33, 33, random));
            test::check_nesting_of_spacing(*source,
                                           test::random_grid(step, 10'000, 16, 18, random));
        }
    }
}

// A child extends beyond its parent and uses finer samples.
TEST_P(FractalHeightsOfKind, BoundsAreNestedNearlyFromSpacingToSpacing) {
    test::SeededRandom random(kSeed);
    const auto source = make(rough(GetParam()));
    int pairs = 0, above = 0;
    double most = 1.0;
    for (std::int64_t step = 2; step <= 2048; step *= 2) {
        SampleGrid coarse = test::random_grid(step, 10'000, 33, 33, random);
        const SampleGrid fine{coarse.corner, step / 2, 65, 65};
        const std::vector<float> parents = test::vertex_bounds(*source, coarse);
        const std::vector<float> children = test::vertex_bounds(*source, fine);
        for (int row = 1; row < fine.rows; row += 2) {
            for (int column = 1; column < fine.columns; column += 2) {
                const float child = children[test::at(fine, column, row)];
                for (const int dx : {-1, 1}) {
                    for (const int dy : {-1, 1}) {
                        const int x = (column + dx) / 2, y = (row + dy) / 2;
                        if (((x ^ y) & 1) == 0) continue;  // not a midpoint
                        const float parent = parents[test::at(coarse, x, y)];
                        ++pairs;
                        above += child > parent ? 1 : 0;
                        most = std::max(most, static_cast<double>(child / parent));
                    }
                }
            }
        }
    }
    std::printf("  %d of %d children above a parent, by a factor of %.3f at most\n", above, pairs,
                most);
    EXPECT_LE(above, pairs / 16);
    EXPECT_LE(most, 1.5);
}

// Bounds twice as large as necessary would pass all other tests.
TEST_P(FractalHeightsOfKind, BoundsAreNearWhatDenseSamplesMeasure) {
    test::SeededRandom random(kSeed);
    const auto source = make(rough(GetParam()));
    const double most = GetParam() == FractalKind::fbm ? 2.2 : 3.5;  // previously 3.2 to 8
    for (const std::int64_t step : {4, 32}) {
        std::vector<double> ratios;
        const SampleGrid grid = test::random_grid(step, 10'000, 9, 9, random);
        const std::vector<float> bounds = test::vertex_bounds(*source, grid);
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                if (((row | column) & 1) == 0) continue;
                double measured = 0.0;
                for (const test::Triangle& triangle : test::diamond(
                         grid.corner.x + step * column, grid.corner.y + step * row, step)) {
                    measured = std::max(measured, test::measure(*source, triangle, 500, random));
                }
                ratios.push_back(static_cast<double>(bounds[test::at(grid, column, row)]) /
                                 measured);
            }
        }
        std::ranges::sort(ratios);
        const double median = ratios[ratios.size() / 2];
        std::printf("  step %d: bounds are %.2f times what is measured\n", static_cast<int>(step),
                    median);
        EXPECT_LE(median, most);
    }
}

TEST_P(FractalHeightsOfKind, IntervalOfAPointIsItsHeight) {
    test::SeededRandom random(kSeed);
    const auto source = make(rough(GetParam()));
    for (int point = 0; point < 1000; ++point) {
        const double x = random.between(-1e5, 1e5), y = random.between(-1e5, 1e5);
        const HeightInterval interval = source->interval({x, y, x, y});
        ASSERT_GE(source->height(x, y), interval.low);
        ASSERT_LE(source->height(x, y), interval.high);
        ASSERT_LE(interval.high - interval.low, 1e-6);
    }
}

TEST_P(FractalHeightsOfKind, IsContinuousAndGoesOnForAnyFiniteCoordinate) {
    const auto source = make(rough(GetParam()));
    for (const double x :
         {0.0, -0.0, 1e-300, -1e-300, 1e18, -1e18, 0x1p39, -0x1p39,
          std::numeric_limits<double>::max(), -std::numeric_limits<double>::max()}) {
        EXPECT_TRUE(std::isfinite(source->height(x, 1.0)));
        EXPECT_TRUE(std::isfinite(source->height(1.0, x)));
        EXPECT_LE(std::abs(source->height(x, 3.0)), source->interval({-1e9, -1e9, 1e9, 1e9}).high);
    }
    for (const double edge : {0.0, 1.0, 1024.0, 0x1p39, -0x1p39}) {
        const double below = std::nextafter(edge, -1e300), above = std::nextafter(edge, 1e300);
        EXPECT_NEAR(source->height(below, 7.0), source->height(above, 7.0),
                    source->rise_bound(above - below) + 1e-9);
    }
}

TEST_P(FractalHeightsOfKind, NeighboursFarFromTheOriginDoNotRepeat) {
    const auto source = make({.seed = 9, .kind = GetParam(), .root_size_log2 = 20});
    for (const double far : {0.0, 1e7, -1e9}) {
        std::set<double> seen;
        for (int column = 0; column < 1000; ++column) {
            seen.insert(source->height(far + column, far));
            seen.insert(source->height(far + 0.5, far + 0.25 * column));
        }
        EXPECT_EQ(seen.size(), 2000u) << far;
    }
}

TEST_P(FractalHeightsOfKind, EveryHeightIsA32BitMultipleOfTheQuantum) {
    for (const int spacing_log2 : {-16, 0, 16}) {
        const auto source = make({.kind = GetParam(),
                                  .octave_count = 20,
                                  .amplitude = 1e5,
                                  .wavelength_log2 = 20,
                                  .gain = 1.0,
                                  .finest_spacing_log2 = spacing_log2,
                                  .root_size_log2 = spacing_log2 + 10});
        const HeightInterval all = source->interval({-1e9, -1e9, 1e9, 1e9});
        EXPECT_LT(all.high / source->lattice().quantum, 0x1p31);
        EXPECT_GT(all.low / source->lattice().quantum, -0x1p31);
    }
}

TEST_P(FractalHeightsOfKind, FlatGroundHasZeroBounds) {
    const auto source = make({.kind = GetParam(), .amplitude = 0.0});
    const SampleGrid grid{{0, 0}, 2, 5, 5};
    std::vector<float> bounds(grid.size(), 1.0f);
    ASSERT_TRUE(source->vertex_bounds(grid, bounds).has_value());
    for (const float bound : bounds) EXPECT_EQ(bound, 0.0f);
    EXPECT_EQ(source->rise_bound(1e9), 0.0);
}

TEST(FractalHeights, RefusesSettingsByNameAndValue) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(refusal({.octave_count = 25}), "octave_count must be 1 to 24, got 25");
    EXPECT_EQ(refusal({.octave_count = 0}), "octave_count must be 1 to 24, got 0");
    EXPECT_EQ(refusal({.kind = static_cast<FractalKind>(4)}),
              "kind must be fbm, ridged, hybrid or warped, got number 4");
    const std::vector<std::pair<const char*, FractalSettings>> refused{
        {"amplitude", {.amplitude = -1.0}},
        {"nan", {.amplitude = nan}},
        {"wavelength_log2", {.wavelength_log2 = 25}},
        {"gain", {.gain = 0.0}},
        {"gain", {.gain = nan}},
        {"1.5", {.gain = 1.5}},
        {"heterogeneity must be", {.heterogeneity = -0.1}},
        {"nan", {.heterogeneity = nan}},
        {"crest_rounding", {.crest_rounding = 0.01}},
        {"1.5", {.warp = 1.5}},
        {"17", {.finest_spacing_log2 = 17}},
        {"root_size_log2", {.root_size_log2 = 6}},
        {"root_size_log2", {.root_size_log2 = 32}},
        {"root_count_x", {.root_count_x = 0}},
        {"octave_count", {.octave_count = 24, .wavelength_log2 = 2}},
        {"2^38 m of the origin",
         {.finest_spacing_log2 = 16, .root_size_log2 = 38, .root_count_x = 3}},
    };
    for (const auto& [part, settings] : refused) {
        const std::string message = refusal(settings);
        EXPECT_NE(message.find(part), std::string::npos) << message;
    }
}

}  // namespace terrane::fractal_heights_test

// Worlds of 25 levels with four root squares of 2^31 spacings.

namespace terrane::endless_fractal_test {

constexpr std::uint64_t kSeed = 23;

std::shared_ptr<const HeightSource> make(FractalSettings settings) {
    settings.root_size_log2 = settings.finest_spacing_log2 + 31;
    const auto source = FractalHeights::create(settings);
    EXPECT_TRUE(source.has_value()) << source.error().message;
    return source.value_or(nullptr);
}

class EndlessFractal : public testing::TestWithParam<FractalKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EndlessFractal, test::kAllFractalKinds);

/// A grid of 5 x 4 samples whose south-western corner is the lattice point below a position.
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
    test::SeededRandom random(kSeed);
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
            std::erase(bounds, 0.0f);  // points of coarser spacings have no bound
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
    const double place = 1e9;
    SourceCheckSettings settings{.seed = kSeed, .places = 1, .points = 1};
    settings.region = WorldRect{place - 4e3, place - 4e3, place + 4e3, place + 4e3};
    const SourceReport report =
        check_source(*make({.seed = 7, .kind = GetParam()}), settings).value();
    EXPECT_TRUE(report.is_clean()) << to_text(report);
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

}  // namespace terrane::endless_fractal_test
