// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "mesh/star_mesh.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kRoundedUp = 1.0 + 0x1p-44;

// Upper bound, at most a 64th too large, of a w0 w1 + b w1 w2 + c w2 w0 for w >= 0 that sum to 1.
double largest_on_triangle(double a, double b, double c) {
    const double most = std::max({a, b, c}), least = std::min({a, b, c});
    double largest = 0.25 * most;
    // the differences below are too inexact then; this upper bound exceeds the largest value by at most a 64th
    if (least < most * 0x1p-6) return largest + 0.25 * least;
    // the weights of the stationary point have these ratios; if it is outside the triangle, the maximum is on an edge
    const double w0 = b * (a + c - b), w1 = c * (a + b - c), w2 = a * (b + c - a);
    if (std::min({w0, w1, w2}) > 0.0) largest = std::max(largest, a * b * c / (w0 + w1 + w2));
    return largest;
}

}  // namespace

void TriangleBound::include(double distance) {
    constant = std::max(constant, distance);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], -distance);
        high[axis] = std::max(high[axis], distance);
    }
}

double TriangleBound::largest() const {
    double square = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double far = std::max(std::abs(low[axis]), std::abs(high[axis]));
        square += far * far;
    }
    const double by_edges = constant + largest_on_triangle(edges[0], edges[1], edges[2]);
    return std::min(std::sqrt(square), by_edges) * kRoundedUp;
}

// Second certificate, for surfaces that cannot be projected onto a plane without folds, such as the edges of thin
// bodies. A point of an old triangle at u maps to the point of the new triangle with the same barycentric weights: the
// point moves by w_u (v - u), where w_u is its weight at u. The two triangles at the contracted edge map to the edges
// between v and their apexes, which belong to new triangles. The map is continuous and onto.

namespace {

// Least ratio of a new triangle's height to its longest edge, unless a removed triangle is worse.
constexpr double kMinThinShape = 0.02;
constexpr double kMinThinShapeEver = 1e-5;
// Least cosine of the angle between the normals of a new triangle and of the old one that it replaces.
constexpr double kMinTurnCosine = 0.2;

}  // namespace

bool ContractionBound::evaluate_along_edge(std::uint32_t u, const Ring& ring) {
    if (ring.count < 3) return false;
    for (std::size_t i = 0; i < ring.count; ++i)
        ring_[i] = vertices_[ring.vertices[i]] - vertices_[u];
    if (!do_not_turn(ring)) return false;
    const Eigen::Vector3d& to_target = ring_[0];
    const double moved = length(to_target) * (1.0 + 0x1p-44);
    error_ = 0.0;
    for (std::size_t k = 1; k + 1 < ring.count; ++k) {
        TriangleBound& bound = new_bounds_[k];
        bound = bounds_[ring.triangles[k]];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            // displacement from a new point to the old one
            const double step = -to_target[static_cast<Eigen::Index>(axis)] * (1.0 + 0x1p-44);
            bound.low[axis] += std::min(step, 0.0);
            bound.high[axis] += std::max(step, 0.0);
        }
        bound.constant = (bound.constant + moved) * (1.0 + 0x1p-44);
    }
    for (const std::size_t i : {std::size_t{0}, ring.count - 1}) {
        if (ring.triangles[i] == kNoTriangle) continue;
        const double most = (bounds_[ring.triangles[i]].largest() + moved) * (1.0 + 0x1p-44);
        new_bounds_[i == 0 ? 1 : i - 1].include(most);
    }
    for (std::size_t k = 1; k + 1 < ring.count; ++k)
        error_ = std::max(error_, new_bounds_[k].largest());
    return true;
}

// Whether no new triangle is flipped, folded onto its neighbour, or a sliver where there was none before.
bool ContractionBound::do_not_turn(const Ring& ring) const {
    const auto shape = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& normal) {
        const Eigen::Vector3d edge = b - a;
        return length(normal) / std::max({dot(a, a), dot(b, b), dot(edge, edge)});
    };
    double worst_old = kMinThinShape;
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] == kNoTriangle) continue;
        const Eigen::Vector3d& b = ring_[i + 1 < ring.count ? i + 1 : 0];
        worst_old = std::min(worst_old, shape(ring_[i], b, cross(ring_[i], b)));
    }
    const double least = std::max(worst_old, kMinThinShapeEver);
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < ring.count; ++i) {
        const Eigen::Vector3d a = ring_[i] - ring_[0], b = ring_[i + 1] - ring_[0];
        const Eigen::Vector3d normal = cross(a, b), old_normal = cross(ring_[i], ring_[i + 1]);
        if (!(shape(a, b, normal) >= least)) return false;
        const double lengths = length(normal) * length(old_normal);
        if (!(dot(normal, old_normal) >= kMinTurnCosine * lengths)) return false;
        if (i > 1 && !(dot(normal, before) >= kFoldedCosine * length(normal) * length(before)))
            return false;
        before = normal;
    }
    return true;
}

// The cells of the overlay of old and new triangles, and the resulting bounds. Sources are given with the first
// certificate below.

namespace {

// Least sine of the angle between crossing spokes.
constexpr double kMinCrossing = 1e-5;
// Least ratio of a spoke's projected length to its length in space, for spokes that another spoke crosses.
constexpr double kMinFlatness = 0.1;
// Tolerance of parameters along a spoke; their rounding errors are below 1e-8.
constexpr double kAlongTolerance = 1e-7;
// Rounding error of a displacement, relative to the size of the star: parameters along spokes have an error of at most
// 16 u (u = 2^-53) over the sine of the angle between the spokes, times 1 / kMinFlatness in space.
constexpr double kRounding = 320.0 * 0x1p-53;
// If the edges' coefficients have less influence than this, as near a corner, a deficit is added to the constant.
constexpr double kLeastShare = 0.02;

}  // namespace

// Finds all corners of cells in new triangle k. The image of u, if inside the triangle, follows its three corners.
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
    // from the new surface to u, which is the origin
    corner.displacement = -(ring_[0] * corner.weights[0] + ring_[k] * corner.weights[1] +
                            ring_[k + 1] * corner.weights[2]);
    const double x = flat_length_[0], y = flat_length_[k], z = flat_length_[k + 1];
    corner.rounding = kRounding * size_ * (1.0 + (x * y + y * z + z * x) / whole);
    add_corner(corner);
}

// Finds the crossings of old spokes with the first or second new spoke of triangle k. Returns false if one is too
// inexact.
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
    // the edge between two neighbours is unchanged
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

// Adds the intersection of the new triangle with old triangle i; extends the bound's box, and raises its constant to
// the old one plus rounding.
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
    // without deviation the constant suffices
    if (farthest > 0.0 || std::max({cell.edges[0], cell.edges[1], cell.edges[2]}) > 0.0)
        ++cell_count_;
}

// Raises the new quadratic form until, on a whole cell, it is at least the old form plus the displacement. It suffices
// that their polar forms satisfy this for all pairs of the cell's corners. Pairs along one edge of the new triangle,
// which determine a single coefficient, come first.
void ContractionBound::bound_cell(const Cell& cell, bool is_along_edge, TriangleBound& bound) {
    const bool was_exact =
        std::max({cell.edges[0], cell.edges[1], cell.edges[2], cell.constant}) == 0.0;
    for (std::size_t a = 0; a < cell.count; ++a) {
        const auto& [p, wp, distance_p] = cell.corners[a];
        for (std::size_t b = a; b < cell.count; ++b) {
            const auto& [q, wq, distance_q] = cell.corners[b];
            if (was_exact && distance_p + distance_q == 0.0) continue;  // no constraint
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

// First certificate.
// Sources: J. Cohen, D. Manocha, M. Olano. Simplifying Polygonal Models Using Successive Mappings. IEEE Visualization
//          1997.
// Deviations: the removed vertex may have any image inside the polygon of its neighbours, because a map that is only
//             onto suffices for a Hausdorff distance, so that borders and triangles without area need no special cases.
//             Half-edge contraction, hence no optimisation of the new vertex. If no map is found, the contraction is
//             refused.
//
// The old triangles around u and the new ones around the target v are projected onto one plane: both are fans over the
// same polygon of neighbours, one from the image of u and one from v. A point of an old triangle maps to the point of a
// new triangle with the same projection. The displacement is affine on each cell of the overlay, so its extremes are at
// the cells' corners: the image of u, the crossings of old with new spokes, and the neighbours, where it is 0.

namespace {

// Least ratio of a new triangle's height to its longest edge, unless a triangle that it replaces is worse.
constexpr double kMinShape = 0.02;
// Least ratio in any case: below it, results in the plane would be too inexact for kRounding.
constexpr double kMinShapeEver = 1e-3;
// Least cosine of the angle between the normal of a new triangle and the direction of projection, and between the
// normals of an old triangle and the new one that replaces it.
constexpr double kMinCosine = 0.2;

}  // namespace

// Twice the signed area.
double ContractionBound::area(const Point& a, const Point& b, const Point& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool ContractionBound::evaluate(std::uint32_t u, const Ring& ring, double limit) {
    if (ring.count < 3 || !set_frame(u, ring) || !are_new_triangles_good(ring) ||
        !is_image_inside(ring))
        return false;
    for (std::size_t i = 0; i < ring.count; ++i) {
        const double x = flat_[i].x - image_.x, y = flat_[i].y - image_.y;
        flat_length_[i] = std::sqrt(x * x + y * y);
    }
    error_ = 0.0;
    bool has_image = false;
    for (std::size_t k = 1; k + 1 < ring.count; ++k) {
        if (!find_corners(ring, k)) return false;
        has_image = has_image || corners_[3].spoke == kEverySpoke;
        bound_triangle(ring, k);
        error_ = std::max(error_, new_bounds_[k].largest());
        if (error_ > limit) return true;
    }
    return has_image;
}

bool ContractionBound::set_frame(std::uint32_t u, const Ring& ring) {
    const std::size_t count = ring.count;
    double square = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        ring_[i] = vertices_[ring.vertices[i]] - vertices_[u];
        square = std::max(square, dot(ring_[i], ring_[i]));
    }
    size_ = 2.0 * std::sqrt(square);
    // the polygon's area vector: the sum over the new triangles, and also over the old ones if u is inside
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < count; ++i)
        sum += cross(ring_[i] - ring_[0], ring_[i + 1] - ring_[0]);
    const double length_of_sum = length(sum);
    if (!(length_of_sum > 1e-12 * square)) return false;
    direction_ = sum / length_of_sum;
    const Eigen::Vector3d x = any_tangent(direction_), y = cross(direction_, x);
    for (std::size_t i = 0; i < count; ++i) flat_[i] = {dot(ring_[i], x), dot(ring_[i], y)};
    image_ = {};
    if (ring.is_closed) return true;
    // u on a border maps to the nearest point of the new border edge
    const std::size_t other = ring.triangles[0] == kNoTriangle ? 1 : count - 1;
    const Eigen::Vector3d edge = ring_[other] - ring_[0];
    const double t = std::clamp(-dot(ring_[0], edge) / dot(edge, edge), 0.0, 1.0);
    image_ = {flat_[0].x + t * (flat_[other].x - flat_[0].x),
              flat_[0].y + t * (flat_[other].y - flat_[0].y)};
    return std::isfinite(t);
}

// Whether the new triangles are well shaped, counter-clockwise in the plane, and have angles at the target that sum to
// less than a full turn: the polygon is then simple, and the new triangles triangulate it.
bool ContractionBound::are_new_triangles_good(const Ring& ring) const {
    double worst_old = kMinShape;
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] == kNoTriangle) continue;
        const Eigen::Vector3d& a = ring_[i];
        const Eigen::Vector3d& b = ring_[i + 1 < ring.count ? i + 1 : 0];
        const Eigen::Vector3d edge = b - a, normal = cross(a, b);
        const double longest = std::max({dot(a, a), dot(b, b), dot(edge, edge)});
        worst_old = std::min(worst_old, length(normal) / longest);
    }
    const double least_shape = std::max(worst_old, kMinShapeEver);
    bool was_below = false;
    for (std::size_t i = 1; i + 1 < ring.count; ++i) {
        const Eigen::Vector3d a = ring_[i] - ring_[0], b = ring_[i + 1] - ring_[0],
                              edge = ring_[i + 1] - ring_[i];
        const Eigen::Vector3d normal = cross(a, b), old_normal = cross(ring_[i], ring_[i + 1]);
        const double doubled = length(normal);
        if (!(doubled >= least_shape * std::max({dot(a, a), dot(b, b), dot(edge, edge)})))
            return false;
        if (!(dot(normal, direction_) >= kMinCosine * doubled)) return false;
        if (!(dot(normal, old_normal) >= kMinCosine * doubled * length(old_normal))) return false;
        const double side = area(flat_[0], flat_[1], flat_[i + 1]);
        if (was_below && side >= 0.0) return false;
        was_below = side < 0.0;
    }
    return true;
}

// Whether the fan around the image of u covers the polygon without leaving it; triangles without area are allowed.
bool ContractionBound::is_image_inside(const Ring& ring) const {
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] == kNoTriangle) continue;
        const Point &a = flat_[i], &b = flat_[i + 1 < ring.count ? i + 1 : 0];
        const double edge = std::abs(b.x - a.x) + std::abs(b.y - a.y);
        if (!(area(image_, a, b) >= -kPlaceTolerance * size_ * edge)) return false;
    }
    return true;
}

}  // namespace terrane::internal
