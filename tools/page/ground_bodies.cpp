// SPDX-License-Identifier: MIT
// Sources: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (positions
//          of bodies).
#include "page/ground_bodies.h"

#include <algorithm>
#include <cmath>

namespace terrane::tools {

WorldPos GroundBodies::place(std::size_t body, const CameraPose& camera) const {
    constexpr double kSide = 300.0;  // metres
    const auto i = static_cast<double>(body);
    const Eigen::Vector2d share(0.5 + 0.7548776662466927 * i, 0.5 + 0.5698402909980532 * i);
    const Eigen::Vector2d from_middle =
        share - share.array().floor().matrix() - Eigen::Vector2d(0.5, 0.5);
    const Eigen::Vector2d p = camera.eye_world.head<2>() + kSide * from_middle;
    return {p.x(), p.y(), source_->height(p.x(), p.y()) + kRadius};
}

std::vector<BodyNeed> GroundBodies::needs(const CameraPose& camera) const {
    constexpr double kStep = 1.0 / 64.0;  // seconds
    CameraPose next = camera;
    next.eye_world += kStep * camera.velocity;
    std::vector<BodyNeed> needs;
    needs.reserve(count_);
    for (std::size_t body = 0; body < count_; ++body) {
        const WorldPos now = place(body, camera);
        needs.push_back({.centre_world = now,
                         .velocity = (place(body, next) - now) / kStep,
                         .radius = kRadius});
    }
    return needs;
}

std::vector<BodyMoment> GroundBodies::trajectory(std::size_t body, std::span<const PathMoment> path,
                                                 double clock) const {
    std::vector<BodyMoment> trajectory;
    trajectory.reserve(path.size());
    for (const PathMoment& moment : path) {
        trajectory.push_back({clock + moment.time, place(body, moment.pose)});
    }
    return trajectory;
}

bool has_ground(const ResidentSet& resident, int level, const WorldPos& centre_world,
                double radius) {
    const Lattice& lattice = resident.lattice();
    const WorldRect& extent = resident.extent();
    const double west = std::max(centre_world.x() - radius, extent.west);
    const double east = std::min(centre_world.x() + radius, extent.east);
    const double south = std::max(centre_world.y() - radius, extent.south);
    const double north = std::min(centre_world.y() + radius, extent.north);
    if (west > east || south > north) return true;
    const double side = lattice.level_spacing(level) * kChunkCells;
    const auto index = [side](double place, double origin) {
        return static_cast<std::int32_t>(std::floor((place - origin) / side));
    };
    for (std::int32_t y = index(south, lattice.origin_y); y <= index(north, lattice.origin_y);
         ++y) {
        for (std::int32_t x = index(west, lattice.origin_x); x <= index(east, lattice.origin_x);
             ++x) {
            const ChunkKey key{x, y, static_cast<std::uint8_t>(level)};
            // on the edge of the extent the chunk may lie beyond the world
            if (lattice.contains(key) && resident.find(key) == ResidentSet::kNone) return false;
        }
    }
    return true;
}

}  // namespace terrane::tools
