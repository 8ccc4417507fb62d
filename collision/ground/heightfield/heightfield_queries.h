// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/ground_queries.h>

// The queries of ground_queries.h against the heightfield alone: the solid below its triangles.
namespace terrane::internal::columns {

ContactAnswer find_contacts(const Shape& shape, const Pose& world_from_shape, const Ground& ground,
                            double margin, std::span<Contact> contacts_out);
DistanceAnswer signed_distance(const Shape& shape, const Pose& world_from_shape,
                               const Ground& ground, double max_distance);
LiftAnswer compute_lift(const Shape& shape, const Pose& world_from_shape, const Ground& ground);
TestAnswer test_contact(const Shape& shape, const Pose& world_from_shape, const Ground& ground);

/// cast() of ground_queries.h against the heightfield alone.
CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings);

}  // namespace terrane::internal::columns

namespace terrane::internal {

/// Swept separation test: true only if a shape stays farther than a margin from the ground throughout a short motion,
/// proved by one separating plane for each triangle in reach. False does not prove contact: it is also returned if a
/// plane would have to change during the motion, if cells in reach are not ground or not resident, and for rotations of
/// 0.5 rad or more.
///
/// @param margin metres, > 0
///
/// Cost: O(cells in reach); a fraction of the cost of a cast
bool is_sweep_clear(const Shape& shape, const Motion& motion, const Ground& ground, double margin);

}  // namespace terrane::internal
