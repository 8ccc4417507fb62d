// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/bodies.h>
#include <terrane/terrain/ground.h>

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// In the order of the names that --shape takes.
enum class DropShape { sphere, capsule, box, hull, compound, mixed };

struct DropLayout {
    DropShape shape = DropShape::sphere;
    double scale = 1.0;  ///< of all lengths: the shapes', between the starts, and from the ground
    std::size_t count = 1000;
    double speed = 0.0;  ///< downward at the start, m/s
    double spin = 0.0;   ///< rad/s, about an axis of the body's own
    std::uint64_t seed = 1;
};

/// Sphere of radius 0.5; capsule of radius 0.4 and half height 0.8; box of half extents 1, 2, 0.5; hull: a stone of six
/// corners; compound: a hammer, whose head is a box and whose handle is a capsule; each times the scale. Mixed takes
/// turns of the first three, by the body's index modulo 3.
Shape shape_of_body(const DropLayout& layout, std::size_t body);

/// The square around the terrain's centre that bodies start over, inside the extent.
WorldRect drop_area(const DropLayout& layout, const WorldRect& extent);

struct DroppedBody {
    BodySettings settings;
    BodyState state;
};

/// Bodies on a grid over drop_area(), moved and turned by a hash of seed and index, each clear above
/// the ground below it by 2 to 12 m, times the scale. The same arguments give the same bits. A place without ground is
/// left for another one of the area; fewer bodies than asked for come back where none is found.
///
/// Requires the area's ground to be resident.
std::vector<DroppedBody> lay_out(const DropLayout& layout, const Ground& ground);

}  // namespace terrane::tools
