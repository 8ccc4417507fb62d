// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/compound_data.h"
#include "ground/frame/local_shape.h"

namespace terrane::internal {

/// What a question is about, placed in a local frame: one convex shape, or the parts of a compound, which
/// are made one by one as they are asked for. Stays where it is, because shapes point into it.
class LocalBody {
public:
    LocalBody(const Shape& shape, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& origin);
    LocalBody(const LocalBody&) = delete;
    LocalBody& operator=(const LocalBody&) = delete;

    bool is_compound() const { return compound_ != nullptr; }
    /// The convex shape. Of a compound only what holds for all parts together is set: centre, bounds and
    /// the smallest half extent.
    const LocalShape& whole() const { return whole_; }
    /// @param hull_out where the part points to, if it is a hull of a compound
    LocalShape part(std::uint32_t index, LocalHull& hull_out) const;

    /// Visits the parts; for a convex shape that is itself, as part 0, whatever `wants` would say.
    ///
    /// @param wants bool(centre, bounds) whether anything in a box can matter
    /// @param take  void(const LocalShape&, part)
    template <class Wants, class Take>
    void visit(Wants&& wants, Take&& take) const {
        if (!is_compound()) {
            take(whole_, 0u);
            return;
        }
        visit_parts(
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
    /// Half extents along the world's axes of a box along the body's.
    Eigen::Vector3d around(const Eigen::Vector3d& half) const;

    const CompoundData* compound_ = nullptr;
    Eigen::Matrix3d rotation_;
    Eigen::Vector3d origin_;
    LocalHull hull_;
    LocalShape whole_;
};

}  // namespace terrane::internal
