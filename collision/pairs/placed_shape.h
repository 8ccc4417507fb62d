// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/convex_queries.h"
#include "shapes/part_tree.h"

#include <terrane/collision/shapes.h>

namespace terrane::internal {

/// A shape as pair questions see it: its parts, and a tree of their bounds. A convex shape is its own only
/// part. A view: the shape outlives it.
class ShapeView {
public:
    ShapeView() = default;
    explicit ShapeView(const Shape& shape);

    bool is_single() const { return compound_ == nullptr || compound_->parts().size() == 1; }
    ConvexView part(std::uint32_t index) const;
    /// Nothing for a convex shape.
    const Pose* body_from_part(std::uint32_t index) const;
    double reach() const { return reach_; }  ///< bounding radius, metres

    /// Before tree() is asked for: what only questions to many parts need.
    void find_bounds();
    std::span<const PartNode> tree() const;

private:
    const Compound* compound_ = nullptr;
    ConvexView convex_;
    PartNode own_;  ///< of a convex shape
    double reach_ = 0.0;
};

/// A shape in world axes around a common origin.
struct PlacedShape {
    const ShapeView* view = nullptr;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();

    Placed part(std::uint32_t index) const;
    PlacedShape moved(const Eigen::Vector3d& way) const { return {view, rotation, centre + way}; }
};

/// The rotation of a part of a turned body: orthonormal, and with the body's own bits where the part is not
/// turned in it.
Eigen::Matrix3d part_rotation(const Eigen::Matrix3d& body, const Pose& body_from_part);

}  // namespace terrane::internal
