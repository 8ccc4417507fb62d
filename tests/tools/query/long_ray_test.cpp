// SPDX-License-Identifier: MIT
#include "query/answers.h"
#include "query/query_ground.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace terrane::tools {
namespace long_ray_test {

std::shared_ptr<const HeightSource> endless() {
    static const auto source = FractalHeights::create({.seed = 4, .root_size_log2 = 31}).value();
    return source;
}

/// Room for a path of chunks from a root and some around its end.
QueryGround make_ground(std::size_t chunks = 200) {
    return QueryGround::create(endless(), {.memory_bytes = chunks * Chunk::max_bytes()}).value();
}

/// The first fraction at which the true surface is above a segment, marched; 1 where there is none.
double marched(const WorldPos& from, const WorldPos& to, double step) {
    const double count = std::ceil((to - from).norm() / step);
    for (double i = 0.0; i <= count; i += 1.0) {
        const WorldPos p = from + (i / count) * (to - from);
        if (endless()->height(p.x(), p.y()) >= p.z()) return i / count;
    }
    return 1.0;
}

TEST(NearPieces, LeaveOutNothingThatIsNearTheSurface) {
    constexpr std::uint64_t kSeed = 41;
    test::Random random(kSeed);
    int pieces_found = 0, near_points = 0;
    for (int i = 0; i < 100; ++i) {
        const WorldPos from(random.between(-1e6, 1e6), random.between(-1e6, 1e6),
                            random.between(-2000.0, 3000.0));
        const WorldPos to = from + WorldPos(random.between(-1e5, 1e5), random.between(-1e5, 1e5),
                                            random.between(-4000.0, 4000.0));
        NearPieces search(from, to, *endless(), 500.0, 5.0);
        std::vector<RayPiece> pieces;
        while (const auto piece = search.next()) {
            EXPECT_LE((piece->end - piece->begin) * (to - from).head<2>().norm(), 500.0);
            if (!pieces.empty()) {
                EXPECT_GE(piece->begin, pieces.back().end);
            }
            pieces.push_back(*piece);
        }
        pieces_found += static_cast<int>(pieces.size());
        for (int k = 0; k <= 500; ++k) {
            const double t = k / 500.0;
            const WorldPos p = from + t * (to - from);
            if (std::abs(p.z() - endless()->height(p.x(), p.y())) > 5.0) continue;
            ++near_points;
            EXPECT_TRUE(std::ranges::any_of(
                pieces, [t](const RayPiece& piece) { return piece.begin <= t && piece.end >= t; }))
                << "seed " << kSeed << ", segment " << i << ", " << t;
        }
    }
    EXPECT_GT(near_points, 20);
    EXPECT_LT(pieces_found, 100 * 200) << "most is left out";
}

TEST(NearPieces, OfASegmentAboveTheGroundOrBesideTheWorldAreNone) {
    const auto first = [](const WorldPos& from, const WorldPos& to) {
        return NearPieces(from, to, *endless(), 100.0, 1.0).next();
    };
    EXPECT_FALSE(first({-2e9, 0, 5000}, {2e9, 0, 5000}));
    EXPECT_FALSE(first({2.2e9, 0, 0}, {2.2e9, 1e9, 0}));
    EXPECT_TRUE(first({-2e9, 0, 0}, {2e9, 0, 0}));
}

TEST(LongRay, MeetsTheGroundWhereTheMarchedOneDoes) {
    constexpr std::uint64_t kSeed = 42;
    test::Random random(kSeed);
    QueryGround ground = make_ground();
    for (int i = 0; i < 12; ++i) {
        // ends under the ground, where it comes down steeply enough to pass hills in a short march
        const WorldPos to(random.between(-1.9e9, 1.9e9), random.between(-1.9e9, 1.9e9), -3000.0);
        const WorldPos from =
            to + WorldPos(random.between(3e5, 1e6), 1e5, random.between(1e5, 1e6));
        const RayAnswer answer = long_ray(ground, from, to);
        ground.release();
        ASSERT_EQ(answer.status, GroundStatus::ok) << "seed " << kSeed << ", ray " << i;
        const WorldPos& hit = answer.point_world;
        EXPECT_LE(std::abs(hit.z() - endless()->height(hit.x(), hit.y())), answer.error_m + 1e-5);
        const double length = (to - from).norm();
        const double above = 6000.0 / (from.z() - to.z());  // of the way: below all hilltops
        const double begin = 1.0 - above;
        const double oracle = begin + (1.0 - begin) * marched(from + begin * (to - from), to, 1.0);
        // marching may step over a crest
        EXPECT_LE(answer.fraction * length, oracle * length + 2.0 + answer.error_m) << i;
        EXPECT_NEAR(answer.fraction * length, oracle * length, 200.0) << i;
    }
}

TEST(LongRay, LoadsNothingAboveTheGround) {
    QueryGround ground = make_ground(60);
    const auto ask = [&](const std::string& from, const std::string& to) {
        const auto line = R"({"op":"ray","from":)" + from + R"(,"to":)" + to + "}";
        return answer_query(parse_query(line), ground)["status"];
    };
    EXPECT_EQ(ask("[-2e9,-2e9,1e5]", "[2e9,2e9,1e5]"), "miss");
    EXPECT_EQ(ask("[-2e9,-2e9,1700]", "[2e9,2e9,1650]"), "miss");
    EXPECT_EQ(ask("[0,0,1e6]", "[1e8,1e8,-3000]"), "ok");
}

}  // namespace long_ray_test
}  // namespace terrane::tools
