// SPDX-License-Identifier: MIT
#include "lab/paging_run.h"
#include "support/heights/wave_heights.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace terrane::tools {
namespace ground_bodies_test {

const test::WaveHeights& hills() {
    static const test::WaveHeights source(test::small_world(3, 8.0), 300.0, 2000.0);
    return source;
}

CameraPose pose_at(double x, double y, double z) {
    CameraPose pose;
    pose.eye_world = {x, y, z};
    pose.velocity = {80.0, -60.0, 5.0};
    return pose;
}

TEST(GroundBodies, RestOnTheGroundUnderAndAroundTheEye) {
    const GroundBodies bodies(hills(), 9);
    const CameraPose pose = pose_at(500.0, -300.0, 900.0);
    std::vector<WorldPos> places;
    for (std::size_t i = 0; i < 9; ++i) {
        const WorldPos p = bodies.place(i, pose);
        EXPECT_EQ(p.z(), hills().height(p.x(), p.y()) + GroundBodies::kRadius);
        EXPECT_LE((p - pose.eye_world).head<2>().cwiseAbs().maxCoeff(), 150.0);
        for (const WorldPos& other : places) EXPECT_GT((p - other).norm(), 20.0);
        places.push_back(p);
    }
    EXPECT_EQ(places[0].head<2>(), pose.eye_world.head<2>());
    EXPECT_TRUE(GroundBodies(hills(), 0).needs(pose).empty());
}

TEST(GroundBodies, MoveWithTheCameraAndTheGround) {
    const GroundBodies bodies(hills(), 5);
    const CameraPose pose = pose_at(500.0, -300.0, 900.0);
    CameraPose later = pose;
    constexpr double kStep = 1e-3;
    later.eye_world += kStep * pose.velocity;
    const std::vector<BodyNeed> needs = bodies.needs(pose);
    for (std::size_t i = 0; i < 5; ++i) {
        const Eigen::Vector3d rate = (bodies.place(i, later) - bodies.place(i, pose)) / kStep;
        EXPECT_EQ(needs[i].centre_world, bodies.place(i, pose));
        EXPECT_LT((needs[i].velocity - rate).norm(), 1.0) << i;
        EXPECT_NEAR(needs[i].velocity.x(), 80.0, 1e-6);
        EXPECT_EQ(needs[i].radius, GroundBodies::kRadius);
    }
}

// Reference: tests every chunk of the level.
bool has_ground_slowly(const ResidentSet& set, int level, const WorldPos& p, double radius) {
    const Lattice& lattice = set.lattice();
    const WorldRect& extent = set.extent();
    const double side = lattice.level_spacing(level) * kChunkCells;
    const std::int32_t count = lattice.root_count_x << level;
    for (std::int32_t j = 0; j < count; ++j) {
        for (std::int32_t i = 0; i < count; ++i) {
            const std::int32_t x = (lattice.first_root_x << level) + i;
            const std::int32_t y = (lattice.first_root_y << level) + j;
            const double west = std::max(lattice.origin_x + x * side, extent.west);
            const double south = std::max(lattice.origin_y + y * side, extent.south);
            const double east = std::min(lattice.origin_x + (x + 1) * side, extent.east);
            const double north = std::min(lattice.origin_y + (y + 1) * side, extent.north);
            const bool touches = p.x() + radius >= west && p.x() - radius < east &&
                                 p.y() + radius >= south && p.y() - radius < north;
            const ChunkKey key{x, y, static_cast<std::uint8_t>(level)};
            if (touches && set.find(key) == ResidentSet::kNone) return false;
        }
    }
    return true;
}

TEST(HasGround, AgreesWithATestOfEveryChunk) {
    constexpr std::uint64_t kSeed = 20240607;
    test::Random random(kSeed);
    const Lattice lattice = test::small_world(2, 8.0);
    const test::WaveHeights source(lattice, 50.0, 900.0);
    int with = 0, without = 0;
    for (int round = 0; round < 4; ++round) {
        std::vector<std::shared_ptr<const Chunk>> chunks;
        std::vector<ChunkKey> open{{-1, -1, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 0, 0}};
        while (!open.empty()) {
            const ChunkKey key = open.back();
            open.pop_back();
            chunks.push_back(*make_chunk(source, key));
            if (key.level == lattice.finest_level) continue;
            for (int quadrant = 0; quadrant < 4; ++quadrant) {
                if (random.between(0.0, 1.0) < 0.8) open.push_back(key.child(quadrant));
            }
        }
        const ResidentSet set(lattice, source.extent(), std::move(chunks), 1);
        for (int i = 0; i < 500; ++i) {
            const double reach = 1.2 * source.extent().east;
            const WorldPos p(random.between(-reach, reach), random.between(-reach, reach), 0.0);
            const double radius = random.between(0.0, 600.0);
            const bool found = has_ground(set, lattice.finest_level, p, radius);
            EXPECT_EQ(found, has_ground_slowly(set, lattice.finest_level, p, radius))
                << "seed " << kSeed << ": " << p.transpose() << ", " << radius;
            ++(found ? with : without);
        }
    }
    EXPECT_GT(with, 300);
    EXPECT_GT(without, 300);
}

TEST(HasGround, BeyondTheTerrainNothingIsMissing) {
    const Lattice lattice = test::small_world(1, 8.0);
    const test::WaveHeights source(lattice, 50.0, 900.0);
    const ResidentSet none(lattice, source.extent(), {}, 1);
    const double east = source.extent().east;
    EXPECT_FALSE(has_ground(none, 1, {east - 0.5, 0.0, 0.0}, 1.0));
    EXPECT_FALSE(has_ground(none, 1, {east + 0.5, 0.0, 0.0}, 1.0));
    EXPECT_TRUE(has_ground(none, 1, {east + 1.5, 0.0, 0.0}, 1.0));
}

}  // namespace ground_bodies_test
}  // namespace terrane::tools
