// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "broadphase/pair_list.h"

#include <terrane/base/math.h>
#include <terrane/collision/query.h>
#include <terrane/collision/shapes.h>
#include <terrane/collision/world_query.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/ground_batch.h>

#include <span>

namespace terrane::internal {

/// Bounding box of a shape at a pose, world axes, rounded outwards: shapes that queries of shape_pairs.h say touch have
/// boxes that overlap. Of a compound, around the box of its parts in the body frame. NaN where the pose is not finite.
///
/// @param pose the rotation must be orthonormal to 1e-6
///
/// Cost: a support point along six directions for a hull, else constant
Aabb compute_aabb(const Shape& shape, const Pose& world_from_shape);

/// The same for every rotation about the shape's origin.
Aabb compute_rotating_aabb(const Shape& shape, const WorldPos& origin_world);

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

// Spatial queries over many bodies and the ground. The answers are those of a query of every body by itself.
//
// Threads:   any number at once, while no thread changes the scene
// Allocates: nothing
// Cost:      O(log n) for the bodies that the tree excludes, and the query of shape_pairs.h for each that is left

/// One body as queries read it.
struct QueryBody {
    const Shape* shape = nullptr;  ///< null: the slot has no body
    Pose world_from_shape;
    BodyId id;  ///< its index is the slot
    CollisionFilter filter;
    bool is_sensor = false;
    double friction = 0.0;
};

/// The bodies and the ground of a query.
struct QueryScene {
    std::span<const QueryBody> bodies;  ///< [slots]
    const BodyTree* tree = nullptr;     ///< of their compute_aabb(), or of larger boxes; not null
    const Ground* ground = nullptr;     ///< null: none
    const RayFan* fan = nullptr;        ///< of the ground, answers its rays; null: none
};

/// The first point of the segment `from` to `to` inside or on a body, or on the ground.
RayQueryAnswer query_ray(const QueryScene& scene, const WorldPos& from, const WorldPos& to,
                         const QueryFilter& filter);

/// The first contact of a moving shape.
CastQueryAnswer query_cast(const QueryScene& scene, const Shape& shape, const Motion& motion,
                           const QueryFilter& filter);

/// The bodies that a shape touches or overlaps, and whether it touches the ground.
OverlapQueryAnswer query_overlaps(const QueryScene& scene, const Shape& shape,
                                  const Pose& world_from_shape, const QueryFilter& filter,
                                  std::span<BodyId> bodies_out);

/// The body or the ground nearest to a shape.
///
/// @param max_distance limit of the search, metres, >= 0; infinity is allowed
NearestQueryAnswer query_nearest(const QueryScene& scene, const Shape& shape,
                                 const Pose& world_from_shape, double max_distance,
                                 const QueryFilter& filter);

}  // namespace terrane::internal
