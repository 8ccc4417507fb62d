// SPDX-License-Identifier: MIT
#include "source/fractal/fractal_surface.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace terrane {
namespace fractal_surface_test {

using internal::SimdLevel;

constexpr std::uint64_t kSeed = 41;
constexpr FractalKind kKinds[] = {FractalKind::fbm, FractalKind::ridged, FractalKind::hybrid,
                                  FractalKind::warped};

FractalSettings rough(FractalKind kind, std::uint64_t seed = 5) {
    return {.seed = seed, .kind = kind, .octave_count = 12, .wavelength_log2 = 9, .gain = 0.6};
}

/// Of whole metres.
std::uint64_t units(double metres) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(metres)) << 24;
}

TEST(FractalSurface, EveryLevelAndEverySinglePointHaveTheSameBits) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
    for (const FractalKind kind : kKinds) {
        const FractalSurface surface(rough(kind, random.bits()));
        for (const double far : {0.0, 1e4, -1e9, 0x1p39 - 8.0}) {
            for (const int step_log2 : {-16, -3, -1, 0, 1, 4, 9, 12}) {
                if (far > 1e11 && step_log2 < -10) continue;  // no double says such places
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
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
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
    // at the lowest places of the first octave the finer ones are flat, at the highest they are not
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
    // without it they do not hang on it: the sum of the octaves' own ridges
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

}  // namespace fractal_surface_test
}  // namespace terrane
