// SPDX-License-Identifier: MIT
#include "batch/array_checks.h"

#include <limits>
#include <string>

namespace terrane::internal {
namespace {

Result<void> check_coordinate(const char* name, const char* coordinate, const PointArray& points,
                              std::size_t length) {
    constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max();
    const std::size_t steps = points.count - 1;
    const bool is_countable = points.stride == 0 || steps <= (kMost - 1) / points.stride;
    const std::size_t least = is_countable ? steps * points.stride + 1 : kMost;
    if (length >= least) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + "." + coordinate + " must have at least " +
                    std::to_string(least) + " numbers for " + std::to_string(points.count) +
                    " points with stride " + std::to_string(points.stride) + ", has " +
                    std::to_string(length));
}

}  // namespace

Result<void> check_points(const char* name, const PointArray& points, bool has_heights) {
    if (points.count == 0) return {};
    if (auto ok = check_coordinate(name, "x", points, points.x.size()); !ok) return ok;
    if (auto ok = check_coordinate(name, "y", points, points.y.size()); !ok) return ok;
    return has_heights ? check_coordinate(name, "z", points, points.z.size()) : Result<void>{};
}

Result<void> check_length(const char* name, std::size_t length, std::size_t count,
                          std::size_t per_item) {
    if (length == 0 || (length % per_item == 0 && length / per_item == count)) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + " must be empty or have " + std::to_string(per_item) +
                    (per_item == 1 ? " entry" : " entries") + " for each of " +
                    std::to_string(count) + " items, has " + std::to_string(length));
}

}  // namespace terrane::internal
