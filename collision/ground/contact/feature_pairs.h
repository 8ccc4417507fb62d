// SPDX-License-Identifier: MIT
#pragma once

#include "ground/contact/contact_patches.h"

namespace terrane::internal {

/// Pairs features of a shape, where it is free, with those of one triangle after the other.
class FeaturePairs {
public:
    /// @param shape   where it is free
    /// @param translation how it came there
    /// @param reach   gaps up to this are looked at, metres
    /// @param margin  contacts of the shape where it was, with gaps up to this, are kept
    FeaturePairs(const LocalGround& local, const LocalShape& shape, const Eigen::Vector3d& translation,
                 double reach, double margin, std::uint32_t part, ContactPatches& patches)
        : local_(local),
          shape_(shape),
          translation_(translation),
          reach_(reach),
          margin_(margin),
          // Where it is not moved, a core clear of the ground is paired with planes up to it.
          least_(shape.kind == ShapeKind::round && length(translation) == 0.0 ? -shape.radius
                                                                          : -kTouch),
          part_(part),
          patches_(patches) {}

    void pair(const Triangle& triangle);

private:
    void pair_round(const Triangle& triangle);
    void pair_box(const Triangle& triangle);
    void pair_box_face(const Triangle& triangle);
    void pair_box_corners(const Triangle& triangle);
    void pair_box_edges(const Triangle& triangle);
    void pair_hull(const Triangle& triangle);
    double pair_hull_along(const Eigen::Vector3d& n, const Triangle& triangle);

    /// The widest gap along a direction of the ground's normal cone.
    Separation find_separation_in_cone(const Triangle& triangle) const;
    void add(const Eigen::Vector3d& on_shape, const Eigen::Vector3d& n, double gap,
             const ShapeFeature& feature);

    const LocalGround& local_;
    const LocalShape& shape_;
    Eigen::Vector3d translation_;
    double reach_;
    double margin_;
    double least_;  ///< gaps down to this are looked at
    std::uint32_t part_;
    ContactPatches& patches_;
};

}  // namespace terrane::internal
