// SPDX-License-Identifier: MIT
// A GroundBatch that exists allocates nothing.
#include "support/allocation_counter.h"
#include "terrain/batch/batch_scene.h"

#include <terrane/terrain/ground_batch.h>

#include <gtest/gtest.h>

#include <vector>

namespace terrane {
namespace batch_allocation_test {

TEST(Allocation, NeverHappensInHeightsAndRaysOfABatch) {
    if (!test::AllocationCounter::kCounts)
        GTEST_SKIP() << "nothing is counted under this sanitizer";
    const Ground ground = test::make_batch_ground();
    test::Random random(9);
    constexpr std::size_t kCount = 20'000;
    const std::vector<double> points = test::make_batch_points(random, kCount);
    std::vector<double> numbers(kCount);
    for (const int workers : {1, 2}) {
        GroundBatch batch = GroundBatch::create({.worker_count = workers}).value();
        HeightArrays heights;
        heights.heights = numbers;
        RayArrays rays;
        rays.fractions = numbers;
        const PointArray places = PointArray::interleaved_xyz(points);
        const WorldPos from(100.0, 100.0, 30.0);
        const test::AllocationCounter counter;
        ASSERT_TRUE(batch.heights(ground, places, heights));
        ASSERT_TRUE(batch.rays(ground, PointArray::repeated(from, kCount), places, rays));
        EXPECT_EQ(counter.count(), 0u);
    }
}

}  // namespace batch_allocation_test
}  // namespace terrane
