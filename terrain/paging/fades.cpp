// SPDX-License-Identifier: MIT
//
// Fades. With fade f a vertex of screen error p has the priority f p. Up to the threshold t it is not displaced,
// above t by the share F (1 - (t / (f p))^2) of its rise, at most 1, with F = w^2 / (w^2 - 1) for the morph
// ratio w. The derivative of that share by 1 / f is at most 2 F t / p, so the vertex moves by at most 2 F t d
// pixels when 1 / f changes by d, whatever p and f are. Therefore 1 / f changes in even steps; t / f is the
// screen error that is still held back.
#include "paging/fades.h"

#include "chunks/chunk_vertices.h"
#include "paging/demand/predicted_view.h"

#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// Derivative, in thresholds, of a vertex's displacement by the logarithm of its priority, at the threshold: see
// lod/mesh/morph.h.
constexpr double kMorphGain =
    2.0 * kDefaultMorphRatio * kDefaultMorphRatio / (kDefaultMorphRatio * kDefaultMorphRatio - 1.0);
// Largest displacement by fades in one update.
constexpr double kMostMove_px = 0.25;
// Most screen error that a fade holds back. Above 1.5 pixels a frame misses its target anyway: a longer fade would
// only delay a late chunk further.
constexpr double kMostHeld_px = 1.55;
// Points nearer than this many displacements of the eye between two frames move on the screen anyway: fades
// ignore them.
constexpr double kNearDisplacements = 10.0;

// False if the box lies outside one of the side planes.
bool may_hold(const Frustum& frustum, const WorldPos& eye, const WorldBox& box) {
    for (const Eigen::Vector3d& normal : frustum.normals) {
        // the innermost corner
        const Eigen::Vector3d corner(normal.x() > 0.0 ? box.high.x() : box.low.x(),
                                     normal.y() > 0.0 ? box.high.y() : box.low.y(),
                                     normal.z() > 0.0 ? box.high.z() : box.low.z());
        if (normal.dot(corner - eye) < 0.0) return false;
    }
    return true;
}

// Upper bound of bound / distance over the vertices of a chunk, with the distance to a box that encloses the
// vertex and its descendants.
double largest_angle(const Lattice& lattice, const Chunk& chunk, const View& view) {
    // half the width of the box: s + s / 2 + s / 2 + s / 4 + ... for a spacing of s
    const double across = 3.0 * lattice.level_spacing(chunk.key.level);
    const std::int64_t side = kAreaCells * chunk.step;
    double largest = 0.0;
    for (int i = 0; i < kChunkAreas * kChunkAreas; ++i) {
        const Chunk::Area& area = chunk.areas[static_cast<std::size_t>(i)];
        const std::int64_t west = chunk.corner.x + i % kChunkAreas * side;
        const std::int64_t south = chunk.corner.y + i / kChunkAreas * side;
        const HeightInterval reach = chunk.vertices->reach_of_area(i);
        const WorldBox box{
            {lattice.x(west) - across, lattice.y(south) - across, reach.low},
            {lattice.x(west + side) + across, lattice.y(south + side) + across, reach.high}};
        const double distance =
            std::max(view.near_distance, std::sqrt(square_distance(box, view.eye_world)));
        largest = std::max(largest, static_cast<double>(area.max_vertex_bound) / distance);
    }
    return largest;
}

}  // namespace

FadeVisibility find_fade_visibility(const Lattice& lattice, const Chunk& chunk,
                                    std::span<const FadeObserver> observers, double inverse_fade) {
    // a vertex moves the surface up to a cell around it
    const double margin = lattice.level_spacing(chunk.key.level);
    const auto bound = static_cast<double>(chunk.max_vertex_bound);
    const LatticePoint corner = chunk.corner;
    const std::int64_t side = lattice.chunk_side(chunk.key.level);
    const WorldBox box{{lattice.x(corner.x) - margin, lattice.y(corner.y) - margin,
                        lattice.quantum * chunk.low - bound},
                       {lattice.x(corner.x + side) + margin, lattice.y(corner.y + side) + margin,
                        lattice.quantum * chunk.high + bound}};
    FadeVisibility visibility;
    double least_out = std::numeric_limits<double>::infinity();
    for (const FadeObserver& observer : observers) {
        const View& view = observer.view;
        if (!observer.previous) continue;
        const double displacement = (view.eye_world - observer.previous->eye_world).norm();
        if (farthest_from(box, view.eye_world) < kNearDisplacements * displacement) continue;
        if (!may_hold(observer.frustum, view.eye_world, box) ||
            !may_hold(observer.previous->frustum, observer.previous->eye_world, box)) {
            continue;
        }
        constexpr double kWider = 1.001;  // rounding of the triangulator's keys
        const double error_px =
            kWider * view.pixels_per_radian() * largest_angle(lattice, chunk, view);
        const double step = kMostMove_px / (kMorphGain * observer.threshold_px);
        const double ratio = std::min(error_px, kMostHeld_px) / observer.threshold_px;
        visibility.ratio = std::max(visibility.ratio, ratio);
        visibility.fade_in = std::max(visibility.fade_in, std::min(inverse_fade, ratio) - step);
        if (inverse_fade + step < ratio) least_out = std::min(least_out, inverse_fade + step);
    }
    visibility.fade_out = std::max(inverse_fade, std::min(least_out, visibility.ratio));
    return visibility;
}

double next_inverse_fade(const FadeVisibility& visibility, bool is_new, bool is_fading_out) {
    if (is_new) return std::max(1.0, visibility.ratio);
    return is_fading_out ? visibility.fade_out : visibility.fade_in;
}

float fade_of(double inverse_fade) {
    const auto fade = static_cast<float>(1.0 / inverse_fade);
    return static_cast<double>(fade) * inverse_fade > 1.0 ? std::nextafter(fade, 0.0f) : fade;
}

}  // namespace terrane::internal
