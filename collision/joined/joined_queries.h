// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/mesh_sweep.h"

#include <terrane/collision/ground_contact.h>

namespace terrane::internal {

/// How deep a body lies in the joined surface beside volumes.
struct MeshDepth {
    bool is_missing = false;
    double depth =
        0.0;  ///< the least offset at which the shrunk body is separated, metres; 0 apart
};

/// Contacts of a body beside volumes, and how far it is away when it is shrunk.
struct MeshContactAnswer {
    ContactAnswer contacts;
    double distance = 0.0;  ///< MeshNearness::distance at the offset
    /// How fast each contact's gap grows with the offset, 0 to 1.
    std::array<double, 64> openings;
};

/// find_mesh_contacts() in world axes: complete, or truncated to the deepest.
MeshContactAnswer find_contacts_at_offset(const Shape& shape, const Pose& world_from_shape,
                                          const Ground& ground, double offset, double margin,
                                          double exact_below, std::span<Contact> contacts_out);

/// find_nearness() of a shape at a pose.
MeshNearness find_nearness_at(const Shape& shape, const Pose& world_from_shape,
                              const Ground& ground, double offset, double reach,
                              double exact_below);

MeshDepth measure_mesh_depth(const Shape& shape, const Pose& world_from_shape,
                             const Ground& ground);

/// Whether the bounding sphere of a body that moves by a displacement may meet triangles of volumes: is_near_volume()
/// of the box around its sweep.
bool may_meet_volume(const Ground& ground, const WorldPos& centre, double radius,
                     const Eigen::Vector3d& displacement = Eigen::Vector3d::Zero());

}  // namespace terrane::internal
