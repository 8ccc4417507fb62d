// SPDX-License-Identifier: MIT
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace terrane::ground_test {

using namespace test;

struct World {
    std::shared_ptr<const HeightSource> source;
    std::shared_ptr<const ResidentSet> set;
    int level = 0;
    Ground ground() const { return Ground(set, level); }
};

World rough_world() {
    World world;
    world.source = FractalHeights::create({.seed = 8,
                                           .octave_count = 9,
                                           .amplitude = 60.0,
                                           .wavelength_log2 = 8,
                                           .root_size_log2 = 9})
                       .value();
    Pager pager = Pager::create(world.source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require(world.source->extent(), 0.0);
    pager.update({}, {}, 0.0);
    world.set = pager.resident();
    world.level = pager.contact_level();
    return world;
}

TEST(Ground, StaysWithinItsErrorOfTheTrueSurface) {
    const World world = rough_world();
    Random random(2);
    for (int level = 0; level <= world.level; ++level) {
        const Ground ground(world.set, level);
        for (int i = 0; i < 2000; ++i) {
            const double x = random.between(-512.0, 512.0);
            const double y = random.between(-512.0, 512.0);
            const HeightAnswer answer = ground.height(x, y);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            EXPECT_LE(std::abs(answer.height - world.source->height(x, y)), answer.error_m);
        }
    }
}

// The ground is closed: every edge and corner belongs to it, the extent's edge included.
TEST(Ground, AnswersOnGridLinesAndOnTheEdgeOfTheExtent) {
    const World world = rough_world();
    const Ground ground = world.ground();
    const WorldRect& extent = ground.extent();
    for (const double x : {extent.west, -128.0, 0.0, 17.0, extent.east}) {
        for (const double y : {extent.south, -128.0, 0.0, 17.0, extent.north}) {
            EXPECT_EQ(ground.height(x, y).status, QueryStatus::ok) << x << ", " << y;
            EXPECT_EQ(ground.ray({x, y, 1000.0}, {x, y, -1000.0}).status, QueryStatus::ok)
                << x << ", " << y;
        }
    }
    EXPECT_EQ(ground.height(std::nextafter(extent.east, 1e9), 0.0).status, QueryStatus::outside);
    EXPECT_EQ(ground.height(0.0, 1e300).status, QueryStatus::outside);
    EXPECT_EQ(ground.height(0.0, std::numeric_limits<double>::quiet_NaN()).status,
              QueryStatus::invalid);
}

TEST(Ground, AnswersNotResidentOverAbsentChunks) {
    const auto source = std::make_shared<test::WaveHeights>(test::small_world(3, 1.0), 20.0, 200.0);
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({10, 10, 20, 20}, 0.0);
    pager.update({}, {}, 0.0);
    const Ground ground = pager.ground();
    EXPECT_EQ(ground.height(15, 15).status, QueryStatus::ok);
    EXPECT_EQ(ground.height(-600, 15).status, QueryStatus::not_resident);
    EXPECT_EQ(ground.cell(-600, 15).status, QueryStatus::not_resident);
    EXPECT_EQ(ground.range({-600, 15, 15, 16}).status, QueryStatus::not_resident);
    EXPECT_EQ(ground.ray({15, 15, 100}, {15, 15, -100}).status, QueryStatus::ok);
    EXPECT_EQ(ground.ray({-600, 15, 10}, {-500, 15, -100}).status, QueryStatus::not_resident);
    EXPECT_EQ(ground.height(5000, 15).status, QueryStatus::outside);
    EXPECT_EQ(ground.ray({5000, 15, 10}, {6000, 15, -100}).status, QueryStatus::miss);
}

// Answers across chunks, in absent ones and beyond the extent equal single calls.
TEST(GroundReader, GivesTheAnswersOfTheGround) {
    const auto source = std::make_shared<test::WaveHeights>(test::small_world(3, 1.0), 20.0, 200.0);
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({-200, -100, 300, 200}, 0.0);
    pager.update({}, {}, 0.0);
    const Ground ground = pager.ground();
    GroundReader reader(ground);
    SeededRandom random(12);
    std::array<int, 6> counts{};
    for (int i = 0; i < 20000; ++i) {
        SCOPED_TRACE(testing::Message() << "question " << i);
        const int reach = i % 3 == 0 ? 1400 : 300;
        const std::int64_t column = random.below(2 * reach) - reach;
        const std::int64_t row = random.below(2 * reach) - reach;
        const GroundCell cell = reader.cell(column, row);
        const GroundCell alone = ground.cell(column, row);
        ++counts[static_cast<std::size_t>(cell.status)];
        ASSERT_EQ(cell.status, alone.status);
        ASSERT_EQ(cell.south_west, alone.south_west);
        ASSERT_EQ(cell.north_east, alone.north_east);
        ASSERT_EQ(cell.error_m, alone.error_m);
    }
    for (const QueryStatus status :
         {QueryStatus::ok, QueryStatus::outside, QueryStatus::not_resident}) {
        EXPECT_GT(counts[static_cast<std::size_t>(status)], 1000);
    }
}

TEST(Ground, AnswersTheSameWhileACameraFliesAndWhateverIsDrawn) {
    const World world = rough_world();
    const Ground alone = world.ground();
    for (const int workers : {0, 2}) {
        Pager pager = Pager::create(world.source, {.worker_count = workers}).value();
        RequiredRegion required = pager.require({-60, -60, 60, 60}, 0.0);
        Random random(6);
        for (int frame = 0; frame < 40; ++frame) {
            SCOPED_TRACE(testing::Message() << workers << " workers, seed 6, frame " << frame);
            const WorldPos eye(random.between(-500, 500), random.between(-500, 500), 90.0);
            const CameraNeed camera{.view = look_at(eye, {0, 0, 0}, 1.0, 640, 360).value()};
            pager.update({&camera, 1}, {}, 0.02 * frame);
            if (frame == 0) pager.finish();
            ASSERT_TRUE(required.is_ready());
            const Ground ground = pager.ground();
            for (int i = 0; i < 20; ++i) {
                const double x = random.between(-60, 60), y = random.between(-60, 60);
                ASSERT_EQ(ground.height(x, y).height, alone.height(x, y).height);
                const WorldPos from(x, y, 200.0), to(y, -x, -200.0);
                ASSERT_EQ(ground.ray(from, to).fraction, alone.ray(from, to).fraction);
            }
        }
    }
}

// Coarser resident chunks bound the heights of absent ones, so that a body high above them need not wait.
TEST(Ground, BoundsAbsentChunksByTheirAncestors) {
    const World world = rough_world();
    std::vector<std::shared_ptr<const Chunk>> coarse;
    for (const auto& chunk : world.set->chunks()) {
        if (chunk->key.level < world.level) coarse.push_back(chunk);
    }
    const Ground absent(std::make_shared<const ResidentSet>(world.source->lattice(),
                                                            world.source->extent(), coarse, 1),
                        world.level);
    const Ground ground = world.ground();
    Random random(4);
    for (int i = 0; i < 300; ++i) {
        const std::int64_t west = random.below(900) - 450, south = random.below(900) - 450;
        const CellRange cells{west, south, west + random.below(60), south + random.below(60)};
        const RangeAnswer exact = ground.range(cells);
        const RangeAnswer bounds = absent.range(cells);
        ASSERT_EQ(exact.status, QueryStatus::ok);
        ASSERT_EQ(bounds.status, QueryStatus::not_resident);
        EXPECT_LE(bounds.low, exact.low);
        EXPECT_GE(bounds.high, exact.high);
        EXPECT_LT(bounds.high, std::numeric_limits<std::int32_t>::max());
    }
}

}  // namespace terrane::ground_test
