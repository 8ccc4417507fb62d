// SPDX-License-Identifier: MIT
#pragma once

#include "trade/table/dial.h"

#include <terrane/collision/shapes.h>
#include <terrane/terrain/ground.h>

#include <vector>

namespace terrane::tools {

/// The square of a terrain that bodies and questions of the dials are in, metres.
WorldRect trade_area(const Terrain& terrain);

/// The contact surface of trade_area() and some metres around it, all of it resident.
///
/// @param contact_spacing as PagerSettings::contact_spacing
///
/// Fails: as Pager; exit_failed where heights could not be read
CommandResult<Ground> load_contact_ground(const Terrain& terrain, double contact_spacing);

/// A sphere near the ground, and what is true of it.
struct ProbePose {
    Pose pose;             ///< world_from_shape
    bool touches = false;  ///< a sampled point of the true surface is inside of the sphere
};

/// Random poses of a sphere near the true surface, about half of which touch it, and whether they do, from samples of
/// HeightSource::height(). The same in every run. Fewer than wanted where a terrain has little ground.
std::vector<ProbePose> probe_poses(const Terrain& terrain, const Sphere& sphere, std::size_t count);

/// The share of pairs of `order` that `keys` does not order alike; a pair that `keys` leaves equal counts. Pairs that
/// are equal in `order` are left out.
double disorder_share(const std::vector<double>& keys, const std::vector<double>& order);

}  // namespace terrane::tools
