// SPDX-License-Identifier: MIT
//
// Batches of rays against Ground::ray() of each segment.
#include "terrain/batch/batch_scene.h"

#include <terrane/terrain/ground_batch.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane {
namespace batch_rays_test {

using test::bits_of;
using test::make_batch_ground;
using test::make_batch_points;
using test::Random;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Arrays {
    explicit Arrays(std::size_t count)
        : fractions(count, -1.0),
          points_world(3 * count, -1.0),
          normals(3 * count, -1.0),
          errors_m(count, -1.0),
          statuses(count, GroundStatus::invalid),
          filled(count, 7) {}
    RayArrays out() { return {fractions, points_world, normals, errors_m, statuses, filled}; }

    std::vector<double> fractions, points_world, normals, errors_m;
    std::vector<GroundStatus> statuses;
    std::vector<std::uint8_t> filled;
};

GroundBatch make_batch(int workers = 1) {
    return GroundBatch::create({.worker_count = workers}).value();
}

void expect_answer(const Arrays& arrays, std::size_t i, const RayAnswer& expected) {
    const bool is_ok = expected.status == GroundStatus::ok;
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
    return {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
}

TEST(BatchRays, HaveTheBitsOfSingleCallsInTheCallersOrderOnAnyNumberOfThreads) {
    constexpr std::uint64_t kSeed = 11;
    constexpr std::size_t kCount = 5000;
    for (const double spacing : {1.0, 1.1}) {
        const Ground ground = make_batch_ground(spacing);
        Random random(kSeed);
        const std::vector<double> from = make_batch_points(random, kCount, spacing);
        const std::vector<double> to = make_batch_points(random, kCount, spacing);
        for (int workers = 1; workers <= 4; ++workers) {
            GroundBatch batch = make_batch(workers);
            Arrays arrays(kCount);
            ASSERT_TRUE(batch.rays(ground, PointArray::interleaved_xyz(from),
                                   PointArray::interleaved_xyz(to), arrays.out()));
            std::array<int, 5> counts{};
            for (std::size_t i = 0; i < kCount; ++i) {
                SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", spacing " << spacing
                                                << ", workers " << workers << ", ray " << i);
                expect_answer(arrays, i, ground.ray(point_of(from, i), point_of(to, i)));
                if (HasFatalFailure()) return;
                ++counts[static_cast<std::size_t>(arrays.statuses[i])];
            }
            for (const GroundStatus status : {GroundStatus::ok, GroundStatus::miss,
                                              GroundStatus::not_resident, GroundStatus::invalid}) {
                EXPECT_GT(counts[static_cast<std::size_t>(status)], 20);
            }
        }
    }
}

// Rays of one start, as those of a scanner: from above and below the ground, on a line, in an absent chunk, outside.
TEST(BatchRays, FromOneStartHaveTheBitsOfSingleCalls) {
    constexpr std::uint64_t kSeed = 12;
    constexpr std::size_t kCount = 3000;
    const Ground ground = make_batch_ground();
    GroundBatch batch = make_batch(2);
    Random random(kSeed);
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
            SCOPED_TRACE(testing::Message()
                         << "seed " << kSeed << ", from " << from.transpose() << ", ray " << i);
            expect_answer(arrays, i, ground.ray(from, point_of(to, i)));
            if (HasFatalFailure()) return;
        }
    }
}

TEST(BatchRays, OfNoneAndOfOneRay) {
    const Ground ground = make_batch_ground();
    for (const int workers : {1, 3}) {
        GroundBatch batch = make_batch(workers);
        EXPECT_TRUE(batch.rays(ground, {}, {}, {}));
        const std::vector<double> from{12.25, 99.5, 40.0}, to{13.0, 98.0, -40.0};
        Arrays arrays(1);
        ASSERT_TRUE(batch.rays(ground, PointArray::interleaved_xyz(from),
                               PointArray::interleaved_xyz(to), arrays.out()));
        EXPECT_EQ(arrays.statuses[0], GroundStatus::ok);
        expect_answer(arrays, 0, ground.ray(point_of(from, 0), point_of(to, 0)));
    }
}

}  // namespace batch_rays_test
}  // namespace terrane
