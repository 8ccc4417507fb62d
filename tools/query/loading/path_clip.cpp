// SPDX-License-Identifier: MIT
#include "query/loading/path_clip.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::tools {

std::vector<WorldRect> cut_path(const WorldPos& from_world, const WorldPos& to_world, double reach,
                                double side, const WorldRect& extent) {
    const std::array<double, 2> low{extent.west - reach, extent.south - reach};
    const std::array<double, 2> high{extent.east + reach, extent.north + reach};
    const std::array<double, 2> from{from_world.x(), from_world.y()};
    const std::array<double, 2> displacement{to_world.x() - from_world.x(),
                                             to_world.y() - from_world.y()};
    double enter = 0.0;
    double leave = 1.0;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        if (displacement[axis] == 0.0) {
            if (from[axis] < low[axis] || from[axis] > high[axis]) return {};
            continue;
        }
        const double t0 = (low[axis] - from[axis]) / displacement[axis];
        const double t1 = (high[axis] - from[axis]) / displacement[axis];
        enter = std::max(enter, std::min(t0, t1));
        leave = std::min(leave, std::max(t0, t1));
    }
    if (enter > leave) return {};
    const double length = (leave - enter) * std::sqrt(displacement[0] * displacement[0] +
                                                      displacement[1] * displacement[1]);
    const double whole = std::max(1.0, std::ceil(length / side));
    const auto count =
        static_cast<std::size_t>(std::min(whole, static_cast<double>(kMostPathPieces)));
    std::vector<WorldRect> pieces;
    pieces.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double share = 1.0 / whole;
        const double t0 = enter + (leave - enter) * share * static_cast<double>(i);
        const double t1 = enter + (leave - enter) * share * static_cast<double>(i + 1);
        const double x0 = from[0] + t0 * displacement[0], x1 = from[0] + t1 * displacement[0];
        const double y0 = from[1] + t0 * displacement[1], y1 = from[1] + t1 * displacement[1];
        pieces.push_back({std::min(x0, x1) - reach, std::min(y0, y1) - reach,
                          std::max(x0, x1) + reach, std::max(y0, y1) + reach});
    }
    return pieces;
}

double distance_beside(const WorldPos& p_world, const WorldRect& rect) {
    const double x = std::max({rect.west - p_world.x(), 0.0, p_world.x() - rect.east});
    const double y = std::max({rect.south - p_world.y(), 0.0, p_world.y() - rect.north});
    return std::sqrt(x * x + y * y);
}

}  // namespace terrane::tools
