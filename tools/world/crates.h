// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"
#include "world/placed_body.h"
#include "world/polyline.h"

#include <terrane/terrain/body_need.h>
#include <terrane/terrain/ground.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace CLI {
class App;
}

namespace terrane::tools {

/// Crates on and beside a path.
struct CrateLayout {
    Polyline path;
    std::size_t count = 0;
    std::uint64_t seed = 1;
    double start_radius = 0.0;  ///< of the disc around the path's start that stays free, metres
};

/// Adds --crates.
void add_crates_option(CLI::App& app, std::size_t& count);

/// The ground that lay_out_crates() needs, as needs for a pager; none without crates.
std::vector<BodyNeed> crate_needs(const CrateLayout& layout, const HeightSource& source);

/// Boxes with half extents of 0.2 to 0.5 m and 100 to 400 kg/m^3, at rest on the ground and free of each other and of
/// the bodies of `obstacles`. One in four is within 1 m of the path while there is room, the others within 5 m, or
/// farther where there are many. The same arguments give the same bits. Ground steeper than 25 degrees is used only
/// where there is no other.
///
/// Fails: exit_failed where ground is not resident or outside, or too little of it is free
CommandResult<std::vector<PlacedBody>> lay_out_crates(const CrateLayout& layout,
                                                      const Ground& ground, const World& obstacles);

}  // namespace terrane::tools
