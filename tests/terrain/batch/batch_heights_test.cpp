// SPDX-License-Identifier: MIT
//
// Batches of heights against Ground::height() of each point.
#include "terrain/batch/batch_scene.h"

#include <terrane/terrain/ground_batch.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane {
namespace batch_heights_test {

using test::bits_of;
using test::make_batch_ground;
using test::make_batch_points;
using test::Random;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Arrays {
    explicit Arrays(std::size_t count)
        : heights(count, -1.0),
          normals(3 * count, -1.0),
          errors_m(count, -1.0),
          statuses(count, GroundStatus::invalid),
          filled(count, 7) {}
    HeightArrays out() { return {heights, normals, errors_m, statuses, filled}; }

    std::vector<double> heights, normals, errors_m;
    std::vector<GroundStatus> statuses;
    std::vector<std::uint8_t> filled;
};

GroundBatch make_batch(int workers = 1) {
    return GroundBatch::create({.worker_count = workers}).value();
}

// x y z x y z ... without z.
std::vector<double> without_z(const std::vector<double>& points) {
    std::vector<double> flat;
    for (std::size_t i = 0; i < points.size(); i += 3) {
        flat.push_back(points[i]);
        flat.push_back(points[i + 1]);
    }
    return flat;
}

void expect_answer(const Arrays& arrays, std::size_t i, const HeightAnswer& expected) {
    const bool is_ok = expected.status == GroundStatus::ok;
    ASSERT_EQ(arrays.statuses[i], expected.status);
    ASSERT_EQ(bits_of(arrays.heights[i]), bits_of(is_ok ? expected.height : kNaN));
    ASSERT_EQ(bits_of(arrays.errors_m[i]), bits_of(is_ok ? expected.error_m : kNaN));
    for (int axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(bits_of(arrays.normals[3 * i + static_cast<std::size_t>(axis)]),
                  bits_of(is_ok ? expected.normal[axis] : kNaN));
    }
    ASSERT_EQ(arrays.filled[i], is_ok && expected.filled ? 1 : 0);
}

TEST(BatchHeights, HaveTheBitsOfSingleCallsInTheCallersOrderOnAnyNumberOfThreads) {
    constexpr std::uint64_t kSeed = 5;
    constexpr std::size_t kCount = 30'000;
    for (const double spacing : {1.0, 1.1}) {
        const Ground ground = make_batch_ground(spacing);
        Random random(kSeed);
        const std::vector<double> points = make_batch_points(random, kCount, spacing);
        for (int workers = 1; workers <= 4; ++workers) {
            GroundBatch batch = make_batch(workers);
            Arrays arrays(kCount);
            ASSERT_TRUE(batch.heights(ground, PointArray::interleaved_xyz(points), arrays.out()));
            std::array<int, 5> counts{};
            for (std::size_t i = 0; i < kCount; ++i) {
                SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", spacing " << spacing
                                                << ", workers " << workers << ", point " << i);
                expect_answer(arrays, i, ground.height(points[3 * i], points[3 * i + 1]));
                if (HasFatalFailure()) return;
                ++counts[static_cast<std::size_t>(arrays.statuses[i])];
            }
            for (const GroundStatus status : {GroundStatus::ok, GroundStatus::outside,
                                              GroundStatus::not_resident, GroundStatus::invalid}) {
                EXPECT_GT(counts[static_cast<std::size_t>(status)], 100);
            }
        }
    }
}

TEST(BatchHeights, AreTheSameForEveryLayoutOfThePoints) {
    constexpr std::size_t kCount = 500;
    const Ground ground = make_batch_ground();
    Random random(6);
    const std::vector<double> points = make_batch_points(random, kCount);
    const std::vector<double> flat = without_z(points);
    std::vector<double> x, y;
    for (std::size_t i = 0; i < kCount; ++i) {
        x.push_back(points[3 * i]);
        y.push_back(points[3 * i + 1]);
    }
    GroundBatch batch = make_batch();
    for (const PointArray& layout :
         {PointArray::interleaved_xyz(points), PointArray::interleaved_xy(flat),
          PointArray::separate(x, y)}) {
        Arrays arrays(kCount);
        ASSERT_TRUE(batch.heights(ground, layout, arrays.out()));
        for (std::size_t i = 0; i < kCount; ++i)
            expect_answer(arrays, i, ground.height(x[i], y[i]));
    }
    const WorldPos point(100.25, 17.5, 0.0);
    Arrays arrays(kCount);
    ASSERT_TRUE(batch.heights(ground, PointArray::repeated(point, kCount), arrays.out()));
    for (std::size_t i = 0; i < kCount; ++i) expect_answer(arrays, i, ground.height(100.25, 17.5));
}

TEST(BatchHeights, WriteOnlyTheArraysThatAreGiven) {
    constexpr std::size_t kCount = 300;
    const Ground ground = make_batch_ground();
    Random random(7);
    const std::vector<double> points = make_batch_points(random, kCount);
    const PointArray places = PointArray::interleaved_xyz(points);
    GroundBatch batch = make_batch();
    Arrays all(kCount);
    ASSERT_TRUE(batch.heights(ground, places, all.out()));
    for (int left_out = 0; left_out < 32; ++left_out) {
        Arrays some(kCount);
        HeightArrays out = some.out();
        if ((left_out & 1) != 0) out.heights = {};
        if ((left_out & 2) != 0) out.normals = {};
        if ((left_out & 4) != 0) out.errors_m = {};
        if ((left_out & 8) != 0) out.statuses = {};
        if ((left_out & 16) != 0) out.filled = {};
        ASSERT_TRUE(batch.heights(ground, places, out));
        for (std::size_t i = 0; i < kCount; ++i) {
            ASSERT_EQ(bits_of(some.heights[i]),
                      bits_of(out.heights.empty() ? -1.0 : all.heights[i]));
            ASSERT_EQ(bits_of(some.normals[3 * i]),
                      bits_of(out.normals.empty() ? -1.0 : all.normals[3 * i]));
            ASSERT_EQ(bits_of(some.errors_m[i]),
                      bits_of(out.errors_m.empty() ? -1.0 : all.errors_m[i]));
            ASSERT_EQ(some.statuses[i],
                      out.statuses.empty() ? GroundStatus::invalid : all.statuses[i]);
            ASSERT_EQ(some.filled[i], out.filled.empty() ? 7 : all.filled[i]);
        }
    }
}

// One object for grounds that come and go: nothing is remembered of the last call's chunks.
TEST(BatchHeights, AreThoseOfTheGroundOfThisCall) {
    GroundBatch batch = make_batch(2);
    Random random(8);
    const std::vector<double> points = make_batch_points(random, 2000);
    for (int repeat = 0; repeat < 4; ++repeat) {
        const Ground ground = test::make_test_ground(
            [repeat](double x, double y) { return 10.0 * repeat + 0.01 * x * y; }, 1.0, 3);
        Arrays arrays(2000);
        ASSERT_TRUE(batch.heights(ground, PointArray::interleaved_xyz(points), arrays.out()));
        for (std::size_t i = 0; i < 2000; ++i)
            expect_answer(arrays, i, ground.height(points[3 * i], points[3 * i + 1]));
    }
}

TEST(BatchHeights, OfNoneAndOfOnePoint) {
    const Ground ground = make_batch_ground();
    for (const int workers : {1, 3}) {
        GroundBatch batch = make_batch(workers);
        EXPECT_TRUE(batch.heights(ground, {}, {}));
        const std::vector<double> one{12.25, 99.5};
        Arrays arrays(1);
        ASSERT_TRUE(batch.heights(ground, PointArray::interleaved_xy(one), arrays.out()));
        expect_answer(arrays, 0, ground.height(12.25, 99.5));
    }
}

}  // namespace batch_heights_test
}  // namespace terrane
