// SPDX-License-Identifier: MIT
// update() does not allocate in any frame of a flight.
#include "support/allocation_counter.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <thread>
#include <vector>

namespace terrane {
namespace allocation_test {

using test::AllocationCounter;

constexpr int kFrames = 200;

TEST(AllocationCounter, CountsEveryFormOfNew) {
    if (!AllocationCounter::kCounts) GTEST_SKIP() << "this sanitizer has operators new of its own";
    const AllocationCounter counter;
    // stored so that the compiler cannot remove the allocations
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

// Allocations inside update() over a flight, without the first frame.
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

}  // namespace allocation_test
}  // namespace terrane
