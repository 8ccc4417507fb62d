// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/body_queries.h"
#include "world/solver/ground_gate.h"
#include "world/vehicle/drive_forces.h"

#include <terrane/collision/body.h>

#include <span>
#include <vector>

namespace terrane::internal {

/// Fails with invalid_argument if a field is out of range; the message names the field.
Result<void> check_character(const CharacterSettings& settings);

/// The state of a character beyond the body of its capsule.
class Character {
public:
    explicit Character(const CharacterSettings& settings);

    const CharacterSettings& settings() const { return settings_; }
    const CharacterControls& controls() const { return controls_; }
    const CharacterState& state() const { return state_; }
    const FootDrive& feet() const { return feet_; }

    /// Ignores controls that are not finite or out of range. Returns whether the controls changed.
    bool set_controls(const CharacterControls& controls);
    /// Whether the character may fall asleep: no motion is commanded.
    bool is_idle() const { return controls_.velocity.isZero(0.0) && controls_.jump_speed == 0.0; }

    /// Data that a character reads of its world.
    struct Scene {
        const QueryScene& query;
        std::span<const RigidBody> bodies;  ///< [slots]
        BodyId self;
    };

    /// @param acceleration of the step, m/s^2
    void begin_step(const Eigen::Vector3d& acceleration) { acceleration_ = acceleration; }
    /// Finds the support and applies the controls for a collision step: foot drive, jump and air control.
    void begin_collision_step(RigidBody& body, const Scene& scene, double duration);
    /// Whether a standing character is blocked (moved less than its controls demand) or still climbs a step.
    /// @param before position before the collision step
    bool is_stopped(const RigidBody& body, const WorldPos& before, double duration) const;
    /// Steps up if a character that is_stopped() can stand higher up.
    void end_collision_step(RigidBody& body, const Scene& scene, const WorldPos& before,
                            double duration);
    /// Serialises the fields that a copy with the same settings needs between two steps. See world/world_bytes.h.
    template <class Stream, class AnyCharacter>
    static void list_fields(Stream& stream, AnyCharacter& character) {
        constexpr double kMost = 1e4;
        stream.number("wanted velocity", character.controls_.velocity.x(), -kMost, kMost);
        stream.number("wanted velocity", character.controls_.velocity.y(), -kMost, kMost);
        stream.number("jump_speed", character.controls_.jump_speed, 0.0, kMost);
        stream.flag("stands", character.state_.stands);
        stream.word("support", character.state_.support.index);
        stream.word("its generation", character.state_.support.generation);
        stream.unit("normal", character.state_.normal);
        stream.flag("is stepping up", character.is_stepping_up_);
        stream.length("step height", character.step_height_);
    }
    /// Copies the state of the character's body.
    void show(const BodyState& body) { state_.body = body; }
    /// Resets the character and copies the state of its body, which was placed anew.
    void place(const BodyState& body);

private:
    /// A contact and the body that the character touches there.
    struct FootContact {
        SolverContact contact;
        std::uint32_t body;  // kNone: the ground
    };

    static double standing_gap(const RigidBody& body);
    void find_contacts(const RigidBody& body, const Scene& scene);
    const FootContact* find_support(const RigidBody& body) const;
    bool is_blocked(const RigidBody& body, const Eigen::Vector3d& direction) const;
    Eigen::Vector2d velocity_along_walls(const RigidBody& body, const Scene& scene) const;
    double foot_friction(const FootContact& support, const Scene& scene) const;
    MoveAnswer move(RigidBody& body, const Scene& scene, const Eigen::Vector3d& displacement);
    bool find_step(RigidBody& body, const Scene& scene, const Eigen::Vector3d& forward);

    CharacterSettings settings_;
    CharacterControls controls_;
    CharacterState state_;
    FootDrive feet_;
    Eigen::Vector3d acceleration_ = Eigen::Vector3d::Zero();
    GroundGate gate_;
    std::vector<FootContact> contacts_;  // of the last find_contacts()
    bool is_stepping_up_ = false;        // the last collision step ended below step_height_
    double step_height_ = 0.0;           // world z of the capsule's centre on the step
};

}  // namespace terrane::internal
