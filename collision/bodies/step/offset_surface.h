// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/rigid_body.h"
#include "bodies/step/ground_contact_cache.h"

#include <terrane/collision/ground_cast.h>

namespace terrane::internal {

/// The offset surface that a body moves against.
struct OffsetSurface {
    int index = 0;          ///< 0 is the highest
    bool is_mesh = false;   ///< beside volumes: the body shrinks by the offset
    double stop_gap = 0.0;  ///< casts stop at this gap, metres
    double clear_distance =
        0.0;  ///< every point may move this far without coming near the surface, metres
};

/// @param from index of the surface that the cache was refreshed for
OffsetSurface make_offset_surface(const RigidBody& body, const GroundContactCache& cache, int from,
                                  int index);

/// Index of the highest offset surface that the body does not penetrate; kOffsetCount where it penetrates all.
/// @param cache refreshed for surface 0
int first_clear_offset(const RigidBody& body, const GroundContactCache& cache);

/// Conservative swept test: true only if the box around the bounding sphere's sweep along a displacement is above all
/// ground below it, so that no rotation brings the body near the ground.
bool is_swept_sphere_clear(const RigidBody& body, const Ground& ground,
                           const Eigen::Vector3d& displacement);

enum class HitSearch {
    cast_rest,       ///< the rest of the displacement is cast: the hit is where the body touches
    stop_at_proved,  ///< the end of the proved part counts as a hit, unless nothing is proved
};

struct MoveAnswer {
    bool resident = true;
    bool hit = false;
    double fraction = 1.0;  ///< of the displacement that the body has moved
};

/// Moves a body by a displacement until it reaches the stop gap of the offset surface. Most displacements are proved
/// clear, the others are cast. The only function that changes the pose of a stepped body, except the recovery of one
/// that was placed too deep.
/// @param hits how a hit is searched for if only a part of the displacement is proved clear
MoveAnswer advance(RigidBody& body, const Ground& ground, const Twist& displacement,
                   OffsetSurface& surface, HitSearch hits = HitSearch::cast_rest);

/// Updates the cache and moves a body against the first offset surface that it is clear of. One that is too deep does
/// not move: step_body() recovers it.
MoveAnswer move_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                     const Twist& displacement);

/// Casts a shape against the first offset surface of bodies with this tolerance. The contact is in the frame of the
/// raised shape: kFirstOffset tolerances too high.
CastAnswer cast_wheel(const Shape& shape, const Motion& motion, const Ground& ground,
                      double tolerance);

}  // namespace terrane::internal
