// SPDX-License-Identifier: MIT
#include "pager_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <utility>
#include <vector>

// The visible effect of fades: how far the picture moves between consecutive resident sets.

namespace terrane::fade_test {

using namespace test;

using Set = std::shared_ptr<const ResidentSet>;

/// Limits promised in pager.h.
constexpr double kMorphGain = 2.0 * 1.3 * 1.3 / (1.3 * 1.3 - 1.0);
static_assert(kDefaultMorphRatio == 1.3);
constexpr double kMostMove_px = 0.25;
constexpr double kPromised_px = 1.5;
constexpr double kMostHeld_px = 1.55;  // for late chunks
constexpr double kSlack = 1.0 + 1e-5;  // fades have single precision

std::shared_ptr<WaveHeights> hills(double wavelength = 700.0) {
    return std::make_shared<WaveHeights>(small_world(4, 1.0), 200.0, wavelength);
}

std::map<ChunkKey, float> fades_of(const ResidentSet& set) {
    std::map<ChunkKey, float> fades;
    for (std::size_t i = 0; i < set.chunks().size(); ++i) {
        fades[set.chunks()[i]->key] = set.fade(i);
    }
    return fades;
}

float least_fade(const ResidentSet& set) {
    return *std::min_element(set.fades().begin(), set.fades().end());
}

bool is_in_view(const Frustum& frustum, const View& view, const Eigen::Vector3d& point) {
    return std::all_of(
        frustum.normals.begin(), frustum.normals.end(),
        [&](const Eigen::Vector3d& normal) { return normal.dot(point - view.eye_world) >= 0.0; });
}

/// Largest screen error, pixels, over the vertices of those areas of a chunk whose centres are in both views and at
/// least ten times as far away as the eye moves. Distances are measured to the areas, not to the boxes around vertices,
/// so the result is below the pager's bound.
double seen_px(const Lattice& lattice, const Chunk& chunk, const View& before, const View& now) {
    const Frustum frustum_before = make_frustum(before);
    const Frustum frustum_now = make_frustum(now);
    const double displacement = (now.eye_world - before.eye_world).norm();
    double largest = 0.0;
    for (int i = 0; i < kChunkAreas * kChunkAreas; ++i) {
        const Chunk::Area& area = chunk.areas[static_cast<std::size_t>(i)];
        const std::int64_t side = kAreaCells * chunk.step;
        const std::int64_t west = chunk.corner.x + i % kChunkAreas * side;
        const std::int64_t south = chunk.corner.y + i / kChunkAreas * side;
        const Eigen::Vector3d low(lattice.x(west), lattice.y(south), lattice.quantum * area.low);
        const Eigen::Vector3d high(lattice.x(west + side), lattice.y(south + side),
                                   lattice.quantum * area.high);
        const Eigen::Vector3d middle = 0.5 * (low + high);
        if (!is_in_view(frustum_before, before, middle) || !is_in_view(frustum_now, now, middle))
            continue;
        if ((middle - now.eye_world).norm() < 10.0 * displacement) continue;
        const Eigen::Vector3d apart =
            (low - now.eye_world).cwiseMax(now.eye_world - high).cwiseMax(Eigen::Vector3d::Zero());
        largest =
            std::max(largest, static_cast<double>(area.max_vertex_bound) * now.pixels_per_radian() /
                                  std::max(now.near_distance, apart.norm()));
    }
    return largest;
}

/// The visible changes between the sets of two or more frames.
struct Change {
    int jump_count = 0;    // chunks that change by more than the limit
    double most_px = 0.0;  // largest change within the limit of held-back error
    int coming_count = 0;  // chunks that fade in, arrive, fade out, or are evicted
    int arrival_count = 0;
    int leaving_count = 0;
    int eviction_count = 0;
};

/// The changes between two sets, added to previous ones.
Change compare(const Set& before, const View& view_before, const Set& now, const CameraNeed& camera,
               Change change = {}) {
    const Lattice& lattice = now->lattice();
    std::map<ChunkKey, std::shared_ptr<const Chunk>> chunks;
    for (const Set& set : {before, now}) {
        for (const auto& chunk : set->chunks()) chunks[chunk->key] = chunk;
    }
    const auto inverse_fade = [](const ResidentSet& set, const ChunkKey& key) {
        const std::int32_t at = set.find(key);
        if (at == ResidentSet::kNone) return std::numeric_limits<double>::infinity();
        return 1.0 / static_cast<double>(set.fade(static_cast<std::size_t>(at)));
    };
    for (const auto& [key, chunk] : chunks) {
        if (key.level == 0) continue;
        const double from = inverse_fade(*before, key);
        const double to = inverse_fade(*now, key);
        if (from == to) continue;
        change.coming_count += to < from && std::isfinite(from) ? 1 : 0;
        change.arrival_count += to < from && std::isinf(from) ? 1 : 0;
        change.leaving_count += to > from && std::isfinite(to) ? 1 : 0;
        change.eviction_count += std::isinf(to) ? 1 : 0;
        // fades below the one that hides the chunk completely have no further effect
        const double hidden =
            std::max(1.0, seen_px(lattice, *chunk, view_before, camera.view) / camera.threshold_px);
        const double first = std::min(from, hidden);
        const double last = std::min(to, hidden);
        const double moved_px = kMorphGain * camera.threshold_px * std::abs(last - first);
        const double held_px = camera.threshold_px * std::max(first, last);
        // chunks above the limit of held-back error may change at once
        if (held_px > kPromised_px) continue;
        change.most_px = std::max(change.most_px, moved_px);
        change.jump_count += moved_px > kMostMove_px * kSlack ? 1 : 0;
    }
    return change;
}

/// Runs frames and adds up the changes after the first.
template <typename CameraOfFrame>
Change fly(Pager& pager, int frame_count, CameraOfFrame camera_of_frame) {
    Change changes;
    Set before;
    View view_before;
    for (int frame = 0; frame < frame_count; ++frame) {
        const CameraNeed camera = camera_of_frame(frame);
        pager.update({camera}, {}, frame / 60.0);
        Set now = pager.resident();
        if (frame > 0) changes = compare(before, view_before, now, camera, changes);
        before = std::move(now);
        view_before = camera.view;
    }
    return changes;
}

/// A pager with only the roots resident and a camera that is already known, so that all other chunks arrive late.
Pager make_late(const std::shared_ptr<WaveHeights>& source,
                const std::vector<CameraNeed>& cameras) {
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    pager.update({}, {}, 0.0);
    source->is_broken = true;
    pager.update(cameras, {}, 0.01);
    source->is_broken = false;
    pager.update(cameras, {}, 100.0);
    return pager;
}

// Chunks that arrive in view fade in; all others appear at once.

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

// At a threshold of 1.55 pixels no chunk with a larger error is held back.
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

TEST(Fade, IsOneInTheFirstUpdateAndAtOnceAfterATeleport) {
    const CameraNeed here = camera_at({-1000, -1000, 250}, {-600, -700, 0}, 0.5);
    const CameraNeed there = camera_at({0, 0, 300}, {500, 300, 0}, 0.5);
    Pager pager = Pager::create(hills(), {.worker_count = 0, .horizon = 0.0}).value();
    pager.update({here}, {}, 0.0);
    EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
    EXPECT_EQ(pager.stats().fading_chunks, 0u);
    for (int i = 1; i < 3; ++i) pager.update({here}, {}, 0.1 * i);
    const std::size_t count = pager.resident()->chunks().size();
    EXPECT_GT(count, 20u);
    pager.update({there}, {}, 0.3);
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
    const auto look = [&](double x) { return camera_at(eye, eye + WorldPos(x, 0, -0.3), 0.3); };
    Pager pager = Pager::create(hills(), {.worker_count = 0}).value();
    for (int i = 0; i < 3; ++i) pager.update({look(1)}, {}, 0.1 * i);
    const std::size_t count = pager.resident()->chunks().size();
    pager.update({look(-1)}, {}, 0.3);
    EXPECT_GT(pager.resident()->chunks().size(), count + 5);
    EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
}

TEST(Fade, HidesChunksThatATurningCameraWouldSeeAppear) {
    Pager pager = Pager::create(hills(), {.worker_count = 0}).value();
    const WorldPos eye(0, 0, 150);
    const Change flight = fly(pager, 120, [&](int frame) {
        const double angle = 1.5707963 / 60.0 * frame;  // 90 degrees per second
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

// Chunks in view fade out before they are evicted at the memory ceiling.

TEST(Fade, LeavesNoJumpInAFlightAtTheMemoryCeiling) {
    const std::size_t ceiling = 60 * Chunk::max_bytes();
    const auto source = hills(250.0);
    Pager pager = Pager::create(source, {.memory_bytes = ceiling, .worker_count = 0}).value();
    // the camera looks backwards, so that evicted chunks are in view; the loader fails now and then
    const Change flight = fly(pager, 300, [&](int frame) {
        source->is_broken = frame % 100 > 70;
        const WorldPos eye(200.0 + 1.5 * frame, 100.0, 120.0);
        return camera_at(eye, eye + WorldPos(-100, 20, -20), 0.2);
    });
    EXPECT_EQ(flight.jump_count, 0);
    EXPECT_LE(flight.most_px, kMostMove_px * kSlack);
    EXPECT_GT(flight.arrival_count, 10);
    EXPECT_GT(flight.eviction_count, 10);
    EXPECT_GT(flight.leaving_count, 10);
    EXPECT_GT(flight.coming_count, 10);
    const PagerStats stats = pager.stats();
    EXPECT_EQ(stats.hard_evictions, 0u);
    EXPECT_GT(stats.over_ceiling, 0u);
    EXPECT_LE(stats.peak_bytes, ceiling);
}

// One camera fills the memory; a second one takes some of it and is removed again.
TEST(Fade, RisesAgainForAVictimThatIsNeededAgain) {
    const CameraNeed first = camera_at({0, 0, 300}, {500, 300, 0}, 0.2);
    const CameraNeed second = camera_at({-900, -900, 60}, {-500, -700, 0}, 0.1);
    Pager pager =
        Pager::create(hills(250.0), {.memory_bytes = 60 * Chunk::max_bytes(), .worker_count = 0})
            .value();
    double time_s = 0.0;
    const auto update = [&](const std::vector<CameraNeed>& cameras) {
        pager.update(cameras, {}, time_s += 0.01);
    };
    for (int i = 0; i < 3; ++i) update({first});
    ASSERT_EQ(pager.stats().fading_chunks, 0u);
    const std::size_t evicted = pager.stats().evicted;
    for (int i = 0; i < 3; ++i) update({first, second});
    const auto fades = fades_of(*pager.resident());
    ASSERT_GT(pager.stats().fading_chunks, 0u);
    update({first});
    std::size_t fading_count = 0;
    for (const auto& [key, fade] : fades_of(*pager.resident())) {
        const auto found = fades.find(key);
        if (found == fades.end()) continue;
        EXPECT_GE(fade, found->second);
        fading_count += fade < 1.0f ? 1u : 0u;
    }
    EXPECT_GT(fading_count, 0u) << "came back at once";
    for (int i = 0; i < 100; ++i) update({first});
    EXPECT_EQ(pager.stats().fading_chunks, 0u);
    EXPECT_LT(pager.stats().evicted - evicted, 60u);
}

// If the victims changed every time, none would ever be evicted.
TEST(Fade, ContinuesWithTheSameVictims) {
    Pager pager =
        Pager::create(hills(250.0), {.memory_bytes = 150 * Chunk::max_bytes(), .worker_count = 0})
            .value();
    std::map<ChunkKey, float> before;
    std::map<ChunkKey, bool> is_falling;
    int fall_count = 0;
    int return_count = 0;
    for (int frame = 0; frame < 300; ++frame) {
        const WorldPos eye(200.0 + 1.5 * frame, 100.0, 120.0);
        pager.update({camera_at(eye, eye + WorldPos(-100, 20, -40), 0.2)}, {}, frame / 60.0);
        std::map<ChunkKey, float> now = fades_of(*pager.resident());
        for (const auto& [key, fade] : now) {
            const auto found = before.find(key);
            if (found == before.end() || fade == found->second) continue;
            const bool falls = fade < found->second;
            fall_count += falls ? 1 : 0;
            return_count += !falls && is_falling[key] ? 1 : 0;
            is_falling[key] = falls;
        }
        before = std::move(now);
    }
    EXPECT_GT(fall_count, 100);
    EXPECT_LE(return_count, 2);
}

TEST(Fade, TakesAtMostSixteenChunksOutAtATime) {
    const CameraNeed first = camera_at({0, 0, 300}, {500, 300, 0}, 0.1);
    const CameraNeed second = camera_at({-900, -900, 60}, {-500, -700, 0}, 0.1);
    Pager pager =
        Pager::create(hills(250.0), {.memory_bytes = 150 * Chunk::max_bytes(), .worker_count = 0})
            .value();
    for (int i = 0; i < 3; ++i) pager.update({first}, {}, 0.01 * i);
    for (int i = 0; i < 3; ++i) {
        pager.update({first, second}, {}, 0.03 + 0.01 * i);
        EXPECT_EQ(pager.stats().fading_chunks, 16u);
    }
}

TEST(Fade, IsSkippedForGroundAndCounted) {
    const std::size_t ceiling = 60 * Chunk::max_bytes();
    Pager pager = Pager::create(hills(), {.memory_bytes = ceiling, .worker_count = 0}).value();
    const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0}, 0.05)};
    for (int i = 0; i < 3; ++i) pager.update(cameras, {}, 0.01 * i);
    EXPECT_EQ(pager.stats().hard_evictions, 0u);
    RequiredRegion required = pager.require({-900, -900, -400, -400}, 0.0);
    pager.update(cameras, {}, 0.03);
    EXPECT_TRUE(required.is_ready());
    EXPECT_GT(pager.stats().hard_evictions, 0u);
    EXPECT_LE(pager.stats().peak_bytes, ceiling);
}

// finish() does not wait for fades.
TEST(Fade, DoesNotDelayEvictionsOfFinish) {
    const std::size_t ceiling = 60 * Chunk::max_bytes();
    Pager pager = Pager::create(hills(250.0), {.memory_bytes = ceiling, .worker_count = 0}).value();
    const CameraNeed first = camera_at({0, 0, 300}, {500, 300, 0}, 0.2);
    const CameraNeed second = camera_at({-900, -900, 60}, {-500, -700, 0}, 0.1);
    for (int i = 0; i < 3; ++i) pager.update({first}, {}, 0.01 * i);
    pager.update({first, second}, {}, 0.03);
    const std::uint64_t loaded = pager.stats().loaded;
    pager.update({first, second}, {}, 0.04);
    EXPECT_EQ(pager.stats().loaded, loaded) << "no load waits for a fade";
    pager.finish();
    EXPECT_GT(pager.stats().loaded, loaded);
    EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
    EXPECT_EQ(pager.stats().hard_evictions, 0u);
    EXPECT_LE(pager.stats().peak_bytes, ceiling);
}

// A set that is held for two frames, as by a triangulator, keeps evicted bytes alive.
TEST(Fade, EvictsNoMoreWhileBytesAreAboutToBeReleased) {
    // sized so that the memory is full: chunks of hills, which have no flags, and one chunk of maximal size
    const std::size_t each = make_chunk(*hills(), {0, 0, 1}).value()->bytes();
    const std::size_t ceiling = 56 * each + Chunk::max_bytes();
    Pager pager = Pager::create(hills(), {.memory_bytes = ceiling, .worker_count = 0}).value();
    const CameraNeed here = camera_at({0, 0, 300}, {500, 300, 0}, 0.2);
    for (int i = 0; i < 3; ++i) pager.update({here}, {}, 0.01 * i);
    const Set held = pager.resident();
    const std::size_t count = held->chunks().size();
    const std::uint64_t evicted = pager.stats().evicted;
    RequiredRegion required = pager.require({-900, -900, -899, -899}, 0.0);
    for (int i = 0; i < 3; ++i) pager.update({here}, {}, 0.1 + 0.01 * i);
    EXPECT_FALSE(required.is_ready());
    EXPECT_LE(pager.stats().evicted - evicted, 4u);
    EXPECT_GE(pager.resident()->chunks().size(), count - 4);
    EXPECT_LE(pager.stats().peak_bytes, ceiling);
}

}  // namespace terrane::fade_test
