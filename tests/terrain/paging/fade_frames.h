// SPDX-License-Identifier: MIT
#pragma once

#include "pager_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <utility>
#include <vector>

// Measures the visible effect of fades: the displacement of the picture between consecutive resident sets.
namespace terrane::test {

using Set = std::shared_ptr<const ResidentSet>;

/// Limits stated in pager.h.
inline constexpr double kMorphGain = 2.0 * 1.3 * 1.3 / (1.3 * 1.3 - 1.0);
static_assert(kDefaultMorphRatio == 1.3);
inline constexpr double kMostMove_px = 0.25;
inline constexpr double kPromised_px = 1.5;
inline constexpr double kMostHeld_px = 1.55;  // of late chunks
inline constexpr double kSlack = 1.0 + 1e-5;  // fades are single precision

inline std::shared_ptr<WaveHeights> hills(double wavelength = 700.0) {
    return std::make_shared<WaveHeights>(small_world(4, 1.0), 200.0, wavelength);
}

inline std::map<ChunkKey, float> fades_of(const ResidentSet& set) {
    std::map<ChunkKey, float> fades;
    for (std::size_t i = 0; i < set.chunks().size(); ++i) {
        fades[set.chunks()[i]->key] = set.fade(i);
    }
    return fades;
}

inline float least_fade(const ResidentSet& set) {
    return *std::min_element(set.fades().begin(), set.fades().end());
}

inline bool is_in_view(const Frustum& frustum, const View& view, const Eigen::Vector3d& point) {
    return std::all_of(
        frustum.normals.begin(), frustum.normals.end(),
        [&](const Eigen::Vector3d& normal) { return normal.dot(point - view.eye_world) >= 0.0; });
}

/// Largest screen error, pixels, of the vertices of the areas of a chunk whose middles both views contain,
/// at least ten times the displacement of the eye away. Measured to the area, not to the boxes around
/// vertices: less than the pager's bound.
inline double seen_px(const Lattice& lattice, const Chunk& chunk, const View& before,
                      const View& now) {
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

/// The visible changes between the sets of two frames.
struct Change {
    int jump_count = 0;    // chunks that move the picture by more than the limit
    double most_px = 0.0;  // largest movement by chunks within the limit of held-back error
    int coming_count = 0;  // chunks that fade in, arrive, fade out, are evicted
    int arrival_count = 0;
    int leaving_count = 0;
    int eviction_count = 0;
};

inline Change compare(const Set& before, const View& view_before, const Set& now,
                      const CameraNeed& camera) {
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
    Change change;
    for (const auto& [key, chunk] : chunks) {
        if (key.level == 0) continue;
        const double from = inverse_fade(*before, key);
        const double to = inverse_fade(*now, key);
        if (from == to) continue;
        change.coming_count += to < from && std::isfinite(from) ? 1 : 0;
        change.arrival_count += to < from && std::isinf(from) ? 1 : 0;
        change.leaving_count += to > from && std::isfinite(to) ? 1 : 0;
        change.eviction_count += std::isinf(to) ? 1 : 0;
        // a smaller fade than the one that hides it completely has no further effect
        const double hidden =
            std::max(1.0, seen_px(lattice, *chunk, view_before, camera.view) / camera.threshold_px);
        const double first = std::min(from, hidden);
        const double last = std::min(to, hidden);
        const double moved_px = kMorphGain * camera.threshold_px * std::abs(last - first);
        const double held_px = camera.threshold_px * std::max(first, last);
        // beyond the limit of held-back error chunks may change at once
        if (held_px > kPromised_px) continue;
        change.most_px = std::max(change.most_px, moved_px);
        change.jump_count += moved_px > kMostMove_px * kSlack ? 1 : 0;
    }
    return change;
}

struct Flight {
    int jump_count = 0;
    double most_px = 0.0;
    int coming_count = 0, arrival_count = 0, leaving_count = 0, eviction_count = 0;
    int fading_frames = 0;
};

/// Runs the frames after the first and adds up the changes.
template <typename CameraOfFrame>
Flight fly(Pager& pager, int frame_count, CameraOfFrame camera_of_frame, double begin_s = 0.0) {
    Flight flight;
    Set before;
    View view_before;
    for (int frame = 0; frame < frame_count; ++frame) {
        const CameraNeed camera = camera_of_frame(frame);
        pager.update(std::vector<CameraNeed>{camera}, {}, begin_s + frame / 60.0);
        Set now = pager.resident();
        if (frame > 0) {
            const Change change = compare(before, view_before, now, camera);
            flight.jump_count += change.jump_count;
            flight.most_px = std::max(flight.most_px, change.most_px);
            flight.coming_count += change.coming_count;
            flight.arrival_count += change.arrival_count;
            flight.leaving_count += change.leaving_count;
            flight.eviction_count += change.eviction_count;
            flight.fading_frames += pager.stats().fading_chunks > 0 ? 1 : 0;
        }
        before = std::move(now);
        view_before = camera.view;
    }
    return flight;
}

/// A pager with only the roots resident and a camera that is not new: all other chunks arrive late.
inline Pager make_late(const std::shared_ptr<WaveHeights>& source,
                       const std::vector<CameraNeed>& cameras) {
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    pager.update({}, {}, 0.0);
    source->is_broken = true;
    pager.update(cameras, {}, 0.01);
    source->is_broken = false;
    pager.update(cameras, {}, 100.0);
    return pager;
}

}  // namespace terrane::test
