// SPDX-License-Identifier: MIT
#pragma once

#include "support/input.h"

#include <terrane/collision/query.h>
#include <terrane/collision/shapes.h>
#include <terrane/terrain/ground.h>

namespace terrane::fuzz {

/// A shape that mostly is valid: sphere, capsule, box, hull of up to 12 points or compound of up to 4 parts, mostly of
/// sizes 0 to 8 m.
Shape take_shape(Input& input);
/// A sphere, capsule or box of 0.05 to 4 m.
Shape take_simple_shape(Input& input);
/// A pose that mostly is valid, mostly with a translation from `low` to `high`.
Pose take_pose(Input& input, double low, double high);
/// From a pose along a translation and a rotation of up to `reach` metres and a turn.
Motion take_motion(Input& input, double low, double high, double reach);

/// One of some difficult grounds over [0, 128]^2 with cells of 1 m: planes, stairs, spikes, walls, pits, rough. Made
/// once.
const Ground& take_ground(Input& input);

/// Whether all components are finite.
bool is_finite(const Eigen::Vector3d& v);
/// Whether a vector has length 1 to 1e-6.
bool is_unit(const Eigen::Vector3d& v);

}  // namespace terrane::fuzz
