// SPDX-License-Identifier: MIT
// Ground::surface() allocates nothing, with a map or without, and copying a ground neither.
#include "support/allocation_counter.h"

#include <terrane/terrain/ground.h>
#include <terrane/terrain/surface.h>

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

namespace terrane {
namespace surface_allocation_test {

Ground ground_with(std::shared_ptr<const SurfaceMap> map) {
    return {std::make_shared<const ResidentSet>(Lattice{}, WorldRect{0.0, 0.0, 128.0, 128.0},
                                                std::vector<std::shared_ptr<const Chunk>>{}, 0),
            0, std::move(map)};
}

std::uint64_t allocations_of(const Ground& ground) {
    std::uint32_t materials = 0;
    Ground other = ground;
    const test::AllocationCounter counter;
    for (int i = 0; i < 1000; ++i) {
        Ground copy = ground;
        other = std::move(copy);
        if (const auto found = other.surface(0.3 * i, 0.2 * i)) materials += found->material;
    }
    const std::uint64_t count = counter.count();
    EXPECT_EQ(materials > 0, ground.surface_map() != nullptr);
    return count;
}

TEST(Allocation, NeverHappensInSurfacePropertiesOfTheGround) {
    if (!test::AllocationCounter::kCounts)
        GTEST_SKIP() << "nothing is counted under this sanitizer";
    EXPECT_EQ(allocations_of(ground_with(nullptr)), 0u);
    std::vector<SurfaceRect> rects;
    for (std::uint32_t i = 0; i < 200; ++i) {
        rects.push_back({{i * 1.0, 0.0, i + 2.0, 150.0}, {.material = i + 1}});
    }
    EXPECT_EQ(allocations_of(ground_with(SurfaceMap::from_rects(rects).value())), 0u);
    const auto function = [](double x, double) {
        return SurfaceProperties{.friction = x - 50.0, .material = 1};
    };
    const auto map = SurfaceMap::from_function(function).value();
    EXPECT_EQ(allocations_of(ground_with(map)), 0u);
    EXPECT_GT(map->fault_count(), 0u);
}

}  // namespace surface_allocation_test
}  // namespace terrane
