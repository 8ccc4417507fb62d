// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_shape.h"
#include "shapes/compound_data.h"

namespace terrane::internal {

/// The shape of a query in a local frame: one convex shape, or the parts of a compound, which are made one by one on
/// demand. Neither copied nor moved, because shapes point into it.
class LocalBody {
public:
    LocalBody(const Shape& shape, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& origin);
    LocalBody(const LocalBody&) = delete;
    LocalBody& operator=(const LocalBody&) = delete;

    bool is_compound() const { return compound_ != nullptr; }
    /// The convex shape. For a compound only the centre, the bounds and the smallest half extent of all parts together
    /// are set.
    const LocalShape& whole() const { return whole_; }
    /// @param hull_out storage for a part that is a hull of a compound; outlives the result
    LocalShape part(std::uint32_t index, LocalHull& hull_out) const;

    /// Visits the parts whose bounds pass `wants`; a convex shape is its own part 0 and always visited.
    ///
    /// @param wants bool(centre, bounds): whether to visit what is inside this box
    /// @param take  void(const LocalShape&, part)
    template <class Wants, class Take>
    void visit(Wants&& wants, Take&& take) const {
        if (!is_compound()) {
            take(whole_, 0u);
            return;
        }
        visit_leaves(
            compound_->tree,
            [&](const Aabb& box) {
                const Eigen::Vector3d middle = 0.5 * (box.low + box.high);
                const Eigen::Vector3d half = box.high - middle;
                return wants(Eigen::Vector3d(origin_ + rotated(rotation_, middle)), around(half));
            },
            [&](std::uint32_t index) {
                LocalHull hull;
                take(part(index, hull), index);
            });
    }

private:
    /// Half extents along the world's axes of a box with half extents `half` along the body's axes.
    Eigen::Vector3d around(const Eigen::Vector3d& half) const;

    const CompoundData* compound_ = nullptr;
    Eigen::Matrix3d rotation_;
    Eigen::Vector3d origin_;
    LocalHull hull_;
    LocalShape whole_;
};

}  // namespace terrane::internal
