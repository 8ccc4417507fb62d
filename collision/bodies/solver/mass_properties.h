// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>

namespace terrane::internal {

/// Mass of a body; inertia about its principal axes, kg m^2. An inverse inertia of 0: a shape without extent around
/// that axis, whose spin never changes. An inverse mass of 0: infinite mass.
struct MassProperties {
    double inverse_mass = 1.0;
    Eigen::Vector3d inertia = Eigen::Vector3d::Zero();
    Eigen::Vector3d inverse_inertia = Eigen::Vector3d::Zero();
};

/// Mass properties of a centred shape (see make_centred()) of uniform density. Shapes without volume have their mass on
/// their area, those without area on their length. A compound is the sum of its parts: overlaps count twice, and beside
/// solid parts flat ones have no mass.
///
/// Cost: linear in the faces of a hull and in the parts of a compound
MassProperties make_mass_properties(const Shape& shape, double mass);

/// A shape whose origin is its centre of mass and whose axes are its principal axes.
struct CentredShape {
    Shape shape;
    Pose
        body_from_centred;  ///< identity where the shape was centred already: then it shares its data
};

/// Fails with invalid_argument where a hull or compound reaches farther from its centre of mass than create() allows.
///
/// Allocates: a copy of a hull or compound that is not centred
Result<CentredShape> make_centred(const Shape& shape);

/// The pose of a body's centred shape, and back; bit for bit the same pose where body_from_centred is the identity.
Pose to_centred(const Pose& world_from_body, const Pose& body_from_centred);
Pose from_centred(const Pose& world_from_centred, const Pose& body_from_centred);

}  // namespace terrane::internal
