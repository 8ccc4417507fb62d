// SPDX-License-Identifier: MIT
//
// The order of places by chunk, and rays that are answered in it.
#include "ground/ground_batch.h"
#include "support/heights/table_ground.h"
#include "terrain/batch/batch_scene.h"

#include <terrane/terrain/ground_batch.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane {
namespace chunk_order_test {

using internal::ChunkOrder;
using test::Random;

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
    constexpr std::uint64_t kSeed = 31;
    const Ground ground = make_wide_ground();
    const ChunkOrder::Grid grid(ground);
    Random random(kSeed);
    ChunkOrder order;
    for (const std::size_t count : {std::size_t{1024}, std::size_t{5000}, ChunkOrder::kMost}) {
        SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", count " << count);
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
    constexpr std::uint64_t kSeed = 33;
    constexpr std::size_t kCount = 12'000;
    const Ground ground = make_wide_ground();
    Random random(kSeed);
    std::vector<double> from, to, fractions(kCount);
    for (const Place& place : scattered_places(random, kCount)) {
        const WorldPos start(place.x, place.y, 8.0);
        const WorldPos end = start + 30.0 * random.direction();
        from.insert(from.end(), start.data(), start.data() + 3);
        to.insert(to.end(), end.data(), end.data() + 3);
    }
    for (const int workers : {1, 2}) {
        GroundBatch batch = GroundBatch::create({.worker_count = workers}).value();
        RayArrays out;
        out.fractions = fractions;
        ASSERT_TRUE(batch.rays(ground, PointArray::interleaved_xyz(from),
                               PointArray::interleaved_xyz(to), out));
        for (std::size_t i = 0; i < kCount; ++i) {
            const RayAnswer expected = ground.ray({from[3 * i], from[3 * i + 1], from[3 * i + 2]},
                                                  {to[3 * i], to[3 * i + 1], to[3 * i + 2]});
            ASSERT_EQ(test::bits_of(fractions[i]),
                      test::bits_of(expected.status == GroundStatus::ok ? expected.fraction : kNaN))
                << "seed " << kSeed << ", ray " << i;
        }
    }
}

}  // namespace chunk_order_test
}  // namespace terrane
