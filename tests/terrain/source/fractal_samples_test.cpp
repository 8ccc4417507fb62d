// SPDX-License-Identifier: MIT
#include "source/fractal/fractal_surface.h"
#include "terrain/source/bound_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace terrane::head_samples_test {

constexpr std::uint64_t kSeed = 61;
constexpr int kSide = 9;  // samples along a side

class HeadSamplesOfKind : public testing::TestWithParam<FractalKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, HeadSamplesOfKind, test::kAllFractalKinds);

FractalSettings rough(FractalKind kind, std::uint64_t seed, bool strong) {
    FractalSettings settings = {
        .seed = seed, .kind = kind, .octave_count = 9, .amplitude = 100.0, .wavelength_log2 = 9};
    if (strong) {
        settings.octave_count = 4;
        settings.heterogeneity = 1.0;
        settings.crest_rounding = 1.0 / 64.0;
        settings.warp = 1.0;
    }
    return settings;
}

/// A head of octaves and its samples over a square.
struct Sampled {
    FractalSurface surface;
    FractalHead head;
    UnitGrid grid;
    double step = 1.0;  ///< metres
    std::vector<double> centres, radii;

    Sampled(const FractalSettings& settings, int step_log2, test::Random& random)
        : surface(settings), step(std::ldexp(1.0, step_log2)) {
        head = FractalBounds(surface).head(std::sqrt(2.0) * step * (1.0 + 1e-15));
        grid.step = std::uint64_t{1} << (step_log2 - kUnitLog2);
        grid.x = grid.step * static_cast<std::uint64_t>(random.below(100'000));
        grid.y = grid.step * static_cast<std::uint64_t>(random.below(100'000));
        grid.columns = grid.rows = kSide;
        HeadSamples samples(surface, head, internal::best_simd_level());
        centres.resize(std::size_t{kSide} * kSide);
        radii.resize(samples.has_radii() ? centres.size() : 0);
        samples.sample(grid, centres, radii);
        if (!samples.has_radii()) radii.assign(centres.size(), head.radius);
    }

    /// Over the triangle with its right angle at a corner of a cell: by how much the height at weights (1 - a - b, a,
    /// b) leaves the range interpolated from the samples, relative to what the head's bend allows.
    double excess(int column, int row, bool upper, double a, double b) const {
        const int to = upper ? -1 : 1;
        const std::array<std::size_t, 3> at{index(column, row), index(column + to, row),
                                            index(column, row + to)};
        const std::array<double, 3> weights{1.0 - a - b, a, b};
        double centre = 0.0, radius = 0.0;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            centre += weights[corner] * centres[at[corner]];
            radius += weights[corner] * radii[at[corner]];
        }
        const double x =
            std::ldexp(static_cast<double>(grid.x), kUnitLog2) + step * (column + to * a);
        const double y = std::ldexp(static_cast<double>(grid.y), kUnitLog2) + step * (row + to * b);
        return (std::abs(surface.height(x, y) - centre) - radius) / head.bend;
    }

private:
    static std::size_t index(int column, int row) {
        return static_cast<std::size_t>(row * kSide + column);
    }
};

double largest_excess(const Sampled& sampled, test::Random& random) {
    double largest = -1e300;
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            for (const bool upper : {false, true}) {
                const int last = kSide - 1;
                if (upper ? row == 0 || column == 0 : row == last || column == last) continue;
                largest = std::max(largest, sampled.excess(column, row, upper, 0.0, 0.0));
                largest = std::max(largest, sampled.excess(column, row, upper, 0.5, 0.5));
                for (int point = 0; point < 4; ++point) {
                    const double a = random.between(0.0, 1.0);
                    largest = std::max(largest, sampled.excess(column, row, upper, a,
                                                               random.between(0.0, 1.0 - a)));
                }
            }
        }
    }
    return largest;
}

TEST_P(HeadSamplesOfKind, HeightsAreWithinWhatTheySay) {
    test::SeededRandom random(kSeed);
    for (const bool strong : {false, true}) {
        // from steps at which all octaves are sampled, most of them coarsely, to steps at which none is
        for (const int step_log2 : {-8, -4, -2, 0, 2, 4, 6, 9, 12}) {
            double largest = -1e300;
            FractalHead head;
            for (int place = 0; place < 40; ++place) {
                const Sampled sampled(rough(GetParam(), random.bits(), strong), step_log2, random);
                head = sampled.head;
                largest = std::max(largest, largest_excess(sampled, random));
            }
            EXPECT_LE(largest, 1.0);
            if (head.octave_count == 0) continue;
            std::printf("  step 2^%d m: %d octaves, %d of them coarse: %.3f of what is allowed\n",
                        step_log2, head.octave_count, head.coarse_count, largest);
            // if the head has all octaves, only the bend bounds the excess: it must not be overly loose
            if (head.octave_count == 9) {
                EXPECT_GE(largest, 0.04);
            }
        }
    }
}

TEST_P(HeadSamplesOfKind, AllOctavesAreSampledWhereTheyAreSmoothAndNoneFarAbove) {
    const FractalSurface surface(rough(GetParam(), kSeed, false));
    const FractalBounds bounds(surface);
    const FractalHead smooth = bounds.head(0x1p-6);
    EXPECT_EQ(smooth.octave_count, 9);
    EXPECT_GT(smooth.coarse_count, 0);
    EXPECT_LT(smooth.coarse_count, 9);
    EXPECT_GT(smooth.bend, bounds.interpolation(0x1p-6));         // fewer samples loosen the bound,
    EXPECT_LT(smooth.bend, 1.13 * bounds.interpolation(0x1p-6));  // but only a little
    EXPECT_EQ(smooth.radius, 0.0);
    EXPECT_EQ(smooth.radius_slope, 0.0);
    const FractalHead none = bounds.head(0x1p16);
    EXPECT_EQ(none.octave_count, 0);
    const HeightInterval range = bounds.range();
    const double low = none.centre + none.centre_slope - none.radius - none.radius_slope;
    const double high = none.centre + none.centre_slope + none.radius + none.radius_slope;
    EXPECT_NEAR(high, range.high, 1e-6);
    // at the minimum each value of a multifractal depends on the previous ones
    const bool ridged = GetParam() == FractalKind::ridged;
    double least = ridged || GetParam() == FractalKind::hybrid ? 0.0 : range.low, weight = 1.0;
    for (int octave = 0; ridged && octave < 9; ++octave) {
        const double value = 0.5 * surface.shape().crest * weight;
        least += std::ldexp(100.0, -octave) * value;
        weight = surface.shape().homogeneity + surface.shape().heterogeneity * value;
    }
    EXPECT_NEAR(low, least, 1e-6);
}

TEST(HeadSamples, BendOfASumIsThatOfItsOctavesAndOfTheCoarseOnesAtTwiceTheStep) {
    FractalSettings settings = rough(FractalKind::fbm, kSeed, false);
    for (const double hypotenuse : {0.05, 0.5, 8.0}) {
        const FractalSurface surface(settings);
        const FractalHead head = FractalBounds(surface).head(hypotenuse);
        ASSERT_GT(head.coarse_count, 0);
        const auto of_first = [&](int count, double length) {
            settings.octave_count = count;
            return FractalBounds(FractalSurface(settings)).interpolation(length);
        };
        const double expected =
            of_first(head.octave_count, hypotenuse) + of_first(head.coarse_count, 2.0 * hypotenuse);
        EXPECT_NEAR(head.bend / expected, 1.0, 1e-6);
        settings.octave_count = 9;
    }
}

TEST_P(HeadSamplesOfKind, HaveTheSameBitsAtTheBestLevelAndAtTheBaseline) {
    test::SeededRandom random(kSeed);
    for (const int step_log2 : {-6, 0, 4}) {
        const Sampled best(rough(GetParam(), kSeed, false), step_log2, random);
        HeadSamples samples(best.surface, best.head, internal::SimdLevel::baseline);
        std::vector<double> centres(best.centres.size());
        std::vector<double> radii(samples.has_radii() ? centres.size() : 0);
        samples.sample(best.grid, centres, radii);
        EXPECT_EQ(centres, best.centres);
        if (samples.has_radii()) {
            EXPECT_EQ(radii, best.radii);
        }
    }
}

TEST_P(HeadSamplesOfKind, OctavesInPiecesHaveTheBitsOfHeights) {
    const FractalSurface surface(rough(GetParam(), kSeed, false));
    const UnitGrid grid{std::uint64_t{77} << 24, std::uint64_t{5} << 30, std::uint64_t{1} << 23,
                        150, 37};
    const auto level = internal::best_simd_level();
    std::vector<double> heights(150 * 37), sums(heights.size(), 0.0), weights(heights.size(), 1.0);
    surface.sample(grid, level, heights);
    surface.add_octaves(grid, 0, 2, level, sums, weights);
    surface.add_octaves(grid, 2, 2, level, sums, weights);
    surface.add_octaves(grid, 2, 9, level, sums, weights);
    EXPECT_EQ(sums, heights);
}

}  // namespace terrane::head_samples_test

namespace terrane::fractal_surface_test {

using internal::SimdLevel;

constexpr std::uint64_t kSeed = 41;
constexpr FractalKind kKinds[] = {FractalKind::fbm, FractalKind::ridged, FractalKind::hybrid,
                                  FractalKind::warped};

FractalSettings rough(FractalKind kind, std::uint64_t seed = 5) {
    return {.seed = seed, .kind = kind, .octave_count = 12, .wavelength_log2 = 9, .gain = 0.6};
}

/// Converts whole metres to fixed-point units of 2^-24 m.
std::uint64_t units(double metres) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(metres)) << 24;
}

TEST(FractalSurface, EveryLevelAndEverySinglePointHaveTheSameBits) {
    test::SeededRandom random(kSeed);
    for (const FractalKind kind : kKinds) {
        const FractalSurface surface(rough(kind, random.bits()));
        for (const double far : {0.0, 1e4, -1e9, 0x1p39 - 8.0}) {
            for (const int step_log2 : {-16, -3, -1, 0, 1, 4, 9, 12}) {
                if (far > 1e11 && step_log2 < -10) continue;  // not representable as doubles
                const double west = std::floor(far + random.between(-100.0, 100.0));
                UnitGrid grid{units(west), units(-west), std::uint64_t{1} << (step_log2 + 24)};
                grid.columns = random.below(2) == 0 ? 131 : 1 + static_cast<int>(random.below(300));
                grid.rows = 1 + static_cast<int>(random.below(40));
                std::vector<double> heights(static_cast<std::size_t>(grid.columns * grid.rows));
                for (const SimdLevel level :
                     {SimdLevel::baseline, SimdLevel::avx2, SimdLevel::avx512}) {
                    if (level > internal::best_simd_level()) continue;
                    std::ranges::fill(heights, -1e300);
                    surface.sample(grid, level, heights);
                    for (std::size_t i = 0; i < heights.size();
                         i += level == SimdLevel::baseline ? 1 : 3) {
                        const std::size_t columns = static_cast<std::size_t>(grid.columns);
                        const double step = std::ldexp(1.0, step_log2);
                        const double x = west + step * static_cast<double>(i % columns);
                        const double y = -west + step * static_cast<double>(i / columns);
                        ASSERT_EQ(heights[i], surface.height(x, y))
                            << "kind " << static_cast<int>(kind) << ", level "
                            << static_cast<int>(level) << ", step 2^" << step_log2 << " at " << x
                            << ", " << y;
                    }
                }
            }
        }
    }
}

TEST(FractalSurface, OneOctaveIsTheShapeOfItsNoise) {
    test::SeededRandom random(kSeed);
    FractalSettings settings = {.octave_count = 1, .amplitude = 2.0, .crest_rounding = 0.125};
    const auto of_kind = [&](FractalKind kind) {
        settings.kind = kind;
        return FractalSurface(settings);
    };
    const FractalSurface noise = of_kind(FractalKind::fbm);
    const FractalSurface ridged = of_kind(FractalKind::ridged);
    const FractalSurface hybrid = of_kind(FractalKind::hybrid);
    int crests = 0;
    for (int point = 0; point < 10'000; ++point) {
        const double x = random.between(-1e6, 1e6), y = random.between(-1e6, 1e6);
        const double t = std::abs(noise.height(x, y) / 2.0 * std::sqrt(2.0));
        const double crest = t < 0.125 ? t * t / 0.25 : t - 0.0625;
        EXPECT_NEAR(ridged.height(x, y), 2.0 * (1.0 - crest), 1e-12);
        EXPECT_NEAR(hybrid.height(x, y), 1.0 + noise.height(x, y) / std::sqrt(2.0), 1e-12);
        if (t < 0.125) ++crests;
    }
    EXPECT_GT(crests, 1000);
    EXPECT_LT(crests, 9000);
}

TEST(FractalSurface, OctavesHangOnTheOnesBeforeThemAsHeterogeneitySays) {
    // finer octaves vanish where the first octave is lowest, and not where it is highest
    FractalSettings settings = rough(FractalKind::ridged);
    settings.heterogeneity = 1.0;
    const FractalSurface all(settings);
    settings.octave_count = 1;
    const FractalSurface first(settings);
    double low = 0.0, high = 0.0;
    for (int point = 0; point < 100'000; ++point) {
        const double x = 1.7 * point, y = 2.3 * point;
        const double value = first.height(x, y) / settings.amplitude;
        const double finer = (all.height(x, y) - first.height(x, y)) / settings.amplitude;
        EXPECT_LE(finer, 1.5 * value + 1e-12);  // 0.6 / (1 - 0.6)
        if (value < 0.3) low = std::max(low, finer);
        if (value > 0.9) high = std::max(high, finer);
    }
    EXPECT_GT(high, 3.0 * low);
    // without heterogeneity an octave does not depend on previous ones: the sum of independent ridges
    settings.heterogeneity = 0.0;
    const FractalSurface one(settings);
    settings.octave_count = 2;
    const FractalSurface two(settings);
    settings.heterogeneity = 1.0;
    const FractalSurface product(settings);
    for (int point = 0; point < 1000; ++point) {
        const double x = 17.3 * point, y = 5.9 * point;
        const double value = one.height(x, y) / settings.amplitude;
        EXPECT_NEAR(product.height(x, y) - one.height(x, y),
                    value * (two.height(x, y) - one.height(x, y)), 1e-9);
    }
}

TEST(FractalSurface, WarpMovesPlacesByItsWay) {
    FractalSettings settings = rough(FractalKind::warped);
    settings.warp = 0.0;
    const FractalSurface still(settings);
    settings.kind = FractalKind::fbm;
    const FractalSurface fbm(settings);
    settings.kind = FractalKind::warped;
    settings.warp = 0.2;
    const FractalSurface warped(settings);
    double largest = 0.0;
    for (int point = 0; point < 1000; ++point) {
        const double x = 17.3 * point - 8000.0, y = 5.9 * point;
        EXPECT_EQ(still.height(x, y), fbm.height(x, y));
        largest = std::max(largest, std::abs(warped.height(x, y) - fbm.height(x, y)));
    }
    EXPECT_GT(largest, 0.1 * settings.amplitude);
}

}  // namespace terrane::fractal_surface_test
