// SPDX-License-Identifier: MIT
#include "pairs/placed_shape.h"

#include "shapes/compound_data.h"
#include "shapes/hull_data.h"

#include <terrane/collision/ground_cast.h>

namespace terrane::internal {
namespace {

ConvexView view_of(const ConvexHull& hull) {
    return HullView{polyhedron(hull), bounding_radius(hull)};
}
template <typename Primitive>
ConvexView view_of(const Primitive& shape) {
    return shape;
}

Aabb bounds_of(const Sphere& sphere) {
    const Eigen::Vector3d high = Eigen::Vector3d::Constant(sphere.radius);
    return {-high, high};
}
Aabb bounds_of(const Capsule& capsule) {
    const double r = capsule.radius;
    const Eigen::Vector3d high(r, r, r + capsule.half_height);
    return {-high, high};
}
Aabb bounds_of(const Box& box) { return {-box.half_extents, box.half_extents}; }
Aabb bounds_of(const HullView& hull) {
    Aabb bounds;
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d up = Eigen::Vector3d::Unit(axis);
        bounds.low[axis] = hull.shape.vertices[find_extreme(hull.shape, -up)][axis];
        bounds.high[axis] = hull.shape.vertices[find_extreme(hull.shape, up)][axis];
    }
    return bounds;
}

}  // namespace

ShapeView::ShapeView(const Shape& shape) : compound_(std::get_if<Compound>(&shape)) {
    if (compound_ != nullptr) {
        reach_ = bounding_radius(*compound_);
        return;
    }
    std::visit(
        [this](const auto& each) {
            if constexpr (!std::is_same_v<std::decay_t<decltype(each)>, Compound>) {
                convex_ = internal::view_of(each);
            }
        },
        shape);
    reach_ = reach_of(convex_);
}

ConvexView ShapeView::part(std::uint32_t index) const {
    if (compound_ == nullptr) return convex_;
    return std::visit([](const auto& each) { return internal::view_of(each); },
                      compound_->parts()[index].shape);
}

const Pose* ShapeView::body_from_part(std::uint32_t index) const {
    return compound_ == nullptr ? nullptr : &compound_->parts()[index].body_from_part;
}

void ShapeView::find_bounds() {
    if (compound_ != nullptr) return;
    own_.bounds = std::visit([](const auto& each) { return bounds_of(each); }, convex_);
    own_.item = 0;
    own_.end = 1;
}

std::span<const AabbNode> ShapeView::tree() const {
    return compound_ == nullptr ? std::span(&own_, 1) : part_tree(*compound_);
}

Eigen::Matrix3d part_rotation(const Eigen::Matrix3d& body, const Pose& body_from_part) {
    const Eigen::Matrix3d& part = body_from_part.rotation;
    if (part == Eigen::Matrix3d::Identity()) return body;
    return orthonormalized(product(body, part));
}

PlacedConvex PlacedShape::part(std::uint32_t index) const {
    const Pose* pose = view->body_from_part(index);
    if (pose == nullptr) return place(view->part(index), rotation, centre);
    return place(view->part(index), part_rotation(rotation, *pose),
                 centre + rotated(rotation, pose->translation));
}

}  // namespace terrane::internal
