// SPDX-License-Identifier: MIT
#include "ground/eroded_part.h"

#include "ground/column/column.h"
#include "pairs/convex_core.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr std::array<std::uint32_t, 6> kTriangleLoops = {0, 1, 2, 0, 2, 1};
constexpr std::array<Polyhedron::Edge, 3> kTriangleEdges = {
    {{0, 1, 0, 1}, {0, 2, 1, 0}, {1, 2, 0, 1}}};
constexpr std::array<std::uint32_t, 4> kTriangleFirst = {0, 2, 4, 6};
constexpr std::array<std::uint32_t, 6> kTriangleNeighbours = {1, 2, 0, 2, 0, 1};

/// A box loses this fraction of the offset on each side, so that its corners move by the offset.
constexpr double kBoxShare = 0.57735026918962573;

Eigen::Matrix3d axes_of(const LocalShape& box) {
    Eigen::Matrix3d rotation;
    for (int i = 0; i < 3; ++i) rotation.col(i) = box.axes[static_cast<std::size_t>(i)];
    return rotation;
}

}  // namespace

TriangleCore::TriangleCore(const SurfaceTriangle& triangle) {
    for (std::size_t i = 0; i < 3; ++i) vertices_[i] = triangle.v[i] - triangle.v[0];
    faces_[0] = {triangle.normal, 0.0, 0, 3};
    faces_[1] = {-triangle.normal, 0.0, 3, 3};
    core_.shape.vertices = vertices_;
    core_.shape.faces = faces_;
    core_.shape.loops = kTriangleLoops;
    core_.shape.edges = kTriangleEdges;
    core_.shape.first_neighbour = kTriangleFirst;
    core_.shape.neighbours = kTriangleNeighbours;
    core_.rotation = Eigen::Matrix3d::Identity();
    core_.centre = triangle.v[0];
    core_.reach = std::max(length(vertices_[1]), length(vertices_[2]));
}

ErodedPart::ErodedPart(const LocalShape& shape, std::uint32_t index, double offset)
    : shape_(shape), index_(index), inside_(shape.centre) {
    if (shape.kind == ShapeKind::hull) {
        const std::span<const Eigen::Vector3d> vertices = shape.hull->shape->vertices;
        for (const Eigen::Vector3d& v : vertices) mean_ += v;
        mean_ /= static_cast<double>(vertices.size());
        for (const Eigen::Vector3d& v : vertices) reach_ = std::max(reach_, length(v - mean_));
        inside_ += rotated(shape.hull->rotation, mean_) - shape.hull->middle;
    }
    if (shape.kind == ShapeKind::box) {
        axes_ = shape.axes;
        has_axes_ = true;
    } else if (shape.kind == ShapeKind::round && shape.has_core()) {
        const Eigen::Vector3d along = shape.core / length(shape.core);
        axes_[0] = any_tangent(along);
        axes_[1] = cross(along, axes_[0]);
        axes_[2] = along;
        has_axes_ = true;
    }
    set_offset(offset);
}

void ErodedPart::set_offset(double offset) {
    if (shape_.kind == ShapeKind::round) {
        radius_ = std::max(0.0, shape_.radius - offset);
        half_ = Eigen::Vector3d::Constant(radius_);
        half_[2] += length(shape_.core);
    } else if (shape_.kind == ShapeKind::box) {
        half_ = (shape_.half - Eigen::Vector3d::Constant(kBoxShare * offset))
                    .cwiseMax(Eigen::Vector3d::Zero());
        core_ = make_core(PlacedBox{shape_.centre, axes_of(shape_), half_}, storage_);
    } else {
        scale_ = reach_ > 0.0 ? std::max(0.0, 1.0 - offset / reach_) : 1.0;
        // A scaled rotation scales the core: directions need not have unit length.
        core_.shape = *shape_.hull->shape;
        core_.rotation = scale_ * shape_.hull->rotation;
        core_.centre = inside_ - rotated(core_.rotation, mean_);
        core_.reach = reach_ + length(mean_);
    }
}

double ErodedPart::inner_radius() const {
    if (shape_.kind == ShapeKind::round) return radius_;
    if (shape_.kind == ShapeKind::box) return half_.minCoeff();
    return 0.0;
}

double ErodedPart::lowest(const Eigen::Vector3d& n) const {
    if (shape_.kind == ShapeKind::round) {
        return dot(n, shape_.centre) - std::abs(dot(n, shape_.core)) - radius_;
    }
    if (shape_.kind == ShapeKind::box) {
        return dot(n, shape_.centre) - std::abs(dot(n, shape_.axes[0])) * half_[0] -
               std::abs(dot(n, shape_.axes[1])) * half_[1] -
               std::abs(dot(n, shape_.axes[2])) * half_[2];
    }
    return dot(n, inside_) + scale_ * (lowest_of_whole(n) - dot(n, inside_));
}

double ErodedPart::shift(const Eigen::Vector3d& n) const { return lowest(n) - lowest_of_whole(n); }

double ErodedPart::opening(const Eigen::Vector3d& n) const {
    if (shape_.kind == ShapeKind::round) return 1.0;
    if (shape_.kind == ShapeKind::box) {
        return kBoxShare * (std::abs(dot(n, shape_.axes[0])) + std::abs(dot(n, shape_.axes[1])) +
                            std::abs(dot(n, shape_.axes[2])));
    }
    return reach_ > 0.0 ? (dot(n, inside_) - lowest_of_whole(n)) / reach_ : 0.0;
}

bool ErodedPart::is_beside(const std::array<Eigen::Vector3d, 3>& corners, double distance) const {
    if (!has_axes_) return false;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& axis = axes_[i];
        const double at = dot(axis, shape_.centre);
        const double a = dot(axis, corners[0]) - at, b = dot(axis, corners[1]) - at,
                     c = dot(axis, corners[2]) - at;
        const double reach = half_[static_cast<Eigen::Index>(i)] + distance;
        if (std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach) return true;
    }
    return false;
}

PartBound ErodedPart::bound_distance(const SurfaceTriangle& triangle, double enough) const {
    PartBound bound;
    const bool is_round = shape_.kind == ShapeKind::round;
    double square = 0.0;
    for (int i = 0; i < 3; ++i) {
        const double a = triangle.v[0][i], b = triangle.v[1][i], c = triangle.v[2][i];
        // The box around the whole part contains the shrunk part. Of a round part the box around its core is used.
        const double reach = is_round ? shape_.bounds[i] - shape_.radius : shape_.bounds[i];
        const double gap = std::max(std::min({a, b, c}) - shape_.centre[i],
                                    shape_.centre[i] - std::max({a, b, c})) -
                           reach;
        if (is_round) {
            square += gap > 0.0 ? gap * gap : 0.0;
        } else {
            bound.distance = std::max(bound.distance, gap);
        }
    }
    if (is_round) {
        const double far = radius_ + enough;
        if (square >= far * far) bound.distance = enough;
    }
    if (bound.distance >= enough) return bound;
    const double plane = dot(triangle.normal, triangle.v[0]);
    const double low = lowest(triangle.normal);
    // All but hulls are symmetric about their centre.
    const double high = shape_.kind == ShapeKind::hull
                            ? -lowest(-triangle.normal)
                            : 2.0 * dot(triangle.normal, shape_.centre) - low;
    bound.front = low - plane;
    bound.distance = std::max({bound.distance, bound.front, plane - high});
    if (bound.distance >= enough || shape_.kind != ShapeKind::box) return bound;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& axis = shape_.axes[i];
        const double at = dot(axis, shape_.centre);
        const double a = dot(axis, triangle.v[0]) - at, b = dot(axis, triangle.v[1]) - at,
                     c = dot(axis, triangle.v[2]) - at;
        bound.distance =
            std::max(bound.distance, std::max(std::min({a, b, c}), -std::max({a, b, c})) -
                                         half_[static_cast<Eigen::Index>(i)]);
    }
    return bound;
}

MeshPair ErodedPart::closest(const SurfaceTriangle& triangle, double enough) const {
    MeshPair pair;
    if (shape_.kind == ShapeKind::round) {
        const ClosestPair found = find_closest_core(shape_.centre, shape_.core, triangle);
        pair.on_part = found.on_shape;
        pair.on_triangle = found.on_triangle;
        if (found.distance > 0.0) {
            pair.normal = (found.on_shape - found.on_triangle) / found.distance;
        }
        pair.distance = pair.lower = found.distance - radius_;
        return pair;
    }
    const TriangleCore of_triangle(triangle);
    const Closest found = find_closest(core_, of_triangle.core(), enough);
    pair.on_part = found.on_a;
    pair.on_triangle = found.on_b;
    pair.normal = found.normal;
    pair.distance = found.distance;
    pair.lower = found.lower;
    // Below this distance GJK cannot distinguish separation from overlap.
    const double rounding = 1e-13 * (core_.reach + of_triangle.core().reach);
    if (pair.lower <= rounding) pair.distance = pair.lower = 0.0;
    return pair;
}

const Core& ErodedPart::whole_core() const {
    if (whole_core_) return *whole_core_;
    if (shape_.kind == ShapeKind::box) {
        whole_core_ =
            make_core(PlacedBox{shape_.centre, axes_of(shape_), shape_.half}, whole_storage_);
    } else if (shape_.kind == ShapeKind::hull) {
        const LocalHull& hull = *shape_.hull;
        whole_core_ = make_core(PlacedHull{shape_.centre - hull.middle, hull.rotation, *hull.shape,
                                           reach_ + length(mean_)},
                                whole_storage_);
    } else if (shape_.has_core()) {
        whole_core_ =
            make_core(PlacedCapsule{shape_.centre, shape_.core, shape_.radius, length(shape_.core)},
                      whole_storage_);
    } else {
        whole_core_ = make_core(PlacedSphere{shape_.centre, shape_.radius}, whole_storage_);
    }
    return *whole_core_;
}

}  // namespace terrane::internal
