// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/ground.h>

#include <cstddef>

namespace terrane::tools {

/// A drop of spheres onto loaded ground.
struct DropTrial {
    std::size_t count = 100;         ///< spheres, radius 0.5 m, 1 kg
    double seconds = 1.0;            ///< simulated
    double dt = 1.0 / 60.0;          ///< of a step, seconds
    double contact_tolerance = 0.0;  ///< of a body, metres; 0: the default
    double speed = 10.0;             ///< downward at the start, m/s
    WorldSettings world{.collide_bodies = false};
};

/// What a drop costs, and what it gets wrong.
struct DropFigures {
    double ms = 0.0;            ///< of the calling thread in all steps, a simulated second
    double wall_ms = 0.0;       ///< the same by the clock on the wall
    double max_depth_m = 0.0;   ///< deepest penetration of the contact surface
    double fell_through = 0.0;  ///< body steps deeper than their tolerance
    /// Energy that bodies gained in steps, over what they lost in all. Where they do not collide with each other,
    /// nothing gives them energy, and it is an error.
    double drift = 0.0;
};

/// Drops spheres above the middle of a ground: the same bodies in every run.
///
/// Fails: as World; exit_failed where no body finds ground
CommandResult<DropFigures> run_drop_trial(const DropTrial& trial, const Ground& ground);

}  // namespace terrane::tools
