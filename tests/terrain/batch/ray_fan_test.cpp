// SPDX-License-Identifier: MIT
//
// Rays of a fan against Ground::ray() of each.
#include "terrain/batch/batch_scene.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground_batch.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace terrane {
namespace ray_fan_test {

using test::bits_of;
using test::Random;

void expect_same(const RayAnswer& answer, const RayAnswer& expected) {
    ASSERT_EQ(answer.status, expected.status);
    ASSERT_EQ(bits_of(answer.fraction), bits_of(expected.fraction));
    ASSERT_EQ(bits_of(answer.error_m), bits_of(expected.error_m));
    for (int axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(bits_of(answer.normal[axis]), bits_of(expected.normal[axis]));
        ASSERT_EQ(bits_of(answer.point_world[axis]), bits_of(expected.point_world[axis]));
    }
    ASSERT_EQ(answer.filled, expected.filled);
}

// Near the horizon, along lines and diagonals, nearly so, and upright.
Eigen::Vector3d random_direction(Random& random) {
    if (random.below(5) == 0) {
        const auto part = [&] {
            const std::array parts{0.0, 0.0, 1.0, -1.0, 1e-3, -1e-7, 1e-12, -1e-17};
            return parts[static_cast<std::size_t>(random.below(8))];
        };
        const double x = part(), y = part(), z = random.below(2) == 0 ? part() : -0.1;
        const Eigen::Vector3d d(x, y, z);
        if (d.norm() > 0.0) return d.normalized();
    }
    Eigen::Vector3d d = random.direction();
    d.z() *= 0.3;
    return d.normalized();
}

struct Counts {
    int hits = 0, misses = 0, absent = 0;
};

// Rays from an origin, some of which begin later.
void compare(const Ground& ground, const WorldPos& origin, double reach, int count, Random& random,
             Counts& counts) {
    RayFan fan;
    fan.reset(ground, origin, reach);
    for (int i = 0; i < count; ++i) {
        const Eigen::Vector3d d = random_direction(random);
        const double end = random.below(10) == 0 ? 3.0 * reach : reach;
        const double begin = random.below(2) == 0 ? 0.0 : random.between(0.0, 0.2) * end;
        const WorldPos from = origin + begin * d, to = origin + end * d;
        SCOPED_TRACE(testing::Message() << "origin " << origin.transpose() << ", ray " << i
                                        << ", direction " << d.transpose());
        const RayAnswer expected = ground.ray(from, to);
        counts.hits += expected.status == GroundStatus::ok;
        counts.misses += expected.status == GroundStatus::miss;
        counts.absent += expected.status == GroundStatus::not_resident;
        expect_same(fan.ray(from, to), expected);
        if (testing::Test::HasFatalFailure()) return;
    }
}

Ground make_hills(int spacing_log2, double amplitude) {
    FractalSettings settings;
    settings.seed = 5;
    settings.root_size_log2 = 9 + spacing_log2;
    settings.finest_spacing_log2 = spacing_log2;
    settings.wavelength_log2 = 8 + spacing_log2;
    settings.amplitude = amplitude;
    const auto source = FractalHeights::create(settings).value();
    Pager pager =
        Pager::create(source, {.worker_count = 0, .contact_spacing = std::ldexp(1.0, spacing_log2)})
            .value();
    pager.require(source->extent(), 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    return Ground(pager.resident(), pager.contact_level());
}

TEST(RayFan, HasTheBitsOfSingleRaysOverHills) {
    constexpr std::uint64_t kSeed = 21;
    Random random(kSeed);
    Counts counts;
    for (const int spacing_log2 : {-3, 0, 4}) {
        const double spacing = std::ldexp(1.0, spacing_log2);
        for (const double amplitude : {5.0 * spacing, 60.0 * spacing}) {
            const Ground ground = make_hills(spacing_log2, amplitude);
            for (int k = 0; k < 60; ++k) {
                SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", spacing " << spacing
                                                << ", amplitude " << amplitude);
                const double x = random.between(-1100.0, 1100.0) * spacing;
                const double y = random.between(-1100.0, 1100.0) * spacing;
                const std::array above{0.0, 0.3, 2.0, 2.0, 30.0, -3.0};
                const WorldPos origin(
                    x, y,
                    ground.height(x, y).height +
                        spacing * above[static_cast<std::size_t>(random.below(6))]);
                const double reach = spacing * (random.below(5) == 0 ? 3000.0 : 200.0);
                compare(ground, origin, reach, 300, random, counts);
                if (HasFatalFailure()) return;
            }
        }
    }
    EXPECT_GT(counts.hits, 5'000);
    EXPECT_GT(counts.misses, 10'000);
}

TEST(RayFan, HasTheBitsOfSingleRaysBesideHolesAbsentChunksAndVolumes) {
    constexpr std::uint64_t kSeed = 22;
    Random random(kSeed);
    Counts counts;
    for (const double spacing : {1.0, 1.1}) {
        const Ground ground = test::make_batch_ground(spacing);
        const std::vector<double> places = test::make_batch_points(random, 400, spacing);
        for (std::size_t k = 0; 3 * k < places.size(); ++k) {
            SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", spacing " << spacing);
            const WorldPos origin(places[3 * k], places[3 * k + 1], places[3 * k + 2]);
            compare(ground, origin, 150.0, 100, random, counts);
            if (HasFatalFailure()) return;
        }
    }
    EXPECT_GT(counts.hits, 1'000);
    EXPECT_GT(counts.absent, 1'000);
}

TEST(RayFan, AnswersFromAnyOriginAndToAnyReach) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    const Ground ground = make_hills(0, 20.0);
    RayFan fan;
    EXPECT_EQ(fan.ray({0, 0, 0}, {1, 0, 0}).status, GroundStatus::invalid);
    Random random(23);
    const std::array origins{WorldPos(1e9, 0.0, 50.0), WorldPos(0.0, 0.0, 1e9),
                             WorldPos(0.0, 0.0, -1e9), WorldPos(1e300, 0.0, 0.0),
                             WorldPos(kNaN, 0.0, 0.0), WorldPos(0.0, kInfinity, 0.0)};
    for (const WorldPos& origin : origins) {
        for (const double reach : {0.0, 1.0, 1e7, 1e300, kInfinity, kNaN, -1.0}) {
            fan.reset(ground, origin, reach);
            for (int i = 0; i < 20; ++i) {
                const WorldPos to = origin + 1e9 * random_direction(random);
                SCOPED_TRACE(testing::Message() << origin.transpose() << ", reach " << reach);
                expect_same(fan.ray(origin, to), ground.ray(origin, to));
                if (HasFatalFailure()) return;
            }
        }
    }
}

}  // namespace ray_fan_test
}  // namespace terrane
