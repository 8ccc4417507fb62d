// SPDX-License-Identifier: MIT
#pragma once

#include "world/queries/body_tree.h"

#include <terrane/collision/motion.h>
#include <terrane/collision/shapes.h>
#include <terrane/collision/world_query.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/ray_fan.h>

#include <span>

// Spatial queries over many bodies and the ground. The answers are those of a query of every body by itself.
//
// Threads:   any number at once, while no thread changes the scene
// Allocates: nothing
// Cost:      O(log n) for the bodies that the tree excludes, and the query of shape_pairs.h for each that is left
namespace terrane::internal {

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
