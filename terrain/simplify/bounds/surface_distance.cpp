// SPDX-License-Identifier: MIT
#include "simplify/bounds/surface_distance.h"

namespace terrane::internal {
namespace {

constexpr double kRoundedUpDistance = 1.0 + 0x1p-40;

}  // namespace

double largest_distance(const Corners& from, const Corners& to) {
    double largest = 0.0, size = 0.0;
    for (const Eigen::Vector3d& p : from) {
        largest = std::max(largest, distance_to_triangle(p, to));
        size = std::max(size, length(p - to[0]));
    }
    for (const Eigen::Vector3d& p : to) size = std::max(size, length(p - to[0]));
    return largest * kRoundedUpDistance + size * 0x1p-40;
}

}  // namespace terrane::internal
