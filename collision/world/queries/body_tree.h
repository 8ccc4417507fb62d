// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "broadphase/pair_list.h"

#include <terrane/terrain/math.h>

namespace terrane::internal {

/// A straight sweep of a box, world axes, metres. A ray has a box without extent.
struct BoxSweep {
    WorldPos from = WorldPos::Zero();  ///< of a point of the box, such as its centre
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
    Aabb reach;  ///< the box, relative to that point
};

/// The distance of two boxes, metres; minus infinity where they overlap or touch, and infinity from the empty box. No
/// more than the signed distance of shapes inside them, but for rounding.
double box_separation(const Aabb& a, const Aabb& b);

/// Bounding volume tree over the boxes of bodies. Boxes that are no boxes (is_box()) are in no answer.
///
/// Threads: any number at once while neither build() nor refit() runs
class BodyTree {
public:
    /// @param bounds [slots] around the body of each slot, world axes, metres
    ///
    /// Allocates: only where there are more slots than ever before
    /// Cost:      O(n log n)
    void build(std::span<const Aabb> bounds);

    /// Takes over boxes that have moved, also those of slots that had no box or have none any more. The answers are
    /// those of a tree that is built now, in more time where bodies have moved far.
    ///
    /// @param bounds [slots] as many as build() was given
    ///
    /// Cost: O(n)
    void refit(std::span<const Aabb> bounds);

    /// Number of slots.
    std::size_t slot_count() const { return boxes_.size(); }

    /// Calls take(slot) for each box that overlaps or touches a finite one, in no particular order.
    template <class Take>
    void visit_overlaps(const Aabb& box, const Take& take) const {
        visit_leaves(
            nodes_, [&](const Aabb& bounds) { return overlap(bounds, box, 0.0); }, take);
    }

    /// Calls visit(slot) for each box that the sweep touches up to the fraction `limit`, nearer ones mostly first;
    /// visit returns the new limit.
    template <class Visit>
    void visit_along(const BoxSweep& sweep, double limit, const Visit& visit) const {
        const auto entry = [&](const Aabb& bounds) {
            const Aabb widened{bounds.low - sweep.reach.high, bounds.high - sweep.reach.low};
            return segment_entry(sweep.from, sweep.displacement, widened, 0.0);
        };
        visit_leaves_up_to(nodes_, limit, entry, visit);
    }

    /// Calls visit(slot) for each box whose box_separation() is at most `limit`, nearer ones mostly first; visit
    /// returns the new limit.
    template <class Visit>
    void visit_near(const Aabb& box, double limit, const Visit& visit) const {
        visit_leaves_up_to(
            nodes_, limit, [&](const Aabb& bounds) { return box_separation(bounds, box); }, visit);
    }

private:
    void take(std::span<const Aabb> bounds);

    std::vector<Aabb> boxes_;  ///< of the slots; the empty box where there is none
    std::vector<std::uint32_t> order_;
    std::vector<AabbNode> nodes_;
};

}  // namespace terrane::internal
