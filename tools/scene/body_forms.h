// SPDX-License-Identifier: MIT
#pragma once

#include "scene/mesh_files.h"

#include <terrane/base/math.h>
#include <terrane/collision/body.h>

#include <vector>

namespace terrane::tools {

/// A wooden crate with the size of a box: a frame of boards around recessed planks with a diagonal, by a texture that
/// all crates share. 156 triangles.
MeshModel make_crate_form(const Eigen::Vector3d& half_extents);

/// Meshes of a walker, each in the frame of its joint, and drawn at a pose of character_part_poses(): trunk with head
/// and hat; left and right thigh, shin with boot, upper arm, forearm. They fill the height of the capsule to 2 %.
struct CharacterForm {
    std::vector<MeshModel> parts;
};
CharacterForm make_character_form(const CharacterSettings& settings);

/// World poses of the parts of a CharacterForm in a step of a walk. The lower sole stands on the capsule's lower end;
/// the head is between 7 % of the half height below its upper end and 1 % above.
///
/// @param world_from_capsule x forward, z up, the origin in the capsule's middle
/// @param walked             distance walked, metres: the phase of the walk
/// @param speed              m/s: small steps below 1.2 m/s; standing at 0
std::vector<Pose> character_part_poses(const CharacterSettings& settings,
                                       const Pose& world_from_capsule, double walked, double speed);

/// What a character's form shows beside the pose of its body: the direction in which it faces, and how far it has
/// walked.
struct CharacterGait {
    Eigen::Vector2d heading = Eigen::Vector2d::UnitX();  ///< unit, world axes
    double walked = 0.0;                                 ///< metres on its feet

    /// Adds the distance walked in a step of dt seconds.
    void walk(const CharacterState& state, double dt);
    /// walk(), and turns towards the wanted velocity, with a lag.
    void follow(const CharacterState& state, const CharacterControls& controls, double dt);
    /// The pose of the capsule of the form: x forward, z up.
    Pose world_from_capsule(const WorldPos& centre_world) const;
};

}  // namespace terrane::tools
