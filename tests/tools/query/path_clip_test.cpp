// SPDX-License-Identifier: MIT
#include "query/query_ground.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace terrane::tools {
namespace path_clip_test {

TEST(CutPath, CoversTheSegmentInsideTheExtentWithShortPieces) {
    test::Random random(11);
    const WorldRect extent{-100.0, -50.0, 300.0, 80.0};
    const double reach = 3.0;
    for (int round = 0; round < 2000; ++round) {
        const WorldPos from(random.between(-500.0, 500.0), random.between(-500.0, 500.0), 0.0);
        const WorldPos to(random.below(4) == 0 ? from.x() : random.between(-500.0, 500.0),
                          random.below(4) == 0 ? from.y() : random.between(-500.0, 500.0), 0.0);
        const std::vector<WorldRect> pieces = cut_path(from, to, reach, 40.0, extent);
        for (const WorldRect& piece : pieces) {
            EXPECT_LE(piece.east - piece.west, 40.0 + 2.0 * reach + 1e-9);
            EXPECT_LE(piece.north - piece.south, 40.0 + 2.0 * reach + 1e-9);
        }
        for (int i = 0; i <= 50; ++i) {
            const WorldPos p = from + (to - from) * (i / 50.0);
            if (!extent.contains(p.x(), p.y())) continue;
            const bool covered =
                std::any_of(pieces.begin(), pieces.end(),
                            [&](const WorldRect& piece) { return piece.contains(p.x(), p.y()); });
            EXPECT_TRUE(covered) << "seed 11, round " << round;
        }
    }
}

TEST(CutPath, IsShortForASegmentFromFarAway) {
    const WorldRect extent{0.0, 0.0, 100.0, 100.0};
    const std::vector<WorldRect> pieces =
        cut_path(WorldPos(-1e9, 50.0, 0.0), WorldPos(1e9, 50.0, 0.0), 1.0, 10.0, extent);
    EXPECT_LE(pieces.size(), 12u);
    EXPECT_TRUE(
        cut_path(WorldPos(-1e9, 200.0, 0.0), WorldPos(1e9, 200.0, 0.0), 1.0, 10.0, extent).empty());
}

TEST(DistanceBeside, IsZeroInsideAndEuclideanOutside) {
    const WorldRect rect{0.0, 0.0, 10.0, 10.0};
    EXPECT_EQ(distance_beside(WorldPos(5.0, 5.0, 99.0), rect), 0.0);
    EXPECT_EQ(distance_beside(WorldPos(13.0, 14.0, 0.0), rect), 5.0);
    EXPECT_EQ(distance_beside(WorldPos(-2.0, 5.0, 0.0), rect), 2.0);
}

}  // namespace path_clip_test
}  // namespace terrane::tools
