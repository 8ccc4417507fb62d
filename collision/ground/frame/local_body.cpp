// SPDX-License-Identifier: MIT
#include "ground/frame/local_body.h"

#include <terrane/collision/ground_cast.h>

namespace terrane::internal {

LocalBody::LocalBody(const Shape& shape, const Eigen::Matrix3d& rotation,
                     const Eigen::Vector3d& origin)
    : rotation_(rotation), origin_(origin) {
    const auto make = [&](const auto& each) { whole_ = make_local_shape(each, rotation, hull_); };
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        make(*sphere);
    } else if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        make(*capsule);
    } else if (const Box* box = std::get_if<Box>(&shape)) {
        make(*box);
    } else if (const ConvexHull* hull = std::get_if<ConvexHull>(&shape)) {
        make(*hull);
    } else {
        compound_ = &compound_data(std::get<Compound>(shape));
        rotation_ = orthonormalized(rotation);
        const Aabb& all = compound_->tree[0].bounds;
        const Eigen::Vector3d middle = 0.5 * (all.low + all.high);
        whole_.offset = rotated(rotation_, middle);
        whole_.centre = whole_.offset;
        whole_.bounds = around(all.high - middle);
        whole_.smallest = compound_->smallest_half_extent;
    }
    whole_.centre += origin;
}

LocalShape LocalBody::part(std::uint32_t index, LocalHull& hull_out) const {
    if (!is_compound()) return whole_;
    const CompoundPart& part = compound_->parts[index];
    Eigen::Matrix3d rotation;
    for (int i = 0; i < 3; ++i) {
        rotation.col(i) = rotated(rotation_, part.body_from_part.rotation.col(i));
    }
    rotation = orthonormalized(rotation);
    LocalShape shape = std::visit(
        [&](const auto& each) { return make_local_shape(each, rotation, hull_out); }, part.shape);
    const Eigen::Vector3d offset = rotated(rotation_, part.body_from_part.translation);
    shape.offset += offset;
    shape.centre += offset;
    shape.centre += origin_;
    return shape;
}

Eigen::Vector3d LocalBody::around(const Eigen::Vector3d& half) const {
    Eigen::Vector3d bounds;
    for (int i = 0; i < 3; ++i) {
        bounds[i] = std::abs(rotation_(i, 0)) * half[0] + std::abs(rotation_(i, 1)) * half[1] +
                    std::abs(rotation_(i, 2)) * half[2];
    }
    // Slightly wider, for the rounding of parts and their bounds.
    constexpr double kHair = 1e-12;
    return bounds + Eigen::Vector3d::Constant(kHair * (1.0 + compound_->bounding_radius));
}

}  // namespace terrane::internal
