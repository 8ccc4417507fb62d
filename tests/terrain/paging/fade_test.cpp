// SPDX-License-Identifier: MIT
// Chunks that arrive in view fade in; others appear at once.
#include "fade_frames.h"

#include <gtest/gtest.h>

namespace terrane {
namespace fade_test {

using namespace test;

TEST(Fade, IsOneInTheFirstUpdate) {
    Pager pager = Pager::create(hills(), {.worker_count = 0}).value();
    pager.update(std::vector<CameraNeed>{camera_at({0, 0, 300}, {500, 300, 0}, 0.5)}, {}, 0.0);
    EXPECT_GT(pager.resident()->chunks().size(), 20u);
    EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
    EXPECT_EQ(pager.stats().fading_chunks, 0u);
}

TEST(Fade, HidesChunksThatArriveInView) {
    for (const double threshold_px : {0.1, 0.5, 1.2}) {
        const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0}, threshold_px)};
        Pager pager = make_late(hills(), cameras);
        const Set set = pager.resident();
        std::size_t fading_count = 0;
        double closest = 0.0;
        for (std::size_t i = 0; i < set->chunks().size(); ++i) {
            const Chunk& chunk = *set->chunks()[i];
            if (chunk.key.level == 0) continue;
            const double px = std::min(
                kMostHeld_px, seen_px(set->lattice(), chunk, cameras[0].view, cameras[0].view));
            const auto fade = static_cast<double>(set->fade(i));
            EXPECT_LE(fade * px, threshold_px);
            if (fade < 1.0) closest = std::max(closest, fade * px / threshold_px);
            fading_count += fade < 1.0 ? 1u : 0u;
        }
        EXPECT_GT(fading_count, 0u);
        EXPECT_EQ(pager.stats().fading_chunks, fading_count);
        EXPECT_GT(closest, 0.5) << "held back by more than twice what hides it";
    }
}

// At a threshold of 1.55 pixels nothing above it is held back.
TEST(Fade, IsOneWhereTheErrorExceedsWhatFadesHoldBack) {
    Pager pager = make_late(hills(), {camera_at({0, 0, 300}, {500, 300, 0}, 3.0)});
    EXPECT_GT(pager.resident()->chunks().size(), 4u);
    EXPECT_EQ(pager.stats().fading_chunks, 0u);
}

TEST(Fade, RisesToOneInABoundedNumberOfUpdates) {
    for (const double threshold_px : {0.2, 0.5, 1.2}) {
        const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0}, threshold_px)};
        Pager pager = make_late(hills(), cameras);
        Set before = pager.resident();
        const double held_px = threshold_px / static_cast<double>(least_fade(*before));
        EXPECT_LE(held_px, kMostHeld_px * kSlack);
        const int most =
            static_cast<int>((held_px - threshold_px) / (kMostMove_px / kMorphGain)) + 2;
        int updates = 0;
        while (pager.stats().fading_chunks > 0) {
            ASSERT_LE(++updates, most) << "threshold " << threshold_px << ", held " << held_px;
            pager.update(cameras, {}, 100.0 + updates);
            const Set now = pager.resident();
            ASSERT_TRUE(now->has_same_chunks(*before));
            ASSERT_GT(now->epoch(), before->epoch());
            for (std::size_t i = 0; i < now->chunks().size(); ++i) {
                ASSERT_GE(now->fade(i), before->fade(i));
                ASSERT_LE(now->fade(i), 1.0f);
            }
            ASSERT_EQ(compare(before, cameras[0].view, now, cameras[0]).jump_count, 0);
            before = now;
        }
        RecordProperty("updates_at_" + std::to_string(threshold_px), updates);
        EXPECT_GT(updates, 3);
        EXPECT_EQ(least_fade(*before), 1.0f);
        for (int i = 0; i < 5; ++i) {
            pager.update(cameras, {}, 200.0 + i);
            EXPECT_EQ(pager.resident(), before) << "a new set though nothing changed";
        }
    }
}

TEST(Fade, LeavesNoJumpForAnyOfTwoCameras) {
    const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0}, 1.0),
                                          camera_at({10, 0, 300}, {500, 300, 0}, 0.2)};
    Pager pager = make_late(hills(), cameras);
    Set before = pager.resident();
    for (int updates = 0; pager.stats().fading_chunks > 0; ++updates) {
        ASSERT_LT(updates, 200);
        pager.update(cameras, {}, 101.0 + updates);
        const Set now = pager.resident();
        for (const CameraNeed& camera : cameras) {
            ASSERT_EQ(compare(before, camera.view, now, camera).jump_count, 0);
        }
        before = now;
    }
}

TEST(Fade, IsOneAtOnceAfterATeleport) {
    const std::vector<CameraNeed> here{camera_at({-1000, -1000, 250}, {-600, -700, 0}, 0.5)};
    const std::vector<CameraNeed> there{camera_at({0, 0, 300}, {500, 300, 0}, 0.5)};
    Pager pager = Pager::create(hills(), {.worker_count = 0, .horizon = 0.0}).value();
    for (int i = 0; i < 3; ++i) pager.update(here, {}, 0.1 * i);
    const std::size_t count = pager.resident()->chunks().size();
    pager.update(there, {}, 0.3);
    EXPECT_GT(pager.resident()->chunks().size(), count + 10);
    EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
}

TEST(Fade, IsOneAtOnceForANewCamera) {
    const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0}, 0.5)};
    std::vector<CameraNeed> refused = cameras;
    refused[0].view.near_distance = 0.0;
    for (const std::vector<CameraNeed>& gap : {std::vector<CameraNeed>{}, refused}) {
        const auto source = hills();
        Pager pager = Pager::create(source, {.worker_count = 0}).value();
        source->is_broken = true;
        pager.update(cameras, {}, 0.0);
        pager.update(gap, {}, 1.0);
        source->is_broken = false;
        pager.update(cameras, {}, 100.0);
        EXPECT_GT(pager.resident()->chunks().size(), 20u);
        EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
    }
}

TEST(Fade, IsOneAtOnceForChunksThatEnterTheView) {
    const WorldPos eye(0, 0, 150);
    const auto look = [&](double x, double y) {
        return std::vector<CameraNeed>{camera_at(eye, eye + WorldPos(x, y, -0.3), 0.3)};
    };
    Pager pager = Pager::create(hills(), {.worker_count = 0}).value();
    for (int i = 0; i < 3; ++i) pager.update(look(1, 0), {}, 0.1 * i);
    const std::size_t count = pager.resident()->chunks().size();
    pager.update(look(-1, 0), {}, 0.3);
    EXPECT_GT(pager.resident()->chunks().size(), count + 5);
    EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
}

TEST(Fade, HidesChunksThatATurningCameraWouldSeeAppear) {
    Pager pager = Pager::create(hills(), {.worker_count = 0}).value();
    const WorldPos eye(0, 0, 150);
    const Flight flight = fly(pager, 120, [&](int frame) {
        const double angle = 1.5707963 / 60.0 * frame;  // 90 degrees a second
        return camera_at(eye, eye + WorldPos(std::cos(angle), std::sin(angle), -0.3), 0.2);
    });
    EXPECT_EQ(flight.jump_count, 0);
    EXPECT_LE(flight.most_px, kMostMove_px * kSlack);
    EXPECT_GT(flight.arrival_count, 10);
}

TEST(Fade, IsOneAfterFinish) {
    const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0}, 0.5)};
    Pager pager = make_late(hills(), cameras);
    const Set before = pager.resident();
    ASSERT_LT(least_fade(*before), 1.0f);
    pager.finish();
    EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
    EXPECT_TRUE(pager.resident()->has_same_chunks(*before));
    EXPECT_EQ(pager.stats().fading_chunks, 0u);
    const Set finished = pager.resident();
    pager.finish();
    EXPECT_EQ(pager.resident(), finished);

    Pager threaded = Pager::create(hills(), {.worker_count = 2}).value();
    for (int i = 0; i < 4; ++i) threaded.update(cameras, {}, 0.01 * i);
    threaded.finish();
    EXPECT_EQ(threaded.stats().late_chunks, 0u);
    EXPECT_EQ(least_fade(*threaded.resident()), 1.0f);
}

}  // namespace fade_test
}  // namespace terrane
