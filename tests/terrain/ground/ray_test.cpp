// SPDX-License-Identifier: MIT
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

namespace terrane::ray_test {

using namespace test;

// Steep, rough ground with the same bits on every machine.
double rough(double x, double y) {
    const auto hash = [](double p, double q) {
        Random random(static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(p * 64.0))) *
                          0x9e3779b97f4a7c15u ^
                      static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(q * 64.0))));
        return random.between(-1.0, 1.0);
    };
    return 0.01 * (x - 100.0) * (y - 90.0) / 8.0 + hash(x, y) +
           8.0 * hash(std::floor(x / 16.0), std::floor(y / 16.0));
}

bool has_hole(double x, double y) {
    Random random(static_cast<std::uint64_t>(std::floor(x) * 977.0 + std::floor(y)));
    return random.below(4) == 0;
}

// Reference: intersects the ray with every triangle of the cells under its bounding box.
std::optional<double> slow_ray(const Ground& ground, const WorldPos& from, const WorldPos& to) {
    const auto clamped = [](std::int64_t index) {
        return std::clamp<std::int64_t>(index, -1, 3 * kChunkCells);
    };
    const CellRange cells{clamped(ground.column_at(std::min(from.x(), to.x())) - 1),
                          clamped(ground.row_at(std::min(from.y(), to.y())) - 1),
                          clamped(ground.column_at(std::max(from.x(), to.x())) + 1),
                          clamped(ground.row_at(std::max(from.y(), to.y())) + 1)};
    return first_hit(triangles_of(ground, cells), from, to);
}

using Heights = std::function<double(double, double)>;

// Across and along lattice lines, through vertices; from above and from below; short and long.
std::array<WorldPos, 2> random_ray(Random& random, int i, double side,
                                   const Heights& height = rough) {
    const double reach = i % 4 == 0 ? 60.0 : 12.0;
    std::array<WorldPos, 2> ends;
    for (std::size_t end = 0; end < 2; ++end) {
        WorldPos& p = ends[end];
        for (int axis = 0; axis < 2; ++axis) {
            p[axis] = end == 0 ? random.between(1.0, side - 1.0)
                               : std::clamp(ends[0][axis] + random.between(-reach, reach), 1.0,
                                            side - 1.0);
        }
        if (i % 3 == 0) p.x() = std::floor(p.x());
        if (i % 6 == 0) p.y() = std::floor(p.y());
    }
    if (i % 9 == 0) ends[1].x() = ends[0].x();
    if (i % 90 == 0) ends[1].y() = ends[0].y();
    ends[0].z() = height(ends[0].x(), ends[0].y()) + random.between(-12.0, 14.0);
    ends[1].z() = height(ends[1].x(), ends[1].y()) + random.between(-14.0, 12.0);
    return ends;
}

void expect_slow_answers(const Ground& ground, std::uint64_t seed, const Heights& height = rough) {
    constexpr int kRays = 10'000;
    Random random(seed);
    int hits = 0, misses = 0;
    for (int i = 0; i < kRays; ++i) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", ray " << i);
        const auto [from, to] = random_ray(random, i, 256.0, height);
        const std::optional<double> expected = slow_ray(ground, from, to);
        const RayAnswer answer = ground.ray(from, to);
        ASSERT_EQ(answer.status, expected ? QueryStatus::ok : QueryStatus::miss);
        ++(expected ? hits : misses);
        if (!expected) continue;
        ASSERT_NEAR(answer.fraction, *expected, 1e-8);
        const WorldPos& hit = answer.point_world;
        ASSERT_NEAR(hit.z(), ground.height(hit.x(), hit.y()).height, 1e-6);
    }
    EXPECT_GT(hits, kRays / 5);
    EXPECT_GT(misses, kRays / 10);
}

TEST(GroundRay, HitsRoughGroundWhereBruteForceDoes) {
    expect_slow_answers(make_test_ground(rough, {.roots = 2}), 1);
}

TEST(GroundRay, HitsGroundWithHolesWhereBruteForceDoes) {
    expect_slow_answers(make_test_ground(rough, {.roots = 2, .is_outside = has_hole}), 2);
}

TEST(GroundRay, HitsTheFinestLevelOfAFractalWhereBruteForceDoes) {
    const auto source = FractalHeights::create({.seed = 8,
                                                .octave_count = 9,
                                                .amplitude = 60.0,
                                                .wavelength_log2 = 8,
                                                .root_size_log2 = 9})
                            .value();
    const Ground ground(std::make_shared<const ResidentSet>(source->lattice(), source->extent(),
                                                            all_chunks(*source), 1),
                        source->lattice().finest_level);
    expect_slow_answers(ground, 7, [&](double x, double y) { return source->height(x, y); });
}

// An absent chunk before the first hit gives not_resident.
TEST(GroundRay, EndsAtChunksThatAreNotResident) {
    const Ground ground = make_test_ground(
        rough, {.roots = 3, .is_resident = [](int x, int y) { return (x + y) % 2 == 0; }});
    SeededRandom random(3);
    std::array<int, 6> counts{};
    for (int i = 0; i < 10000; ++i) {
        SCOPED_TRACE(testing::Message() << "ray " << i);
        const auto [from, to] = random_ray(random, i, 384.0);
        const Eigen::Vector3d displacement = to - from;
        double absent = std::numeric_limits<double>::infinity();
        for (const auto& [x, y] : {std::array{0, 1}, {1, 0}, {2, 1}, {1, 2}}) {
            double enter = 0.0, leave = 1.0;
            const std::array<double, 2> low{128.0 * x, 128.0 * y};
            for (int axis = 0; axis < 2; ++axis) {
                const double west = low[static_cast<std::size_t>(axis)];
                if (displacement[axis] == 0.0) {
                    if (from[axis] < west || from[axis] >= west + 128.0) leave = -1.0;
                    continue;
                }
                const double a = (west - from[axis]) / displacement[axis];
                const double b = (west + 128.0 - from[axis]) / displacement[axis];
                enter = std::max(enter, std::min(a, b));
                leave = std::min(leave, std::max(a, b));
            }
            if (enter <= leave) absent = std::min(absent, enter);
        }
        const std::optional<double> hit = slow_ray(ground, from, to);
        const double first = hit.value_or(2.0);
        // a ray may or may not hit the edge of an absent chunk
        if (std::abs(first - absent) < 1e-9 || std::abs(absent - 1.0) < 1e-9 || absent == 0.0)
            continue;
        const QueryStatus expected = absent < first && absent <= 1.0 ? QueryStatus::not_resident
                                     : hit                           ? QueryStatus::ok
                                                                     : QueryStatus::miss;
        const RayAnswer answer = ground.ray(from, to);
        ++counts[static_cast<std::size_t>(answer.status)];
        ASSERT_EQ(answer.status, expected) << first << ", " << absent;
        if (answer.status != QueryStatus::ok) continue;
        ASSERT_NEAR(answer.fraction, first, 1e-8);
    }
    for (const QueryStatus status :
         {QueryStatus::ok, QueryStatus::miss, QueryStatus::not_resident}) {
        EXPECT_GT(counts[static_cast<std::size_t>(status)], 100);
    }
}

TEST(GroundRay, HitsASurfaceThatItLiesIn) {
    const Ground flat = make_test_ground([](double, double) { return 5.0; }, {.roots = 2});
    const Ground slope =
        make_test_ground([](double x, double y) { return 0.5 * x - 0.25 * y; }, {.roots = 2});
    Random random(4);
    for (int i = 0; i < 2000; ++i) {
        WorldPos from(random.between(0.0, 256.0), random.between(0.0, 256.0), 5.0);
        WorldPos to(random.between(0.0, 256.0), random.between(0.0, 256.0), 5.0);
        if (i % 3 == 0) from.x() = to.x() = 64.0 * random.below(5);
        EXPECT_EQ(flat.ray(from, to).status, QueryStatus::ok);
        EXPECT_EQ(flat.ray(from, to).fraction, 0.0);
        // it misses one quantum above or below
        for (const double off : {0x1p-12, -0x1p-12}) {
            from.z() = to.z() = 5.0 + off;
            EXPECT_EQ(flat.ray(from, to).status, QueryStatus::miss);
        }
        // exactly representable points on the slope
        const auto place = [&] {
            const double x = random.below(2049) / 8.0, y = random.below(2049) / 8.0;
            return WorldPos(x, y, 0.5 * x - 0.25 * y);
        };
        from = place();
        to = place();
        EXPECT_EQ(slope.ray(from, to).status, QueryStatus::ok);
        EXPECT_EQ(slope.ray(from, to).fraction, 0.0);
        // from above downwards, and from below upwards
        for (const double off : {16.0, -16.0}) {
            const WorldPos apart = from + WorldPos(0.0, 0.0, off);
            const WorldPos beyond = to - WorldPos(0.0, 0.0, off);
            const RayAnswer answer = slope.ray(apart, beyond);
            EXPECT_EQ(answer.status, QueryStatus::ok);
            EXPECT_NEAR(answer.fraction, 0.5, 1e-12);
        }
    }
}

// A crossing on the line between two squares must not be missed by both.
TEST(GroundRay, HitsTheSurfaceOnTheLinesBetweenSquares) {
    SeededRandom random(10);
    for (const double slope : {0.0, -1.0 / 3.0, 0.7, -2.1}) {
        // constant along y, so that every section along y is level
        const Ground ground =
            make_test_ground([=](double x, double) { return slope * x; }, {.roots = 2});
        for (int i = 0; i < 20000; ++i) {
            SCOPED_TRACE(testing::Message() << "slope " << slope << ", ray " << i);
            const double x = 8.0 * (1 + random.below(31)), y = random.between(20.0, 236.0);
            const WorldPos on(x, y, ground.height(x, y).height);
            const double ahead = random.between(-8.0, 8.0);
            const Eigen::Vector3d displacement(
                ahead, random.between(-8.0, 8.0),
                slope * ahead + (i % 2 == 0 ? 1.0 : -1.0) * random.between(0.5, 9.0));
            const RayAnswer answer = ground.ray(on - displacement, on + displacement);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            // heights are rounded to quanta, so the slope is not exactly constant
            ASSERT_NEAR(answer.fraction, 0.5, 1e-2);
        }
    }
}

// As in the height field tests of Jolt Physics: a regular grid with an offset and a scale.
TEST(GroundRay, HitsEveryStoredPointFromAboveAndNoHole) {
    const auto is_hole = [](double x, double y) {
        return static_cast<int>((x - 0.3) / 1.1) == 7 && static_cast<int>((y - 0.5) / 1.1) == 9;
    };
    const Ground ground =
        make_test_ground([](double x, double y) { return 0.7 + 1.2 * rough(x, y); },
                         {.spacing = 1.1, .origin_x = 0.3, .origin_y = 0.5, .is_outside = is_hole});
    for (int row = 0; row < 33; ++row) {
        for (int column = 0; column < 33; ++column) {
            const double x = 0.3 + 1.1 * column, y = 0.5 + 1.1 * row;
            const RayAnswer answer = ground.ray({x, y, 200.0}, {x, y, -200.0});
            ASSERT_EQ(answer.status, QueryStatus::ok);
            EXPECT_NEAR(answer.point_world.z(), 0.7 + 1.2 * rough(x, y), 1e-3);
        }
    }
    for (int i = 1; i < 10; ++i) {
        const double x = 0.3 + 1.1 * (7.0 + 0.1 * i), y = 0.5 + 1.1 * 9.5;
        EXPECT_EQ(ground.ray({x, y, 200.0}, {x, y, -200.0}).status, QueryStatus::miss);
        EXPECT_EQ(ground.ray({x, y, -200.0}, {x, y, 200.0}).status, QueryStatus::miss);
    }
}

TEST(GroundRay, AnswersTheSameTenThousandKilometresAway) {
    // 78125 chunks of 128 m
    const Ground here = make_test_ground(rough, {.roots = 2});
    const Ground there =
        make_test_ground([](double x, double y) { return rough(x - 1e7, y + 1e7); },
                         {.roots = 2, .origin_x = 1e7, .origin_y = -1e7});
    Random random(5);
    for (int i = 0; i < 3000; ++i) {
        auto [from, to] = random_ray(random, i, 256.0);
        for (WorldPos* const p : {&from, &to}) {
            *p = (*p * 1024.0).array().floor().matrix() / 1024.0;
        }
        const WorldPos shift(1e7, -1e7, 0.0);
        const RayAnswer a = here.ray(from, to), b = there.ray(from + shift, to + shift);
        ASSERT_EQ(a.status, b.status);
        ASSERT_EQ(a.fraction, b.fraction);
        ASSERT_EQ(a.normal, b.normal);
        ASSERT_EQ(here.height(from.x(), from.y()).height,
                  there.height(from.x() + shift.x(), from.y() + shift.y()).height);
    }
}

TEST(GroundRay, AcceptsALengthOfZeroAndOfAMillionMetres) {
    const Ground ground = make_test_ground(rough, {.roots = 2});
    Random random(6);
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
        SCOPED_TRACE(testing::Message() << "seed 6, ray " << i);
        const int column = random.below(257), row = random.below(257);
        const double height = ground.height(column, row).height;
        const WorldPos on(column, row, height);
        EXPECT_EQ(ground.ray(on, on).status, QueryStatus::ok);
        for (const double off : {1e-3, -1e-3}) {
            const WorldPos apart(column, row, height + off);
            EXPECT_EQ(ground.ray(apart, apart).status, QueryStatus::miss);
        }
        const double angle_x = random.between(-1.0, 1.0), angle_y = random.between(-1.0, 1.0);
        Eigen::Vector3d displacement(angle_x, angle_y, random.between(-0.02, 0.02));
        displacement *= 5e5 / displacement.norm();
        const WorldPos through(random.between(100.0, 156.0), random.between(100.0, 156.0),
                               random.between(-5.0, 15.0));
        const std::optional<double> expected =
            slow_ray(ground, through - displacement, through + displacement);
        const RayAnswer answer = ground.ray(through - displacement, through + displacement);
        ASSERT_EQ(answer.status, expected ? QueryStatus::ok : QueryStatus::miss);
        if (!expected) continue;
        ++hits;
        ASSERT_NEAR(answer.fraction, *expected, 1e-11);
    }
    EXPECT_GT(hits, 50);
}

TEST(GroundRay, AnswersInvalidForArgumentsThatAreNotFinite) {
    const Ground ground = make_test_ground(rough, {.roots = 2});
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kMax = std::numeric_limits<double>::max();
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
        for (int axis = 0; axis < 3; ++axis) {
            WorldPos p(10.0, 10.0, 0.0);
            p[axis] = bad;
            EXPECT_EQ(ground.ray(p, {1.0, 2.0, 3.0}).status, QueryStatus::invalid);
            EXPECT_EQ(ground.ray({1.0, 2.0, 3.0}, p).status, QueryStatus::invalid);
        }
    }
    EXPECT_EQ(ground.ray({-kMax, 1.0, 0.0}, {kMax, 1.0, 0.0}).status, QueryStatus::invalid);
    EXPECT_EQ(ground.ray({-1e300, 1.0, 1e3}, {1e300, 1.0, 1e3}).status, QueryStatus::invalid);
    EXPECT_EQ(ground.ray({-1e12, 1.0, 1e3}, {1e12, 1.0, 1e3}).status, QueryStatus::miss);
}

}  // namespace terrane::ray_test
