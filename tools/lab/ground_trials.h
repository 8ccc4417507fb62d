// SPDX-License-Identifier: MIT
#pragma once

#include "program/command.h"
#include "scene/terrain_options.h"

#include <terrane/collision/shapes.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/ground.h>

#include <cstddef>
#include <vector>

namespace terrane::tools {

/// Loads the contact surface of the square of a terrain in which the dials place their bodies and queries.
///
/// @param contact_spacing as PagerSettings::contact_spacing
///
/// Fails: as Pager; exit_failed if heights could not be read
CommandResult<Ground> load_contact_ground(const Terrain& terrain, double contact_spacing);

/// A sphere near the ground, with its true contact state.
struct ProbePose {
    Pose pose;             ///< world_from_shape
    bool touches = false;  ///< whether a sampled point of the true surface is inside the sphere
};

/// Random poses of a sphere near the true surface, the same in every run. About half of them touch the surface,
/// according to samples of HeightSource::height(). Fewer than `count` if a terrain has little ground.
std::vector<ProbePose> probe_poses(const Terrain& terrain, const Sphere& sphere, std::size_t count);

/// A drop of spheres onto loaded ground.
struct DropTrial {
    std::size_t count = 100;         ///< spheres, radius 0.5 m, 1 kg
    double seconds = 1.0;            ///< simulated
    double dt = 1.0 / 60.0;          ///< of a step, seconds
    double contact_tolerance = 0.0;  ///< of a body, metres; 0: the default
    double speed = 10.0;             ///< downward at the start, m/s
    WorldSettings world{.collide_bodies = false};
};

/// Cost and errors of a drop.
struct DropFigures {
    double ms = 0.0;  ///< processor time of the calling thread in all steps, per simulated second
    double wall_ms = 0.0;       ///< the same in wall-clock time
    double max_depth_m = 0.0;   ///< deepest penetration of the contact surface
    double fell_through = 0.0;  ///< body steps that ended deeper than the tolerance
    /// All energy that bodies gained in steps, relative to all energy that they lost. Bodies that do not collide with
    /// each other have no source of energy, so that any gain is an error.
    double drift = 0.0;
};

/// Drops spheres over the centre of a ground: the same bodies in every run.
///
/// Fails: as World; exit_failed if no body finds ground
CommandResult<DropFigures> run_drop_trial(const DropTrial& trial, const Ground& ground);

}  // namespace terrane::tools
