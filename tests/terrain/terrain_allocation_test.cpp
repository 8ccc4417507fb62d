// SPDX-License-Identifier: MIT
//
// Triangulator::update() allocates nothing in any frame of a flight after the first.
#include "paging/demand/contact_needs.h"
#include "support/allocation_counter.h"
#include "terrain/ground/batch_scene.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground_batch.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/surface.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::allocation_test {

using test::AllocationCounter;

constexpr int kFrames = 200;

TEST(AllocationCounter, CountsEveryFormOfNew) {
    if (!AllocationCounter::kCounts) GTEST_SKIP() << "this sanitizer has operators new of its own";
    const AllocationCounter counter;
    // stored so that the compiler cannot elide the allocations
    static void* volatile kept = nullptr;
    auto* one = new int(1);
    kept = one;
    EXPECT_EQ(counter.count(), 1u);
    auto* several = new double[7];
    kept = several;
    EXPECT_EQ(counter.count(), 2u);
    struct alignas(128) Wide {
        double values[16];
    };
    auto* wide = new Wide{};
    kept = wide;
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(wide) % 128, 0u);
    EXPECT_EQ(counter.count(), 3u);
    auto* quiet = new (std::nothrow) int(2);
    kept = quiet;
    EXPECT_EQ(counter.count(), 4u);
    EXPECT_NE(kept, nullptr);
    delete quiet;
    delete wide;
    delete[] several;
    delete one;
    EXPECT_EQ(counter.count(), 4u);
    std::vector<int> grown;
    for (int i = 0; i < 100; ++i) grown.push_back(i);
    EXPECT_GT(counter.count(), 5u);
}

TEST(AllocationCounter, TellsThreadsApart) {
    if (!AllocationCounter::kCounts) GTEST_SKIP() << "this sanitizer has operators new of its own";
    const AllocationCounter here(AllocationCounter::Of::this_thread);
    const AllocationCounter everywhere(AllocationCounter::Of::all_threads);
    std::thread other([] { std::make_shared<int>(3).reset(); });
    other.join();
    const std::uint64_t of_this_thread = here.count();  // starting a thread allocates
    EXPECT_GT(everywhere.count(), of_this_thread);
}

std::shared_ptr<const HeightSource> ground() {
    return FractalHeights::create({.seed = 5,
                                   .octave_count = 8,
                                   .amplitude = 150.0,
                                   .wavelength_log2 = 10,
                                   .root_size_log2 = 11})
        .value();
}

View view_at(int frame) {
    const WorldPos eye(-900.0 + 6.0 * frame, -500.0 + 3.0 * frame, 250.0);
    const Eigen::Vector3d displacement(300.0, 100.0 - 2.0 * frame, -60.0);
    return look_at(eye, eye + displacement, 1.0, 1280, 720).value();
}

// Allocations inside update() over a flight, except in the first frame.
std::uint64_t count_in_updates(
    Triangulator& triangulator,
    const std::function<std::shared_ptr<const ResidentSet>(int frame, double threshold_px)>&
        resident_at) {
    std::uint64_t count = 0;
    double threshold_px = 1.0;
    for (int frame = 0; frame < kFrames; ++frame) {
        const std::shared_ptr<const ResidentSet> resident = resident_at(frame, threshold_px);
        const View view = view_at(frame);
        const AllocationCounter counter;
        threshold_px = triangulator.update(resident, view).threshold_px;
        if (frame > 0) count += counter.count();
    }
    return count;
}

TEST(Allocation, NeverHappensInUpdateOverAFixedSet) {
    const auto source = ground();
    for (const double max_error_px : {1.0, 0.05}) {
        Pager pager = Pager::create(source, {.worker_count = 0}).value();
        const CameraNeed camera{.view = view_at(kFrames / 2), .threshold_px = 2.0};
        pager.update({&camera, 1}, {}, 0.0);
        pager.finish();
        const auto resident = pager.resident();
        ASSERT_GT(resident->chunks().size(), 20u);
        Triangulator triangulator =
            Triangulator::create(*source, {.triangle_budget = 50'000, .max_error_px = max_error_px})
                .value();
        EXPECT_EQ(count_in_updates(triangulator, [&](int, double) { return resident; }), 0u);
    }
}

TEST(Allocation, NeverHappensInUpdateWhileChunksComeAndGo) {
    const auto source = ground();
    Pager pager =
        Pager::create(source,
                      {.memory_bytes = std::size_t{12} << 20, .worker_count = 0, .horizon = 1.0})
            .value();
    Triangulator triangulator =
        Triangulator::create(*source, {.triangle_budget = 50'000, .max_error_px = 0.5}).value();
    const std::uint64_t count = count_in_updates(triangulator, [&](int frame, double threshold_px) {
        const CameraNeed camera{
            .view = view_at(frame), .velocity = {360.0, 180.0, 0.0}, .threshold_px = threshold_px};
        pager.update({&camera, 1}, {}, frame / 60.0);
        return pager.resident();
    });
    EXPECT_GT(pager.stats().loaded, 60u);
    EXPECT_GT(pager.stats().evicted, 10u);
    EXPECT_EQ(count, 0u);
}

}  // namespace terrane::allocation_test

// ContactNeeds::find() allocates only if it needs more memory than before: bodies on a closed path cause no allocation
// after the first round.

namespace terrane::internal::contact_needs_allocation_test {

TEST(Allocation, NeverHappensInContactNeedsOnARepeatedTrajectory) {
    constexpr std::uint64_t kSeed = 3;
    constexpr int kFramesARound = 120, kRounds = 4;
    test::Random random(kSeed);
    const test::WaveHeights source(test::small_world(6, 1.0), 10.0, 700.0);
    std::vector<BodyNeed> bodies(100);
    for (BodyNeed& body : bodies) {
        body.centre_world = {random.between(-3e3, 3e3), random.between(-3e3, 3e3), 5.0};
        body.velocity = {random.between(-200.0, 200.0), random.between(-200.0, 200.0), 0.0};
    }
    const RegionNeed region{{100.0, 100.0, 900.0, 900.0}, 3.0};
    ContactNeeds needs(source, source.lattice().finest_level);
    std::uint64_t count = 0;
    for (int frame = 0; frame < kRounds * kFramesARound; ++frame) {
        if (frame % (kFramesARound / 2) == 0) {
            for (BodyNeed& body : bodies) body.velocity = -body.velocity;
        }
        for (BodyNeed& body : bodies) body.centre_world += body.velocity / 60.0;
        const test::AllocationCounter counter;
        needs.find(bodies, {&region, 1}, frame / 60.0, 4.0);
        if (frame >= kFramesARound) count += counter.count();
        ASSERT_GT(needs.entries().size(), 500u);
    }
    EXPECT_EQ(count, 0u) << "seed " << kSeed;
}

}  // namespace terrane::internal::contact_needs_allocation_test

// Ground::surface() and copies of a Ground allocate nothing, with or without a surface map.

namespace terrane::surface_allocation_test {

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

}  // namespace terrane::surface_allocation_test

// Queries of an existing GroundBatch allocate nothing.

namespace terrane::batch_allocation_test {

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
        HeightArrays heights{.heights = numbers};
        RayArrays rays{.fractions = numbers};
        const PointArray places = PointArray::interleaved_xyz(points);
        const WorldPos from(100.0, 100.0, 30.0);
        const test::AllocationCounter counter;
        ASSERT_TRUE(batch.heights(ground, places, heights));
        ASSERT_TRUE(batch.rays(ground, PointArray::repeated(from, kCount), places, rays));
        EXPECT_EQ(counter.count(), 0u);
    }
}

}  // namespace terrane::batch_allocation_test
