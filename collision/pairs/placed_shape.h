// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "pairs/convex_queries.h"

#include <terrane/collision/shapes.h>

namespace terrane::internal {

/// Non-owning view of a shape as convex parts with a tree of their bounds. A convex shape is its own only part.
class ShapeView {
public:
    ShapeView() = default;
    explicit ShapeView(const Shape& shape);

    bool is_single() const { return compound_ == nullptr || compound_->parts().size() == 1; }
    ConvexView part(std::uint32_t index) const;
    /// Null for a convex shape.
    const Pose* body_from_part(std::uint32_t index) const;
    double reach() const { return reach_; }  ///< bounding radius, metres

    /// Must be called before tree(); only queries with a compound need it.
    void find_bounds();
    std::span<const AabbNode> tree() const;

private:
    const Compound* compound_ = nullptr;
    ConvexView convex_;
    AabbNode own_;  ///< of a convex shape
    double reach_ = 0.0;
};

/// A shape placed in world axes about an origin near both shapes of a query.
struct PlacedShape {
    const ShapeView* view = nullptr;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();

    PlacedConvex part(std::uint32_t index) const;
    PlacedShape moved(const Eigen::Vector3d& translation) const {
        return {view, rotation, centre + translation};
    }
};

/// Rotation of a part of a rotated body, orthonormal; bit for bit the body's where the part is not rotated in it.
Eigen::Matrix3d part_rotation(const Eigen::Matrix3d& body, const Pose& body_from_part);

}  // namespace terrane::internal
