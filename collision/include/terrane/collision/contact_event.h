// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/body_id.h>
#include <terrane/terrain/math.h>

#include <cstdint>

namespace terrane {

/// What a step did to a contact of two bodies, or of a body with the ground.
enum class ContactPhase : std::uint8_t {
    began,   ///< they touch, and did not after the step before
    stayed,  ///< they touch, and did so after the step before
    ended,   ///< they do not touch any more, or one has been removed
};

/// A contact of a body with another body, or with the ground, in a step.
struct ContactEvent {
    BodyId a{};                                ///< the body of the lower index
    BodyId b{};                                ///< the other one; of the ground: none
    ContactPhase phase = ContactPhase::began;  ///< whether the contact began, lasts or ended
    bool is_sensor = false;  ///< one of them is a sensor: there are no points and no impulse
    /// Of the contact on `a` over the step, friction included, N s. Separation of overlaps has none.
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, into `a`, of the deepest point
    std::uint32_t first_point = 0;                      ///< see World::contact_points()
    std::uint32_t point_count = 0;  ///< points of this contact, from first_point on

    /// Whether it is a contact with the ground.
    bool is_ground() const { return !b.is_valid(); }
};

/// A point of a contact, as found in the last collision step.
struct ContactPoint {
    WorldPos point_world = WorldPos::Zero();            ///< on body `a`
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, into body `a`
    double gap = 0.0;                                   ///< metres; negative: overlap
};

}  // namespace terrane
