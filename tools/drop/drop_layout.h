// SPDX-License-Identifier: MIT
#pragma once

#include "world/placed_body.h"

#include <terrane/terrain/ground.h>

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// In the order of the names of --shape; `file` is DropLayout::file_shape.
enum class DropShape { sphere, capsule, box, hull, compound, mixed, file };

struct DropLayout {
    DropShape shape = DropShape::sphere;
    double scale =
        1.0;  ///< of all lengths: shapes, distances of the starts, heights above the ground
    std::optional<Shape> file_shape = {};  ///< of a mesh file, scaled already
    std::size_t count = 1000;
    double speed = 0.0;  ///< downward at the start, m/s
    double spin = 0.0;   ///< rad/s, about a random axis of each body
    std::uint64_t seed = 1;
    std::optional<WorldVec2> start = {};  ///< middle of the square, metres; absent: the extent's
};

/// Sphere of radius 0.5; capsule of radius 0.4 and half height 0.8; box of half extents 1, 2, 0.5; hull: a stone of six
/// corners; compound: a hammer, whose head is a box and whose handle is a capsule; each times the scale. Mixed
/// alternates the first three, by the body's index modulo 3.
Shape shape_of_body(const DropLayout& layout, std::size_t body);

/// The square around the start that bodies start above, clipped to the extent.
WorldRect drop_area(const DropLayout& layout, const WorldRect& extent);

/// Bodies on a grid over drop_area(), shifted and rotated by a hash of seed and index, each 2 to 12 m (times the
/// scale) above the ground below it. The same arguments give the same bits. A body without ground below it, or in the
/// place of a body of `obstacles`, is placed elsewhere in the area, and left out where kTries positions are not better.
///
/// Requires the area's ground to be resident.
std::vector<PlacedBody> lay_out(const DropLayout& layout, const Ground& ground,
                                const World& obstacles);

}  // namespace terrane::tools
