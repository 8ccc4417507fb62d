// SPDX-License-Identifier: MIT
#include "ground/ray_walk.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane {
namespace {

// False for NaN.
bool is_place(const WorldPos& point_world) {
    return std::abs(point_world.x()) <= kFarthestPlace &&
           std::abs(point_world.y()) <= kFarthestPlace &&
           std::abs(point_world.z()) <= kFarthestPlace;
}

}  // namespace

RayAnswer Ground::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    return ray_after(0.0, from_world, to_world);
}

RayAnswer Ground::ray_after(double fraction, const WorldPos& from_world,
                            const WorldPos& to_world) const {
    RayAnswer answer;
    if (!is_place(from_world) || !is_place(to_world)) return answer;
    const Eigen::Vector3d displacement = to_world - from_world;
    answer.status = GroundStatus::miss;

    // clipped to the extent: only there is ground
    double enter = 0.0;
    double leave = 1.0;
    WorldPos start = from_world;
    if (!extent_.contains(from_world.x(), from_world.y()) ||
        !extent_.contains(to_world.x(), to_world.y())) {
        const std::array<double, 2> low{extent_.west, extent_.south};
        const std::array<double, 2> high{extent_.east, extent_.north};
        for (int axis = 0; axis < 2; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            if (displacement[axis] == 0.0) {
                if (from_world[axis] < low[a] || from_world[axis] > high[a]) leave = -1.0;
                continue;
            }
            const double t0 = (low[a] - from_world[axis]) / displacement[axis];
            const double t1 = (high[a] - from_world[axis]) / displacement[axis];
            enter = std::max(enter, std::min(t0, t1));
            leave = std::min(leave, std::max(t0, t1));
        }
        if (enter > leave) return answer;
        start = from_world + enter * displacement;
        start.x() = std::clamp(start.x(), extent_.west, extent_.east);
        start.y() = std::clamp(start.y(), extent_.south, extent_.north);
    }

    const bool is_above = fraction > enter;
    if (is_above && fraction >= leave) return answer;
    RayWalk ray(*this, start, displacement, is_above);
    ray.walk(is_above ? fraction - enter : 0.0, leave - enter);
    ray.answer(answer);
    if (answer.status != GroundStatus::ok) return answer;
    answer.fraction = std::clamp(enter + ray.t(), 0.0, 1.0);
    answer.point_world = from_world + answer.fraction * displacement;
    return answer;
}

}  // namespace terrane
