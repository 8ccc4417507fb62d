// SPDX-License-Identifier: MIT
//
// Fades. With fade f a vertex of screen error p counts as f p. Up to the threshold t it is not displaced at
// all, and above it by the share F (1 - (t / (f p))^2) of its rise, at most 1, with F = w^2 / (w^2 - 1) for the
// morph ratio w. The derivative of that share by 1 / f is at most 2 F t / p, so the vertex moves by at most
// 2 F t d pixels when 1 / f changes by d, whatever p and f are: 1 / f is what changes evenly, and t / f is the
// screen error that is still held back.
#include "paging/fades.h"

#include "paging/demand/predicted_view.h"

#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// A relative step of a priority at the threshold moves a vertex by so many thresholds: see lod/morph.h.
constexpr double kMorphGain =
    2.0 * kDefaultMorphRatio * kDefaultMorphRatio / (kDefaultMorphRatio * kDefaultMorphRatio - 1.0);
// What fading may move in one update while little is held back.
constexpr double kMostMove_px = 0.25;
// No frame promises anything while more than 1.5 pixels are held back: its error is larger. So nothing
// but this much ever is: what comes late would only stay away for longer.
constexpr double kMostHeld_px = 1.55;
// Movements of points closer than this many ways of the eye do not count.
constexpr double kNearWays = 10.0;

// False where the box lies beside one of the side planes.
bool may_hold(const Frustum& frustum, const WorldPos& eye, const Box& box) {
    for (const Eigen::Vector3d& normal : frustum.normals) {
        // the corner that lies furthest in
        const Eigen::Vector3d corner(normal.x() > 0.0 ? box.high.x() : box.low.x(),
                                     normal.y() > 0.0 ? box.high.y() : box.low.y(),
                                     normal.z() > 0.0 ? box.high.z() : box.low.z());
        if (normal.dot(corner - eye) < 0.0) return false;
    }
    return true;
}

// Bound over distance, at most, of the vertices of a chunk: the distance is to a box around the vertex
// that holds its descendants.
double largest_angle(const Lattice& lattice, const Chunk& chunk, const View& view) {
    // half the width of the box: s + s / 2 + s / 2 + s / 4 + ... for a spacing of s
    const double across = 3.0 * lattice.level_spacing(chunk.key.level);
    const std::int64_t side = kAreaCells * chunk.step;
    double largest = 0.0;
    for (int i = 0; i < kChunkAreas * kChunkAreas; ++i) {
        const Chunk::Area& area = chunk.areas[static_cast<std::size_t>(i)];
        const std::int64_t west = chunk.corner.x + i % kChunkAreas * side;
        const std::int64_t south = chunk.corner.y + i / kChunkAreas * side;
        const HeightInterval reach = chunk.reach_of_area(i);
        const Box box{
            {lattice.x(west) - across, lattice.y(south) - across, reach.low},
            {lattice.x(west + side) + across, lattice.y(south + side) + across, reach.high}};
        const double distance =
            std::max(view.near_distance, std::sqrt(square_distance(box, view.eye_world)));
        largest = std::max(largest, static_cast<double>(area.max_vertex_bound) / distance);
    }
    return largest;
}

}  // namespace

Watch watch(const Lattice& lattice, const Chunk& chunk, std::span<const Watcher> watchers,
            double inverse_fade) {
    // a vertex moves the surface up to a cell around it
    const double margin = lattice.level_spacing(chunk.key.level);
    const auto bound = static_cast<double>(chunk.max_vertex_bound);
    const LatticePoint corner = chunk.corner;
    const std::int64_t side = lattice.chunk_side(chunk.key.level);
    const Box box{{lattice.x(corner.x) - margin, lattice.y(corner.y) - margin,
                   lattice.quantum * chunk.low - bound},
                  {lattice.x(corner.x + side) + margin, lattice.y(corner.y + side) + margin,
                   lattice.quantum * chunk.high + bound}};
    Watch seen;
    double going = std::numeric_limits<double>::infinity();
    for (const Watcher& watcher : watchers) {
        const View& view = watcher.view;
        if (!watcher.before) continue;
        const double way = (view.eye_world - watcher.before->eye_world).norm();
        if (farthest_from(box, view.eye_world) < kNearWays * way) continue;
        if (!may_hold(watcher.frustum, view.eye_world, box) ||
            !may_hold(watcher.before->frustum, watcher.before->eye_world, box)) {
            continue;
        }
        constexpr double kWider = 1.001;  // for the rounding of those who draw
        const double error_px =
            kWider * view.pixels_per_radian() * largest_angle(lattice, chunk, view);
        const double step = kMostMove_px / (kMorphGain * watcher.threshold_px);
        const double ratio = std::min(error_px, kMostHeld_px) / watcher.threshold_px;
        seen.ratio = std::max(seen.ratio, ratio);
        seen.coming = std::max(seen.coming, std::min(inverse_fade, ratio) - step);
        if (inverse_fade + step < ratio) going = std::min(going, inverse_fade + step);
    }
    seen.going = std::max(inverse_fade, std::min(going, seen.ratio));
    return seen;
}

double faded_on(const Watch& seen, bool is_new, bool is_leaving) {
    if (is_new) return std::max(1.0, seen.ratio);
    return is_leaving ? seen.going : seen.coming;
}

float fade_of(double inverse_fade) {
    const auto fade = static_cast<float>(1.0 / inverse_fade);
    return static_cast<double>(fade) * inverse_fade > 1.0 ? std::nextafter(fade, 0.0f) : fade;
}

}  // namespace terrane::internal
