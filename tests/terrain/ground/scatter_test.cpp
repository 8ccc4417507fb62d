// SPDX-License-Identifier: MIT
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/scatter.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <string>

namespace terrane::test::scatter {
namespace {

std::shared_ptr<const HeightSource> hills(std::uint64_t seed) {
    return FractalHeights::create({.seed = seed,
                                   .octave_count = 8,
                                   .amplitude = 100.0,
                                   .wavelength_log2 = 9,
                                   .root_size_log2 = 11})
        .value();
}

Scatter make(const std::shared_ptr<const HeightSource>& source, const ScatterSettings& settings) {
    return Scatter::create(source, settings).value();
}

std::vector<ScatterPoint> objects_of(const Scatter& scatter, const ScatterSquare& square) {
    return scatter.objects_in(square).value();
}

// Objects of all squares over the source's extent.
std::vector<ScatterPoint> all_objects(const HeightSource& source, const Scatter& scatter) {
    const WorldRect& extent = source.extent();
    const ScatterSquare first = scatter.square_at(extent.west, extent.south);
    const ScatterSquare last = scatter.square_at(extent.east, extent.north);
    std::vector<ScatterPoint> all;
    for (std::int32_t y = first.y; y <= last.y; ++y) {
        for (std::int32_t x = first.x; x <= last.x; ++x) {
            const std::vector<ScatterPoint> points = scatter.objects_in({x, y}).value();
            all.insert(all.end(), points.begin(), points.end());
        }
    }
    return all;
}

double area_km2(const WorldRect& extent) {
    return (extent.east - extent.west) * (extent.north - extent.south) * 1e-6;
}

TEST(Scatter, HasItsDensityWhereEverythingIsAllowed) {
    const auto source = hills(1);
    for (const double per_km2 : {3.0, 100.0, 2000.0, 100'000.0}) {
        const Scatter scatter = make(source, {.per_km2 = per_km2, .seed = 5});
        const double expected = per_km2 * area_km2(source->extent());
        const auto count = static_cast<double>(all_objects(*source, scatter).size());
        // within five standard deviations of a Poisson process
        EXPECT_NEAR(count, expected, 5.0 * std::sqrt(expected)) << per_km2;
    }
}

TEST(Scatter, StandsOnTheContactSurfaceInsideItsSquare) {
    const auto source = hills(2);
    const Lattice& lattice = source->lattice();
    const Scatter scatter = make(source, {.per_km2 = 5000.0, .seed = 9});
    const ScatterSquare first = scatter.square_at(0.0, 0.0);
    const WorldRect low = scatter.rect_of({first.x - 1, first.y - 1});
    const WorldRect high = scatter.rect_of({first.x + 1, first.y + 1});
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({low.west, low.south, high.east, high.north}, 0.0);
    pager.update({}, {}, 0.0);
    const Ground ground = pager.ground();
    std::size_t count = 0;
    for (std::int32_t y = first.y - 1; y <= first.y + 1; ++y) {
        for (std::int32_t x = first.x - 1; x <= first.x + 1; ++x) {
            const WorldRect rect = scatter.rect_of({x, y});
            for (const ScatterPoint& point : objects_of(scatter, {x, y})) {
                const WorldPos& p = point.position_world;
                ASSERT_TRUE(rect.contains(p.x(), p.y()));
                const HeightAnswer answer = ground.height(p.x(), p.y());
                ASSERT_EQ(answer.status, QueryStatus::ok);
                // a chunk's heights are multiples of the quantum
                ASSERT_NEAR(p.z(), answer.height, lattice.quantum);
                ASSERT_GE(point.scale, 0.8);
                ASSERT_LE(point.scale, 1.25);
                ASSERT_NEAR(std::hypot(point.half_turn_cosine, point.half_turn_sine), 1.0, 1e-12);
                ++count;
            }
        }
    }
    EXPECT_GT(count, 100u);
}

TEST(Scatter, KeepsToSlopesAndHeightsAndThinsNothingElse) {
    const auto source = hills(3);
    const double steep = 20.0 * std::numbers::pi / 180.0;
    const auto count = [&](const ScatterSettings& settings) {
        return all_objects(*source, make(source, settings)).size();
    };
    const std::size_t all = count({.per_km2 = 2000.0, .seed = 4});
    const std::size_t flat = count({.per_km2 = 2000.0, .max_slope = steep, .seed = 4});
    const std::size_t slopes = count({.per_km2 = 2000.0, .min_slope = steep, .seed = 4});
    const std::size_t low = count({.per_km2 = 2000.0, .max_height = 10.0, .seed = 4});
    const std::size_t high = count({.per_km2 = 2000.0, .min_height = 10.0, .seed = 4});
    EXPECT_EQ(flat + slopes, all);
    EXPECT_EQ(low + high, all);
    EXPECT_GT(std::min({flat, slopes, low, high}), all / 20);
}

TEST(Scatter, ASquareDoesNotDependOnTheOthersAndAnotherSeedIsAnotherOne) {
    const auto source = hills(4);
    const Scatter scatter = make(source, {.per_km2 = 3000.0, .seed = 1});
    const Scatter same = make(source, {.per_km2 = 3000.0, .seed = 1});
    const Scatter other = make(source, {.per_km2 = 3000.0, .seed = 2});
    all_objects(*source, scatter);
    const ScatterSquare square = scatter.square_at(300.0, -200.0);
    const auto a = scatter.objects_in(square).value(), b = same.objects_in(square).value();
    const auto c = other.objects_in(square).value();
    ASSERT_FALSE(a.empty());
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(ScatterPoint)), 0);
    EXPECT_NE(a.front().position_world, c.front().position_world);
}

TEST(Scatter, DistanceIsNotAboveThatOfAnyObject) {
    std::size_t count = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        SeededRandom random(seed);
        const auto source = hills(seed);
        const Scatter scatter = make(source, {.per_km2 = 1000.0, .seed = seed});
        const WorldPos p = random.between(0.0, 2000.0) * random.direction();
        const ScatterSquare square =
            scatter.square_at(random.between(-900.0, 900.0), random.between(-900.0, 900.0));
        const double distance = scatter.distance_to(square, p);
        for (const ScatterPoint& point : objects_of(scatter, square)) {
            ++count;
            ASSERT_LE(distance, (point.position_world - p).norm() * (1.0 + 1e-12));
        }
    }
    EXPECT_GT(count, 500u);
    const auto source = hills(0);
    const Scatter scatter = make(source, {});
    EXPECT_TRUE(std::isinf(scatter.distance_to({1 << 20, 0}, WorldPos(0, 0, 0))));
    EXPECT_TRUE(scatter.objects_in({1 << 20, 0}).value().empty());
}

TEST(Scatter, SquaresWithinADistanceAreAllThatHaveGroundThere) {
    const auto source = hills(6);
    const Scatter scatter = make(source, {.per_km2 = 500.0});
    Random random(6);
    long inside = 0;
    for (int i = 0; i < 200; ++i) {
        const WorldPos p(random.between(-3000.0, 3000.0), random.between(-3000.0, 3000.0), 0.0);
        const double distance = std::exp2(random.between(0.0, 14.0));
        const std::optional<ScatterRange> range = scatter.squares_within(p, distance);
        const WorldRect& extent = source->extent();
        for (int k = 0; k < 20; ++k) {
            const double x = p.x() + random.between(-distance, distance);
            const double y = p.y() + random.between(-distance, distance);
            if (!extent.contains(x, y) || std::hypot(x - p.x(), y - p.y()) > distance) continue;
            ++inside;
            ASSERT_TRUE(range.has_value());
            const ScatterSquare square = scatter.square_at(x, y);
            ASSERT_TRUE(square.x >= range->low.x && square.x <= range->high.x);
            ASSERT_TRUE(square.y >= range->low.y && square.y <= range->high.y);
        }
    }
    EXPECT_GT(inside, 200);
    EXPECT_FALSE(scatter.squares_within(WorldPos(1e15, 0, 0), 1e3).has_value());
    EXPECT_TRUE(scatter.squares_within(WorldPos(1e15, 0, 0), INFINITY).has_value());
}

TEST(Scatter, RefusesSettingsOutOfRangeByTheirNames) {
    const auto source = hills(1);
    const auto message = [&](const ScatterSettings& settings) {
        const auto made = Scatter::create(source, settings);
        return made.has_value() ? std::string() : made.error().message;
    };
    EXPECT_EQ(message({.per_km2 = 0.0}), "per_km2 must be above 0 and at most 1e+06, got 0");
    EXPECT_EQ(message({.per_km2 = 1e9}), "per_km2 must be above 0 and at most 1e+06, got 1e+09");
    EXPECT_EQ(message({.per_km2 = std::nan("")}),
              "per_km2 must be above 0 and at most 1e+06, got nan");
    EXPECT_EQ(message({.min_slope = 1.0, .max_slope = 0.5}),
              "max_slope must be 1 to 1.5708, got 0.5");
    EXPECT_EQ(message({.min_height = 5.0, .max_height = 4.0}),
              "max_height must be at least min_height, 5, got 4");
    EXPECT_EQ(message({.min_scale = 0.0}), "min_scale must be 0.001 to 1000, got 0");
    EXPECT_EQ(message({.min_scale = 2.0, .max_scale = 1.0}), "max_scale must be 2 to 1000, got 1");
    EXPECT_EQ(message({.per_km2 = 1e6}), "");
    // a 128 m lattice has cells of 0.016 km2
    const auto coarse = FractalHeights::create({.finest_spacing_log2 = 7}).value();
    EXPECT_EQ(
        Scatter::create(coarse, {.per_km2 = 1e6}).error().message,
        "per_km2 must give at most 4096 objects in a cell of the finest spacing, 128 m, got 16384");
}

}  // namespace
}  // namespace terrane::test::scatter
