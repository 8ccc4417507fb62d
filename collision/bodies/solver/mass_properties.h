// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>

namespace terrane::internal {

/// Mass of a body in its own axes. An inverse inertia of 0 is a shape without size around that axis:
/// its spin never changes. An inverse mass of 0 is a body that nothing moves.
struct MassProperties {
    double inverse_mass = 1.0;
    Eigen::Vector3d inertia = Eigen::Vector3d::Zero();
    Eigen::Vector3d inverse_inertia = Eigen::Vector3d::Zero();
};

/// Mass properties of a solid of uniform density that is centred: see make_centred(). A shape without volume has its
/// mass on its surface, one without a surface on its line. A compound is the sum of its parts, overlaps
/// counted twice; beside solid parts flat ones weigh nothing.
///
/// Cost: linear in the faces of a hull and in the parts of a compound
MassProperties make_mass_properties(const Shape& shape, double mass);

/// A shape whose centre of mass is its origin, and whose axes are those of its inertia: what bodies turn about.
struct CentredShape {
    Shape shape;
    Pose
        body_from_centred;  ///< identity where the shape was centred already: then it shares what was made
};

/// Fails with invalid_argument where a hull or compound reaches too far from its centre of mass to be one.
///
/// Allocates: a hull or compound that is not centred is made anew
Result<CentredShape> make_centred(const Shape& shape);

/// A body's pose as that of its centred shape, and back; the same bits where the one is the other.
Pose to_centred(const Pose& world_from_body, const Pose& body_from_centred);
Pose from_centred(const Pose& world_from_centred, const Pose& body_from_centred);

}  // namespace terrane::internal
