// SPDX-License-Identifier: MIT
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace terrane::ground_test {

using namespace test;

struct World {
    std::shared_ptr<const HeightSource> source;
    std::shared_ptr<const ResidentSet> set;
    int level = 0;
    Ground ground() const { return Ground(set, level); }
};

World rough_world(std::int32_t first_root = -1) {
    World world;
    const auto source = FractalHeights::create({.seed = 8,
                                                .octave_count = 9,
                                                .amplitude = 60.0,
                                                .wavelength_log2 = 8,
                                                .root_size_log2 = 9,
                                                .first_root_x = first_root,
                                                .first_root_y = first_root});
    if (!source) return world;
    world.source = *source;
    Pager pager = Pager::create(world.source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require(world.source->extent(), 0.0);
    pager.update({}, {}, 0.0);
    world.set = pager.resident();
    world.level = pager.contact_level();
    return world;
}

struct Triangle {
    Eigen::Vector3d a, b, c;
};

std::vector<Triangle> triangles_of(const Ground& ground, const CellRange& cells) {
    std::vector<Triangle> triangles;
    for (std::int64_t row = cells.south; row <= cells.north; ++row) {
        for (std::int64_t column = cells.west; column <= cells.east; ++column) {
            const GroundCell cell = ground.cell(column, row);
            if (cell.status != QueryStatus::ok) continue;
            const auto corner = [&](int i, int j, std::int32_t height) {
                return Eigen::Vector3d(ground.cell_x(column + i), ground.cell_y(row + j),
                                       ground.lattice().quantum * height);
            };
            const Eigen::Vector3d sw = corner(0, 0, cell.south_west),
                                  se = corner(1, 0, cell.south_east);
            const Eigen::Vector3d nw = corner(0, 1, cell.north_west),
                                  ne = corner(1, 1, cell.north_east);
            if (cell.cut_to_north_east) {
                triangles.push_back({sw, se, ne});
                triangles.push_back({sw, ne, nw});
            } else {
                triangles.push_back({sw, se, nw});
                triangles.push_back({se, ne, nw});
            }
        }
    }
    return triangles;
}

// Reference: solves for the plane and tests the sides. Empty if the point is not over the triangle.
std::optional<double> height_over(const Triangle& t, double x, double y) {
    const double det =
        (t.b.x() - t.a.x()) * (t.c.y() - t.a.y()) - (t.c.x() - t.a.x()) * (t.b.y() - t.a.y());
    const double u =
        ((x - t.a.x()) * (t.c.y() - t.a.y()) - (t.c.x() - t.a.x()) * (y - t.a.y())) / det;
    const double v =
        ((t.b.x() - t.a.x()) * (y - t.a.y()) - (x - t.a.x()) * (t.b.y() - t.a.y())) / det;
    if (u < -1e-12 || v < -1e-12 || u + v > 1.0 + 1e-12) return std::nullopt;
    return t.a.z() + u * (t.b.z() - t.a.z()) + v * (t.c.z() - t.a.z());
}

TEST(Ground, AnswersHeightsOfItsTriangles) {
    const World world = rough_world();
    ASSERT_NE(world.set, nullptr);
    const Ground ground = world.ground();
    Random random(1);
    for (int i = 0; i < 2000; ++i) {
        const double x = random.between(-511.0, 511.0);
        const double y = random.between(-511.0, 511.0);
        const std::int64_t column = ground.column_at(x), row = ground.row_at(y);
        std::optional<double> expected;
        for (const Triangle& t : triangles_of(ground, {column, row, column, row})) {
            if (const auto height = height_over(t, x, y)) expected = height;
        }
        ASSERT_TRUE(expected.has_value());
        const HeightAnswer answer = ground.height(x, y);
        ASSERT_EQ(answer.status, QueryStatus::ok);
        EXPECT_NEAR(answer.height, *expected, 1e-10);
        EXPECT_NEAR(answer.normal.norm(), 1.0, 1e-12);
        // the normal matches a difference quotient of the surface
        const double step = 1e-7;
        const HeightAnswer beside = ground.height(x + step, y);
        if (beside.normal == answer.normal) {
            EXPECT_NEAR(
                answer.normal.x() + answer.normal.z() * (beside.height - answer.height) / step, 0.0,
                1e-6);
        }
    }
}

TEST(Ground, StaysWithinItsErrorOfTheTrueSurface) {
    const World world = rough_world();
    ASSERT_NE(world.set, nullptr);
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
    ASSERT_NE(world.set, nullptr);
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
        const std::int64_t west = column & ~std::int64_t{7}, south = row & ~std::int64_t{7};
        const RangeAnswer block = reader.block(column, row);
        const RangeAnswer range = ground.range({west, south, west + 7, south + 7});
        ASSERT_EQ(block.status, range.status);
        if (block.status == QueryStatus::outside) continue;
        ASSERT_EQ(block.low, range.low);
        ASSERT_EQ(block.high, range.high);
    }
    for (const QueryStatus status :
         {QueryStatus::ok, QueryStatus::outside, QueryStatus::not_resident}) {
        EXPECT_GT(counts[static_cast<std::size_t>(status)], 1000);
    }
}

TEST(Ground, AnswersTheSameWhileACameraFliesAndWhateverIsDrawn) {
    const World world = rough_world();
    ASSERT_NE(world.set, nullptr);
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
    ASSERT_NE(world.set, nullptr);
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

// Reference: the first intersection with any triangle of the area.
std::optional<double> slow_ray(const std::vector<Triangle>& triangles, const WorldPos& from,
                               const WorldPos& to) {
    std::optional<double> best;
    const Eigen::Vector3d displacement = to - from;
    for (const Triangle& t : triangles) {
        const Eigen::Vector3d e1 = t.b - t.a, e2 = t.c - t.a, s = from - t.a;
        const Eigen::Vector3d p(displacement.y() * e2.z() - displacement.z() * e2.y(),
                                displacement.z() * e2.x() - displacement.x() * e2.z(),
                                displacement.x() * e2.y() - displacement.y() * e2.x());
        const double det = e1.dot(p);
        if (std::abs(det) < 1e-14) continue;
        const double u = s.dot(p) / det;
        const Eigen::Vector3d q(s.y() * e1.z() - s.z() * e1.y(), s.z() * e1.x() - s.x() * e1.z(),
                                s.x() * e1.y() - s.y() * e1.x());
        const double v = displacement.dot(q) / det;
        const double fraction = e2.dot(q) / det;
        if (u < -1e-10 || v < -1e-10 || u + v > 1.0 + 1e-10 || fraction < 0.0 || fraction > 1.0)
            continue;
        if (!best || fraction < *best) best = fraction;
    }
    return best;
}

TEST(Ground, HitsRaysWhereBruteForceDoes) {
    const World world = rough_world();
    ASSERT_NE(world.set, nullptr);
    const Ground ground = world.ground();
    const std::vector<Triangle> triangles = triangles_of(ground, {-60, -60, 59, 59});
    Random random(3);
    int hits = 0;
    for (int i = 0; i < 1500; ++i) {
        SCOPED_TRACE(testing::Message() << "seed 3, ray " << i);
        const auto place = [&] {
            // one in three on lattice lines or through vertices
            const double x = random.between(-59.0, 59.0), y = random.between(-59.0, 59.0);
            const bool on_x = i % 3 == 0, on_y = i % 6 == 0;
            return WorldPos(on_x ? std::floor(x) : x, on_y ? std::floor(y) : y, 0.0);
        };
        WorldPos from = place(), to = place();
        if (i % 9 == 0) to.x() = from.x();  // along a lattice line
        from.z() = ground.height(from.x(), from.y()).height + random.between(-10.0, 30.0);
        to.z() = ground.height(to.x(), to.y()).height + random.between(-30.0, 10.0);
        const RayAnswer answer = ground.ray(from, to);
        const std::optional<double> expected = slow_ray(triangles, from, to);
        ASSERT_EQ(answer.status == QueryStatus::ok, expected.has_value());
        if (!expected) continue;
        ++hits;
        EXPECT_NEAR(answer.fraction, *expected, 1e-9);
        EXPECT_NEAR(answer.point_world.z(),
                    ground.height(answer.point_world.x(), answer.point_world.y()).height, 1e-8);
    }
    EXPECT_GT(hits, 500);
}

TEST(Ground, HitsVerticalRaysOverEveryVertexOfAPatch) {
    const World world = rough_world();
    ASSERT_NE(world.set, nullptr);
    const Ground ground = world.ground();
    for (int y = -20; y <= 20; ++y) {
        for (int x = -20; x <= 20; ++x) {
            const RayAnswer answer =
                ground.ray({1.0 * x, 1.0 * y, 500.0}, {1.0 * x, 1.0 * y, -500.0});
            ASSERT_EQ(answer.status, QueryStatus::ok);
            EXPECT_NEAR(answer.point_world.z(), ground.height(x, y).height, 1e-9);
        }
    }
}

TEST(Ground, AnswersTheSameFarFromTheOrigin) {
    // two worlds with the same periodic ground, the second shifted by a multiple of its wavelength
    const Lattice near_lattice = test::small_world(3, 1.0);
    Lattice far_lattice = near_lattice;
    far_lattice.origin_x = 1e7;
    far_lattice.origin_y = -1e7;
    const auto answer_at = [](const Lattice& lattice, double x, double y) {
        const auto source = std::make_shared<test::WaveHeights>(lattice, 20.0, 250.0);
        Pager pager = Pager::create(source, {.worker_count = 0}).value();
        const RequiredRegion region = pager.require(
            {lattice.origin_x, lattice.origin_y, lattice.origin_x + 60, lattice.origin_y + 60},
            0.0);
        pager.update({}, {}, 0.0);
        return pager.ground().height(lattice.origin_x + x, lattice.origin_y + y);
    };
    const HeightAnswer a = answer_at(near_lattice, 13.25, 40.5);
    const HeightAnswer b = answer_at(far_lattice, 13.25, 40.5);
    ASSERT_EQ(a.status, QueryStatus::ok);
    ASSERT_EQ(b.status, QueryStatus::ok);
    EXPECT_EQ(a.height, b.height);
}

}  // namespace terrane::ground_test
