// SPDX-License-Identifier: MIT
#include "drop/drop_layout.h"

#include "extent/world_extent.h"
#include "query/parsing/quaternion.h"
#include "world/body_random.h"

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace {

// At a scale of 1:
constexpr double kPlace =
    5.0;  // side of the grid square of each body, metres: more than the longest box
constexpr double kClearance = 2.0;  // least height of a start above the ground, metres
constexpr double kFurtherUp =
    10.0;  // range of start heights, metres, so that bodies do not all land at once
constexpr std::uint64_t kTries = 64;  // positions tried before a body is left out

/// Upper bound of the contact surface under a disc; absent where part of the disc has no ground.
std::optional<double> ground_below(const Ground& ground, double x, double y, double radius) {
    const CellRange cells{ground.column_at(x - radius), ground.row_at(y - radius),
                          ground.column_at(x + radius), ground.row_at(y + radius)};
    if (ground.height(x, y).status != GroundStatus::ok) return std::nullopt;
    const RangeAnswer range = ground.range(cells);
    if (range.status != GroundStatus::ok) return std::nullopt;
    return ground.lattice().quantum * static_cast<double>(range.high);
}

ConvexHull make_stone(double scale) {
    std::array<Eigen::Vector3d, 6> corners{{{1.2, 0.0, 0.1},
                                            {-0.9, 0.2, 0.0},
                                            {0.0, 1.0, -0.1},
                                            {0.1, -0.8, 0.0},
                                            {0.0, 0.1, 0.7},
                                            {0.0, 0.0, -0.6}}};
    for (Eigen::Vector3d& corner : corners) corner *= scale;
    return ConvexHull::create(corners).value();
}

Compound make_hammer(double scale) {
    std::array<CompoundPart, 2> parts{
        CompoundPart{Box{scale * Eigen::Vector3d(0.3, 0.8, 0.3)}, {}},
        CompoundPart{Capsule{.radius = 0.2 * scale, .half_height = 0.8 * scale}, {}}};
    parts[0].body_from_part.translation = {1.0 * scale, 0.0, 0.0};
    parts[1].body_from_part.rotation << 0.0, 0.0, 1.0,  //
        1.0, 0.0, 0.0,                                  //
        0.0, 1.0, 0.0;
    return Compound::create(parts).value();
}

}  // namespace

Shape shape_of_body(const DropLayout& layout, std::size_t body) {
    constexpr std::array kTurns{DropShape::sphere, DropShape::capsule, DropShape::box};
    const double scale = layout.scale;
    switch (layout.shape == DropShape::mixed ? kTurns[body % kTurns.size()] : layout.shape) {
        case DropShape::capsule:
            return Capsule{.radius = 0.4 * scale, .half_height = 0.8 * scale};
        case DropShape::box:
            return Box{.half_extents = {1.0 * scale, 2.0 * scale, 0.5 * scale}};
        case DropShape::hull:
            return make_stone(scale);
        case DropShape::compound:
            return make_hammer(scale);
        case DropShape::file:
            return layout.file_shape.value();
        case DropShape::sphere:
        case DropShape::mixed:
            break;
    }
    return Sphere{.radius = 0.5 * scale};
}

WorldRect drop_area(const DropLayout& layout, const WorldRect& extent) {
    double place = kPlace * layout.scale;
    if (layout.file_shape) place = std::max(place, 2.5 * bounding_radius(*layout.file_shape));
    const double side = place * std::ceil(std::sqrt(static_cast<double>(layout.count)));
    return square_around(layout.start.value_or(middle_of(extent)), side, extent);
}

std::vector<PlacedBody> lay_out(const DropLayout& layout, const Ground& ground,
                                const World& obstacles) {
    const WorldRect area = drop_area(layout, ground.extent());
    const auto columns =
        static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(layout.count))));
    const double place_x = (area.east - area.west) / static_cast<double>(columns);
    const double place_y = (area.north - area.south) / static_cast<double>(columns);
    std::vector<PlacedBody> bodies;
    for (std::size_t body = 0; body < layout.count; ++body) {
        BodyRandom random(layout.seed, body);
        PlacedBody dropped;
        dropped.settings.shape = shape_of_body(layout, body);
        const double radius = bounding_radius(dropped.settings.shape);
        const std::size_t row_index = body / columns;
        const auto column = static_cast<double>(body % columns);
        const auto row = static_cast<double>(row_index);
        double x = area.west + (column + random.unit()) * place_x;
        double y = area.south + (row + random.unit()) * place_y;
        Pose& pose = dropped.state.pose;
        bool is_placed = false;
        for (std::uint64_t i = 0; i <= kTries && !is_placed; ++i) {
            if (i > 0) {
                x = random.within(area.west, area.east);
                y = random.within(area.south, area.north);
            }
            const std::optional<double> below = ground_below(ground, x, y, radius);
            if (!below) continue;
            const double z =
                *below + radius + layout.scale * (kClearance + random.within(0.0, kFurtherUp));
            pose.translation = WorldPos(x, y, z);
            pose.rotation = matrix_from_quaternion(random.direction<4>());
            is_placed = is_free(obstacles, ground, dropped.settings.shape, pose);
        }
        if (!is_placed) continue;
        dropped.state.velocity = Eigen::Vector3d(0.0, 0.0, -layout.speed);
        const std::array<double, 3> axis = random.direction<3>();
        dropped.state.angular_velocity =
            Eigen::Vector3d(layout.spin * axis[0], layout.spin * axis[1], layout.spin * axis[2]);
        bodies.push_back(dropped);
    }
    return bodies;
}

}  // namespace terrane::tools
