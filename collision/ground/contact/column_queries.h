// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/ground_contact.h>

// The queries of ground_contact.h against the heightfield alone: the solid below its triangles.
namespace terrane::internal::columns {

ContactAnswer find_contacts(const Shape& shape, const Pose& world_from_shape, const Ground& ground,
                            double margin, std::span<Contact> contacts_out);
DistanceAnswer signed_distance(const Shape& shape, const Pose& world_from_shape,
                               const Ground& ground, double max_distance);
LiftAnswer compute_lift(const Shape& shape, const Pose& world_from_shape, const Ground& ground);
TestAnswer test_contact(const Shape& shape, const Pose& world_from_shape, const Ground& ground);

}  // namespace terrane::internal::columns
