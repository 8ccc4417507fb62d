// SPDX-License-Identifier: MIT
//
// Batches of rays against Ground::ray() for each segment.
#include "ground/ground_batch.h"
#include "terrain/ground/batch_scene.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground_batch.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane::batch_rays_test {

using namespace test;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Arrays {
    explicit Arrays(std::size_t count)
        : fractions(count, -1.0),
          points_world(3 * count, -1.0),
          normals(3 * count, -1.0),
          errors_m(count, -1.0),
          statuses(count, QueryStatus::invalid),
          filled(count, 7) {}
    RayArrays out() { return {fractions, points_world, normals, errors_m, statuses, filled}; }

    std::vector<double> fractions, points_world, normals, errors_m;
    std::vector<QueryStatus> statuses;
    std::vector<std::uint8_t> filled;
};

GroundBatch make_batch(int workers = 1) {
    return GroundBatch::create({.worker_count = workers}).value();
}

void expect_answer(const Arrays& arrays, std::size_t i, const RayAnswer& expected) {
    const bool is_ok = expected.status == QueryStatus::ok;
    ASSERT_EQ(arrays.statuses[i], expected.status);
    ASSERT_EQ(bits_of(arrays.fractions[i]), bits_of(is_ok ? expected.fraction : kNaN));
    ASSERT_EQ(bits_of(arrays.errors_m[i]), bits_of(is_ok ? expected.error_m : kNaN));
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t at = 3 * i + static_cast<std::size_t>(axis);
        ASSERT_EQ(bits_of(arrays.normals[at]), bits_of(is_ok ? expected.normal[axis] : kNaN));
        ASSERT_EQ(bits_of(arrays.points_world[at]),
                  bits_of(is_ok ? expected.point_world[axis] : kNaN));
    }
    ASSERT_EQ(arrays.filled[i], is_ok && expected.filled ? 1 : 0);
}

WorldPos point_of(const std::vector<double>& points, std::size_t i) {
    return WorldPos(&points[3 * i]);
}

TEST(BatchRays, HaveTheBitsOfSingleCallsInTheCallersOrderOnAnyNumberOfThreads) {
    constexpr std::size_t kCount = 5000;
    for (const double spacing : {1.0, 1.1}) {
        const Ground ground = make_batch_ground(spacing);
        SeededRandom random(11);
        const std::vector<double> from = make_batch_points(random, kCount, spacing);
        const std::vector<double> to = make_batch_points(random, kCount, spacing);
        for (int workers = 1; workers <= 4; ++workers) {
            SCOPED_TRACE(testing::Message() << "spacing " << spacing << ", workers " << workers);
            GroundBatch batch = make_batch(workers);
            std::array<int, 6> counts{};
            for (const std::size_t count : {std::size_t{0}, std::size_t{1}, kCount}) {
                Arrays arrays(count);
                const auto first = [&](const std::vector<double>& points) {
                    return PointArray::interleaved_xyz(std::span(points).first(3 * count));
                };
                ASSERT_TRUE(batch.rays(ground, first(from), first(to), arrays.out()));
                for (std::size_t i = 0; i < count; ++i) {
                    SCOPED_TRACE(testing::Message() << "ray " << i);
                    expect_answer(arrays, i, ground.ray(point_of(from, i), point_of(to, i)));
                    if (HasFatalFailure()) return;
                    ++counts[static_cast<std::size_t>(arrays.statuses[i])];
                }
            }
            for (const QueryStatus status : {QueryStatus::ok, QueryStatus::miss,
                                             QueryStatus::not_resident, QueryStatus::invalid}) {
                EXPECT_GT(counts[static_cast<std::size_t>(status)], 20);
            }
        }
    }
}

// Rays with a common start, as of a scanner: above and below the ground, on a lattice line, in an absent chunk,
// outside.
TEST(BatchRays, FromOneStartHaveTheBitsOfSingleCalls) {
    constexpr std::size_t kCount = 3000;
    const Ground ground = make_batch_ground();
    GroundBatch batch = make_batch(2);
    SeededRandom random(12);
    for (const WorldPos& from :
         {WorldPos(70.3, 80.1, 14.0), WorldPos(70.3, 80.1, -40.0), WorldPos(64.0, 128.0, 12.0),
          WorldPos(200.0, 300.0, 20.0), WorldPos(-30.0, 100.0, 12.0), WorldPos(383.9, 0.1, 10.0),
          WorldPos(kNaN, 0.0, 0.0), WorldPos(1e9, 1e9, 0.0)}) {
        std::vector<double> to;
        for (std::size_t i = 0; i < kCount; ++i) {
            const WorldPos end = from + 200.0 * random.direction();
            to.insert(to.end(), end.data(), end.data() + 3);
        }
        Arrays arrays(kCount);
        ASSERT_TRUE(batch.rays(ground, PointArray::repeated(from, kCount),
                               PointArray::interleaved_xyz(to), arrays.out()));
        for (std::size_t i = 0; i < kCount; ++i) {
            SCOPED_TRACE(testing::Message() << "from " << from.transpose() << ", ray " << i);
            expect_answer(arrays, i, ground.ray(from, point_of(to, i)));
            if (HasFatalFailure()) return;
        }
    }
}

}  // namespace terrane::batch_rays_test

// Ray fans against Ground::ray() for each ray.

namespace terrane::ray_fan_test {

using namespace test;

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

// Near the horizon, exactly or nearly along lattice lines and diagonals, and vertical.
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

// Rays from one origin, some of which start at a distance from it.
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
        counts.hits += expected.status == QueryStatus::ok;
        counts.misses += expected.status == QueryStatus::miss;
        counts.absent += expected.status == QueryStatus::not_resident;
        expect_same(fan.ray(from, to), expected);
        if (testing::Test::HasFatalFailure()) return;
    }
}

Ground make_hills(int spacing_log2, double amplitude) {
    FractalSettings settings{.seed = 5,
                             .amplitude = amplitude,
                             .wavelength_log2 = 8 + spacing_log2,
                             .finest_spacing_log2 = spacing_log2,
                             .root_size_log2 = 9 + spacing_log2};
    const auto source = FractalHeights::create(settings).value();
    Pager pager =
        Pager::create(source, {.worker_count = 0, .contact_spacing = std::ldexp(1.0, spacing_log2)})
            .value();
    const RequiredRegion region = pager.require(source->extent(), 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    return pager.ground();
}

TEST(RayFan, HasTheBitsOfSingleRaysOverHills) {
    const int fans = few_or_many(20, 60);
    SeededRandom random(21);
    Counts counts;
    for (const int spacing_log2 : {-3, 0, 4}) {
        const double spacing = std::ldexp(1.0, spacing_log2);
        for (const double amplitude : {5.0 * spacing, 60.0 * spacing}) {
            const Ground ground = make_hills(spacing_log2, amplitude);
            for (int k = 0; k < fans; ++k) {
                SCOPED_TRACE(testing::Message()
                             << "spacing " << spacing << ", amplitude " << amplitude);
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
    EXPECT_GT(counts.hits, 250 * fans / 3);
    EXPECT_GT(counts.misses, 500 * fans / 3);
}

TEST(RayFan, HasTheBitsOfSingleRaysBesideHolesAbsentChunksAndVolumes) {
    const int fans = few_or_many(130, 400);
    SeededRandom random(22);
    Counts counts;
    for (const double spacing : {1.0, 1.1}) {
        const Ground ground = test::make_batch_ground(spacing);
        const std::vector<double> places =
            test::make_batch_points(random, static_cast<std::size_t>(fans), spacing);
        for (std::size_t k = 0; 3 * k < places.size(); ++k) {
            SCOPED_TRACE(testing::Message() << "spacing " << spacing);
            const WorldPos origin(places[3 * k], places[3 * k + 1], places[3 * k + 2]);
            compare(ground, origin, 150.0, 100, random, counts);
            if (HasFatalFailure()) return;
        }
    }
    EXPECT_GT(counts.hits, 5 * fans / 2);
    EXPECT_GT(counts.absent, 5 * fans / 2);
}

TEST(RayFan, AnswersFromAnyOriginAndToAnyReach) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    const Ground ground = make_hills(0, 20.0);
    RayFan fan;
    EXPECT_EQ(fan.ray({0, 0, 0}, {1, 0, 0}).status, QueryStatus::invalid);
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

}  // namespace terrane::ray_fan_test

// The order of positions by chunk, and rays answered in that order.

namespace terrane::chunk_order_test {

using namespace test;
using internal::ChunkOrder;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSide = 6.0 * kChunkCells;

Ground make_wide_ground() {
    return test::make_test_ground(
        [](double x, double y) { return 3.0 * std::sin(0.2 * x) + 2.0 * std::cos(0.31 * y); }, 1.0,
        6);
}

struct Place {
    double x, y;
};

std::vector<Place> scattered_places(Random& random, std::size_t count) {
    std::vector<Place> places;
    for (std::size_t i = 0; i < count; ++i) {
        places.push_back({random.between(-50.0, kSide + 50.0), random.between(0.0, kSide)});
        if (i % 100 == 0) places.back().y = kNaN;
    }
    return places;
}

TEST(ChunkOrder, HasEveryPlaceOnceAndThoseOfAChunkTogetherInTheirOwnOrder) {
    const Ground ground = make_wide_ground();
    const ChunkOrder::Grid grid(ground);
    SeededRandom random(31);
    ChunkOrder order;
    for (const std::size_t count : {std::size_t{1024}, std::size_t{5000}, ChunkOrder::kMost}) {
        SCOPED_TRACE(testing::Message() << "count " << count);
        const std::vector<Place> places = scattered_places(random, count);
        const auto bucket_of = [&](std::size_t i) { return grid.bucket(places[i].x, places[i].y); };
        const std::span<const std::uint32_t> indices = order.arrange(count, bucket_of);
        ASSERT_EQ(indices.size(), count);
        std::vector<std::uint32_t> sorted(indices.begin(), indices.end());
        std::sort(sorted.begin(), sorted.end());
        for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(sorted[i], i);
        for (std::size_t i = 1; i < count; ++i) {
            const auto before = bucket_of(indices[i - 1]), now = bucket_of(indices[i]);
            ASSERT_LE(before, now);
            ASSERT_TRUE(before != now || indices[i - 1] < indices[i]);
        }
    }
}

TEST(ChunkOrder, PutsPlacesOfDifferentChunksOfAGroundIntoDifferentBuckets) {
    const Ground ground = make_wide_ground();
    const ChunkOrder::Grid grid(ground);
    std::vector<std::uint16_t> buckets{grid.bucket(kNaN, 1.0)};
    EXPECT_EQ(buckets[0], grid.bucket(-1.0, 5.0));
    for (int row = 0; row < 6; ++row) {
        for (int column = 0; column < 6; ++column) {
            const double x = 128.0 * column, y = 128.0 * row;
            buckets.push_back(grid.bucket(x + 0.5, y + 0.5));
            EXPECT_EQ(buckets.back(), grid.bucket(x + 127.5, y + 127.5));
        }
    }
    std::sort(buckets.begin(), buckets.end());
    EXPECT_EQ(std::adjacent_find(buckets.begin(), buckets.end()), buckets.end());
}

TEST(ChunkOrder, IsEmptyForPlacesInRunsOrInFewChunksOrFewPlaces) {
    const Ground ground = make_wide_ground();
    const ChunkOrder::Grid grid(ground);
    ChunkOrder order;
    Random random(32);
    const std::vector<Place> places = scattered_places(random, 20'000);
    const auto scattered = [&](std::size_t i) { return grid.bucket(places[i].x, places[i].y); };
    EXPECT_TRUE(order.arrange(0, scattered).empty());
    EXPECT_TRUE(order.arrange(1, scattered).empty());
    EXPECT_TRUE(order.arrange(1023, scattered).empty());
    EXPECT_FALSE(order.arrange(20'000, scattered).empty());
    const auto in_runs = [&](std::size_t i) {
        const double d = static_cast<double>(i);
        return grid.bucket(std::fmod(d * 0.7, kSide), std::floor(d * 0.7 / kSide));
    };
    EXPECT_TRUE(order.arrange(20'000, in_runs).empty());
    const auto in_few = [&](std::size_t i) {
        return grid.bucket(places[i].x / 4.0, places[i].y / 4.0);
    };
    EXPECT_TRUE(order.arrange(20'000, in_few).empty());
}

TEST(ChunkOrder, ChangesNoAnswerOfScatteredRays) {
    constexpr std::size_t kCount = 12'000;
    const Ground ground = make_wide_ground();
    SeededRandom random(33);
    std::vector<double> from, to, fractions(kCount);
    for (const Place& place : scattered_places(random, kCount)) {
        const WorldPos start(place.x, place.y, 8.0);
        const WorldPos end = start + 30.0 * random.direction();
        from.insert(from.end(), start.data(), start.data() + 3);
        to.insert(to.end(), end.data(), end.data() + 3);
    }
    for (const int workers : {1, 2}) {
        GroundBatch batch = GroundBatch::create({.worker_count = workers}).value();
        RayArrays out{.fractions = fractions};
        ASSERT_TRUE(batch.rays(ground, PointArray::interleaved_xyz(from),
                               PointArray::interleaved_xyz(to), out));
        for (std::size_t i = 0; i < kCount; ++i) {
            const RayAnswer expected = ground.ray(WorldPos(&from[3 * i]), WorldPos(&to[3 * i]));
            ASSERT_EQ(test::bits_of(fractions[i]),
                      test::bits_of(expected.status == QueryStatus::ok ? expected.fraction : kNaN))
                << "ray " << i;
        }
    }
}

}  // namespace terrane::chunk_order_test
