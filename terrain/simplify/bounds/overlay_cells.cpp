// SPDX-License-Identifier: MIT
//
// The cells of the overlay of old and new triangles (contraction_bound.cpp has sources), and the bounds that follow.
#include "base/vector_math.h"
#include "simplify/bounds/contraction_bound.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Least sine of the angle at which spokes may cross.
constexpr double kMinCrossing = 1e-5;
// Least length of a spoke in the plane over its length, where another spoke crosses it.
constexpr double kMinFlatness = 0.1;
// Tolerance of parameters along a spoke; their rounding is below 1e-8.
constexpr double kAlongTolerance = 1e-7;
// Rounding of a displacement, of the size of the star: parameters along spokes have an error of at most 16 u (u =
// 2^-53) over the sine of their angle, times 1 / kMinFlatness in space.
constexpr double kRounding = 320.0 * 0x1p-53;
// Near a corner of a triangle the quadratic form is small: what is missing there is added to the constant.
constexpr double kLeastShare = 0.02;

}  // namespace

// All corners of cells inside new triangle k. The image of u, where it is inside, is the fourth.
bool ContractionBound::find_corners(const Ring& ring, std::size_t k) {
    corner_count_ = 0;
    OverlayCorner corner;
    corner.displacement = Eigen::Vector3d::Zero();
    corner.along = 1.0;
    for (const std::size_t spoke : {std::size_t{0}, k, k + 1}) {
        corner.spoke = spoke;
        corner.weights = {spoke == 0 ? 1.0 : 0.0, spoke == k ? 1.0 : 0.0,
                          spoke == k + 1 ? 1.0 : 0.0};
        corners_[corner_count_++] = corner;
    }
    corners_[3].spoke = 0;
    add_image_of_u(k);
    return (k == 1 || add_crossings(ring, k, false)) &&
           (k + 2 == ring.count || add_crossings(ring, k, true));
}

void ContractionBound::add_image_of_u(std::size_t k) {
    const Point &a = flat_[0], &b = flat_[k], &c = flat_[k + 1];
    std::array<double, 3> areas = {area(image_, b, c), area(image_, c, a), area(image_, a, b)};
    if (*std::min_element(areas.begin(), areas.end()) < -kPlaceTolerance * size_ * size_) return;
    for (double& part : areas) part = std::max(part, 0.0);
    const double whole = areas[0] + areas[1] + areas[2];
    OverlayCorner corner;
    corner.spoke = kEverySpoke;
    for (std::size_t i = 0; i < 3; ++i) corner.weights[i] = areas[i] / whole;
    // From the new surface to u, which is the origin.
    corner.displacement = -(ring_[0] * corner.weights[0] + ring_[k] * corner.weights[1] +
                            ring_[k + 1] * corner.weights[2]);
    const double x = flat_length_[0], y = flat_length_[k], z = flat_length_[k + 1];
    corner.rounding = kRounding * size_ * (1.0 + (x * y + y * z + z * x) / whole);
    add_corner(corner);
}

// Where old spokes cross the new spoke that is the first or the second of triangle k. False where that is too inexact.
bool ContractionBound::add_crossings(const Ring& ring, std::size_t k, bool is_second) {
    const std::size_t end = is_second ? k + 1 : k;
    const Point new_spoke = {flat_[end].x - flat_[0].x, flat_[end].y - flat_[0].y};
    const double new_length = std::sqrt(new_spoke.x * new_spoke.x + new_spoke.y * new_spoke.y);
    const double none = kPlaceTolerance * size_ * new_length;
    const double of_image = area(flat_[0], flat_[end], image_);
    for (std::size_t i = 1; i < ring.count; ++i) {
        if (i == end) continue;
        const double of_end = area(flat_[0], flat_[end], flat_[i]);
        if (std::min(of_image, of_end) > none || std::max(of_image, of_end) < -none) continue;
        const Point spoke = {flat_[i].x - image_.x, flat_[i].y - image_.y};
        const double turn = new_spoke.x * spoke.y - new_spoke.y * spoke.x;
        const double lengths = new_length * flat_length_[i];
        if (!(std::abs(turn) > kMinCrossing * lengths)) return false;
        const double t = -of_image / turn;
        const double s =
            ((image_.x - flat_[0].x) * spoke.y - (image_.y - flat_[0].y) * spoke.x) / turn;
        if (std::min(t, s) < -kAlongTolerance || std::max(t, s) > 1.0 + kAlongTolerance) continue;
        if (!(flat_length_[i] > kMinFlatness * length(ring_[i]))) return false;
        OverlayCorner corner;
        corner.spoke = i;
        corner.along = std::clamp(t, 0.0, 1.0);
        const double to_end = std::clamp(s, 0.0, 1.0);
        corner.weights = {1.0 - to_end, is_second ? 0.0 : to_end, is_second ? to_end : 0.0};
        corner.displacement =
            ring_[i] * corner.along - (ring_[0] + (ring_[end] - ring_[0]) * to_end);
        corner.rounding = kRounding * size_ * lengths / std::abs(turn);
        add_corner(corner);
    }
    return true;
}

void ContractionBound::add_corner(const OverlayCorner& corner) {
    corners_[corner_count_] = corner;
    corners_[corner_count_++].distance =
        std::max(length(corner.displacement) - corner.rounding, 0.0);
}

void ContractionBound::bound_triangle(const Ring& ring, std::size_t k) {
    TriangleBound& bound = new_bounds_[k];
    bound = {};
    const std::size_t corner = ring.corners[k];
    // The edge between neighbours stays as it is.
    bound.edges[1] = bounds_[ring.triangles[k]].edges[(corner + 1) % 3];
    cell_count_ = 0;
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] != kNoTriangle) add_cell(ring, i, bound);
    }
    for (std::size_t c = 0; c < cell_count_; ++c) bound_cell(cells_[c], true, bound);
    for (std::size_t c = 0; c < cell_count_; ++c) bound_cell(cells_[c], false, bound);
    std::array<double, 3> edges;
    for (std::size_t i = 0; i < 3; ++i) edges[(corner + i) % 3] = bound.edges[i];
    bound.edges = edges;
}

// What the new triangle has in common with old triangle i; bounds its box, and the constant by the rounding.
void ContractionBound::add_cell(const Ring& ring, std::size_t i, TriangleBound& bound) {
    Cell& cell = cells_[cell_count_];
    cell.count = 0;
    const std::size_t next = i + 1 < ring.count ? i + 1 : 0;
    std::array<double, 3> low, high;
    low.fill(kInfinity);
    high.fill(-kInfinity);
    double rounding = 0.0, farthest = 0.0;
    for (std::size_t c = 0; c < corner_count_; ++c) {
        const OverlayCorner& corner = corners_[c];
        if (corner.spoke != i && corner.spoke != next && corner.spoke != kEverySpoke) continue;
        cell.corners[cell.count++] = {{1.0 - corner.along, corner.spoke == i ? corner.along : 0.0,
                                       corner.spoke == next ? corner.along : 0.0},
                                      corner.weights,
                                      corner.distance};
        rounding = std::max(rounding, corner.rounding);
        farthest = std::max(farthest, corner.distance);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double value = corner.displacement[static_cast<Eigen::Index>(axis)];
            low[axis] = std::min(low[axis], value - corner.rounding);
            high[axis] = std::max(high[axis], value + corner.rounding);
        }
    }
    if (cell.count < 3) return;  // no area
    const TriangleBound& old = bounds_[ring.triangles[i]];
    for (std::size_t axis = 0; axis < 3; ++axis) {
        bound.low[axis] = std::min(bound.low[axis], old.low[axis] + low[axis]);
        bound.high[axis] = std::max(bound.high[axis], old.high[axis] + high[axis]);
        cell.edges[axis] = old.edges[(ring.corners[i] + axis) % 3];
    }
    cell.constant = old.constant;
    bound.constant = std::max(bound.constant, old.constant + rounding);
    // Flat: the constant is enough.
    if (farthest > 0.0 || std::max({cell.edges[0], cell.edges[1], cell.edges[2]}) > 0.0)
        ++cell_count_;
}

// Raises the new quadratic form until it is above the old one and the displacement on a cell: that is so if the form's
// polar is, at all pairs of the cell's corners. Pairs along one edge of the new triangle, which decide one coefficient
// alone, come first.
void ContractionBound::bound_cell(const Cell& cell, bool is_along_edge, TriangleBound& bound) {
    const bool was_exact =
        std::max({cell.edges[0], cell.edges[1], cell.edges[2], cell.constant}) == 0.0;
    for (std::size_t a = 0; a < cell.count; ++a) {
        const auto& [p, wp, distance_p] = cell.corners[a];
        for (std::size_t b = a; b < cell.count; ++b) {
            const auto& [q, wq, distance_q] = cell.corners[b];
            if (was_exact && distance_p + distance_q == 0.0) continue;  // nothing is wanted
            const bool is_along = (wp[0] == 0.0 && wq[0] == 0.0) ||
                                  (wp[1] == 0.0 && wq[1] == 0.0) || (wp[2] == 0.0 && wq[2] == 0.0);
            if (is_along != is_along_edge) continue;
            const std::array<double, 3>& old = cell.edges;
            const double wanted = distance_p + distance_q + old[0] * (p[0] * q[1] + p[1] * q[0]) +
                                  old[1] * (p[1] * q[2] + p[2] * q[1]) +
                                  old[2] * (p[2] * q[0] + p[0] * q[2]) + 2.0 * cell.constant;
            const std::array<double, 3> share = {wp[0] * wq[1] + wp[1] * wq[0],
                                                 wp[1] * wq[2] + wp[2] * wq[1],
                                                 wp[2] * wq[0] + wp[0] * wq[2]};
            const double given = share[0] * bound.edges[0] + share[1] * bound.edges[1] +
                                 share[2] * bound.edges[2] + 2.0 * bound.constant;
            const double missing = wanted * (1.0 + 0x1p-47) - given;
            if (!(missing > 0.0)) continue;
            const double square = share[0] * share[0] + share[1] * share[1] + share[2] * share[2];
            if (square < kLeastShare * kLeastShare) {
                bound.constant += missing;
                continue;
            }
            const double step = missing * (1.0 + 0x1p-47) / square;
            for (std::size_t e = 0; e < 3; ++e) bound.edges[e] += step * share[e];
        }
    }
}

}  // namespace terrane::internal
