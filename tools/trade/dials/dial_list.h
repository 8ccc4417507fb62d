// SPDX-License-Identifier: MIT
#pragma once

#include "trade/table/dial.h"

#include <string>
#include <vector>

namespace terrane::tools {

/// Budget, target, morph ratio: pixels against triangles and time; presets, which set these and others.
std::vector<Dial> pixel_dials();
/// Contact spacing, contact tolerance: metres against time.
std::vector<Dial> contact_dials();
/// Length of a step, length of a substep: penetration and drift against time.
std::vector<Dial> step_dials();
/// Memory, storage, horizon, contact share: late frames and excess error against bytes.
std::vector<Dial> paging_dials();
/// Tests, lifts, pseudodistances and distances, of shapes and the ground and of two shapes: order against time.
std::vector<Dial> measure_dials();
/// Squares or roots, float or double: numbers against time.
std::vector<Dial> number_dials();
/// Extremal points by scan or climb; collision meshes from full to one hull.
std::vector<Dial> hull_dials();
/// Culling tests, triangles of object meshes.
std::vector<Dial> object_dials();
/// Broadphases, threads.
std::vector<Dial> crowd_dials();

/// All of these, in this order.
std::vector<Dial> all_dials();

/// The keys of all dials: names for --dial.
std::vector<std::string> dial_names();

}  // namespace terrane::tools
