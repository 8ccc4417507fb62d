// SPDX-License-Identifier: MIT
#include "ground/frame/local_shape.h"

#include <terrane/collision/ground_cast.h>

#include <algorithm>

namespace terrane::internal {
namespace {

// Below this cosine a feature counts as perpendicular to the direction.
constexpr double kLevel = 1e-9;

DeepestPoint deepest_of_round(const LocalShape& shape, const Eigen::Vector3d& n) {
    Eigen::Vector3d p = shape.centre;
    ShapeFeature feature{0, shape.has_core() ? 1u : 0u};
    const double along = dot(n, shape.core);
    if (std::abs(along) > kLevel * length(shape.core)) {
        p += along > 0.0 ? -shape.core : shape.core;
        feature = along > 0.0 ? ShapeFeature{0, 0} : ShapeFeature{1, 1};
    }
    return {p - shape.radius * n, feature};
}

DeepestPoint deepest_of_box(const LocalShape& shape, const Eigen::Vector3d& n) {
    Eigen::Vector3d p = shape.centre;
    std::uint32_t corner = 0;
    std::uint32_t level = 0;  // bits of the axes that are tied
    for (std::uint32_t i = 0; i < 3; ++i) {
        const auto axis = static_cast<Eigen::Index>(i);
        const double along = dot(n, shape.axes[i]);
        if (std::abs(along) > kLevel) {
            p += (along > 0.0 ? -shape.half[axis] : shape.half[axis]) * shape.axes[i];
            if (!(along > 0.0)) corner |= 1u << i;
        } else {
            level |= 1u << i;
        }
    }
    for (std::uint32_t i = 0; i < 3; ++i) {
        if (level == (7u ^ 1u << i)) {
            return {p, {2 * i + (corner >> i & 1u), ShapeFeature::kFace}};
        }
    }
    return {p, {corner, corner | level}};
}

void make_local(const Sphere& sphere, const Eigen::Matrix3d&, LocalHull&, LocalShape& local) {
    local.radius = sphere.radius;
    local.smallest = sphere.radius;
}

void make_local(const Capsule& capsule, const Eigen::Matrix3d& rotation, LocalHull&,
                LocalShape& local) {
    local.radius = capsule.radius;
    local.core = capsule.half_height * rotation.col(2);
    local.smallest = capsule.radius;
}

void make_local(const Box& box, const Eigen::Matrix3d& rotation, LocalHull&, LocalShape& local) {
    local.kind = ShapeKind::box;
    const Eigen::Matrix3d exact = orthonormalized(rotation);
    for (int i = 0; i < 3; ++i) local.axes[static_cast<std::size_t>(i)] = exact.col(i);
    local.half = box.half_extents;
    for (std::size_t k = 0; k < 8; ++k) {
        local.corners[k] = ((k & 1) != 0 ? local.half[0] : -local.half[0]) * local.axes[0] +
                           ((k & 2) != 0 ? local.half[1] : -local.half[1]) * local.axes[1] +
                           ((k & 4) != 0 ? local.half[2] : -local.half[2]) * local.axes[2];
    }
    local.smallest = std::min({local.half[0], local.half[1], local.half[2]});
}

void make_local(const ConvexHull& hull, const Eigen::Matrix3d& rotation, LocalHull& hull_out,
                LocalShape& local) {
    make_local_hull(hull, orthonormalized(rotation), hull_out);
    local.kind = ShapeKind::hull;
    local.hull = &hull_out;
    local.centre = hull_out.middle;
    local.bounds = hull_out.bounds;
    local.offset = hull_out.middle;
    local.smallest = smallest_half_extent(hull);
}

}  // namespace

DeepestPoint LocalShape::deepest(const Eigen::Vector3d& n) const {
    if (kind == ShapeKind::round) return deepest_of_round(*this, n);
    if (kind == ShapeKind::box) return deepest_of_box(*this, n);
    DeepestPoint found;
    found.feature = find_deepest(*hull, n, found.point);
    found.point += centre;
    return found;
}

ShapeFeature LocalShape::core_feature(const Eigen::Vector3d& on_core) const {
    constexpr double kEnd = 1.0 - 1e-9;  // share of the distance from the centre to an end
    if (!has_core()) return {0, 0};
    const double along = dot(on_core - centre, core) / dot(core, core);
    if (along >= kEnd) return {1, 1};
    return {0, along <= -kEnd ? 0u : 1u};
}

template <class Convex>
LocalShape make_local_shape(const Convex& shape, const Eigen::Matrix3d& rotation,
                            LocalHull& hull_out) {
    LocalShape local;
    make_local(shape, rotation, hull_out, local);
    if (local.kind != ShapeKind::hull) {
        for (int i = 0; i < 3; ++i) local.bounds[i] = local.drop(Eigen::Vector3d::Unit(i));
    }
    return local;
}

template LocalShape make_local_shape(const Sphere&, const Eigen::Matrix3d&, LocalHull&);
template LocalShape make_local_shape(const Capsule&, const Eigen::Matrix3d&, LocalHull&);
template LocalShape make_local_shape(const Box&, const Eigen::Matrix3d&, LocalHull&);
template LocalShape make_local_shape(const ConvexHull&, const Eigen::Matrix3d&, LocalHull&);

}  // namespace terrane::internal
