// SPDX-License-Identifier: MIT
#include "lod/frame_mesh.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace morph_test {

constexpr std::uint64_t kSeed = 31;

// Share of a vertex of a priority in thresholds.
double share_of(double ratio, double priority) {
    const double full = ratio * ratio / (ratio * ratio - 1.0);
    return std::clamp(full * (1.0 - 1.0 / (priority * priority)), 0.0, 1.0);
}

// The average over all shares of the error of the mesh of vertices with a larger share: the priority of that share, but
// `excess` where the vertex of that priority should be in the mesh and is not.
double mean_error(double ratio, double excess, double shown) {
    constexpr int kSteps = 200'000;
    const double full = ratio * ratio / (ratio * ratio - 1.0);
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        const double share = (i + 0.5) / kSteps;
        const double priority = 1.0 / std::sqrt(1.0 - share / full);
        const bool is_late = share > share_of(ratio, shown) && share < share_of(ratio, excess);
        sum += is_late ? excess : priority;
    }
    return sum / kSteps;
}

TEST(Morph, BoundsHeldVerticesByTheAverageOfTheirMeshes) {
    test::Random random(kSeed);
    for (int i = 0; i < 40; ++i) {
        const double ratio = random.between(1.05, 3.0);
        const double shown = random.between(1.0, 1.2 * ratio);
        const double excess = shown * random.between(1.0, 2.0);
        EXPECT_NEAR(Morph(ratio, 1.0f).error_with_held(excess, shown),
                    mean_error(ratio, excess, shown), 1e-3)
            << "ratio " << ratio << ", shown " << shown << ", excess " << excess << ", seed "
            << kSeed;
    }
}

TEST(Morph, BoundsOtherVerticesByTheErrorFactor) {
    const Morph morph(kDefaultMorphRatio, 1.0f);
    EXPECT_NEAR(morph.error_factor(), mean_error(kDefaultMorphRatio, 1.0, 1.0), 1e-4);
    EXPECT_EQ(morph.error_with_held(1.1, 1.1), morph.error_factor());
    EXPECT_EQ(morph.error_with_held(0.5, 1.1), morph.error_factor());
}

// A vertex with a share of 0 is equivalent to a missing one; a larger share reduces the error.
TEST(Morph, IsBetweenInPlaceAndMissing) {
    const Morph morph(kDefaultMorphRatio, 1.0f);
    for (const double excess : {1.01, 1.1, kDefaultMorphRatio, 1.5, 3.0}) {
        EXPECT_NEAR(morph.error_with_held(excess, 1.0), morph.error_with_missing(excess), 1e-12)
            << excess;
        EXPECT_LE(morph.error_with_held(excess, 1.05), morph.error_with_missing(excess) + 1e-12)
            << excess;
        EXPECT_GE(morph.error_with_held(excess, 1.05), morph.error_factor()) << excess;
    }
}

}  // namespace morph_test
}  // namespace terrane::internal
