// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/step/ground_contact_cache.h"
#include "bodies/solver/rigid_body.h"

#include <terrane/collision/ground_cast.h>

namespace terrane::internal {

/// How low the surface is for a piece of motion, and how near to it the motion ends.
struct Gate {
    int index = 0;
    double stop_gap = 0.0;
    double free_way = 0.0;  ///< how far every point may move without coming near it, metres
};

/// A gate for a body that was looked at from the gate `from`.
Gate make_gate(const RigidBody& body, const GroundLook& look, int from, int index);

/// The first gate that a body which was looked at from gate 0 is clear of; kGateCount where there is none.
int find_gate(const RigidBody& body, const GroundLook& look);

/// Whether a body that was looked at is deeper than any gate.
bool is_too_deep(const RigidBody& body, const GroundLook& look);

/// Whether a body cannot come near the ground in a time, seconds, however it turns: the box that its bounding sphere
/// sweeps is above all ground below it.
bool flies_high(const RigidBody& body, const Ground& ground, double duration);

struct MoveAnswer {
    bool resident = true;
    bool hit = false;
    double fraction = 1.0;  ///< of the way that was gone
};

/// Moves a body along a way until it would come too close to the lowered surface; most ways are proved to be clear of
/// it, the others are cast. Nothing else changes the pose of a body that is stepped, but what takes one out that was put
/// in too deep.
MoveAnswer advance(RigidBody& body, const Ground& ground, const Twist& way, Gate& gate);

/// Looks, and moves a body through the first gate that it is clear of. One that is too deep does not move: step_body()
/// takes it out.
MoveAnswer move_body(RigidBody& body, GroundLook& look, const Ground& ground, const Twist& way);

/// Casts a part of a body as the gate does: against the surface that is lowered for bodies of this
/// tolerance. The contact that comes back is raised by as much: see `contact_raise`.
CastAnswer cast_part(const Shape& shape, const Motion& motion, const Ground& ground,
                     double tolerance);
double contact_raise(double tolerance);

}  // namespace terrane::internal
