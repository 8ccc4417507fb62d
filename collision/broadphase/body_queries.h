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

/// Bounding box of a shape at a pose, world axes, rounded outwards: shapes that touch according to shape_pairs.h have
/// overlapping boxes. For a compound, the box around the rotated body-frame box of its parts. NaN if the pose is not
/// finite.
///
/// @param world_from_shape its rotation must be orthonormal to within 1e-6
///
/// Cost: support points along six directions for a hull, else constant
Aabb compute_aabb(const Shape& shape, const Pose& world_from_shape);

/// Bounding box valid for every rotation about the shape's origin.
Aabb compute_rotating_aabb(const Shape& shape, const WorldPos& origin_world);

/// A straight sweep of a box, world axes, metres. A ray has a box without extent.
struct BoxSweep {
    WorldPos from =
        WorldPos::Zero();  ///< start of a reference point of the box, such as its centre
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
    Aabb reach;  ///< the box, relative to the reference point
};

/// Distance of two boxes, metres; minus infinity if they overlap or touch, infinity if one is empty. Up to rounding, a
/// lower bound of the signed distance of shapes inside them.
double box_separation(const Aabb& a, const Aabb& b);

/// Bounding volume tree over the boxes of bodies. Boxes for which is_box() is false are never visited.
///
/// Threads: any number at once while neither build() nor refit() runs
class BodyTree {
public:
    /// @param bounds [slots] around the body of each slot, world axes, metres
    ///
    /// Allocates: only if there are more slots than ever before
    /// Cost:      O(n log n)
    void build(std::span<const Aabb> bounds);

    /// Updates the boxes, including slots that gained or lost a box. Queries return the same as after build(), but take
    /// longer if bodies have moved far.
    ///
    /// @param bounds [slots] as many as passed to build()
    ///
    /// Cost: O(n)
    void refit(std::span<const Aabb> bounds);

    /// Number of slots.
    std::size_t slot_count() const { return boxes_.size(); }

    /// Calls visitor(slot) for each box that overlaps or touches a finite box, in no particular order.
    template <class Visitor>
    void visit_overlaps(const Aabb& box, const Visitor& visitor) const {
        visit_leaves(
            nodes_, [&](const Aabb& bounds) { return overlap(bounds, box, 0.0); }, visitor);
    }

    /// Calls visit(slot) for each box touched by the sweep up to the fraction `limit`, roughly nearest first; visit
    /// returns the new limit.
    template <class Visit>
    void visit_along(const BoxSweep& sweep, double limit, const Visit& visit) const {
        const auto entry = [&](const Aabb& bounds) {
            const Aabb widened{bounds.low - sweep.reach.high, bounds.high - sweep.reach.low};
            return segment_entry(sweep.from, sweep.displacement, widened, 0.0);
        };
        visit_leaves_up_to(nodes_, limit, entry, visit);
    }

    /// Calls visit(slot) for each box whose box_separation() is at most `limit`, roughly nearest first; visit returns
    /// the new limit.
    template <class Visit>
    void visit_near(const Aabb& box, double limit, const Visit& visit) const {
        visit_leaves_up_to(
            nodes_, limit, [&](const Aabb& bounds) { return box_separation(bounds, box); }, visit);
    }

private:
    void set_bounds(std::span<const Aabb> bounds);

    std::vector<Aabb> boxes_;  ///< [slots] empty for a slot without a body
    std::vector<std::uint32_t> order_;
    std::vector<AabbNode> nodes_;
};

// Spatial queries over many bodies and the ground. The answers equal those of testing every body individually.
//
// Threads:   any number at once, while no thread changes the scene
// Allocates: nothing
// Cost:      O(log n) for the bodies culled by the tree, plus one query of shape_pairs.h for each remaining body

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
    const BodyTree* tree = nullptr;     ///< over boxes that contain compute_aabb(); not null
    const Ground* ground = nullptr;     ///< null: none
    const RayFan* fan = nullptr;        ///< casts rays against the ground; null: none
};

/// First point of the segment `from` to `to` that is inside or on a body, or on the ground.
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
