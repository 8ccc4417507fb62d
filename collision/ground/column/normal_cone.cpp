// SPDX-License-Identifier: MIT
#include "ground/column/normal_cone.h"

namespace terrane::internal {
namespace {

struct LatticeIndex {
    std::int64_t column = 0;
    std::int64_t row = 0;
};

}  // namespace

bool is_in_normal_cone(const LocalGround& local, const Triangle& triangle,
                       const Eigen::Vector3d& n) {
    // A neighbour counts as above the plane from this height on, metres.
    const double slack = 1e-10 * local.spacing();
    std::array<LatticeIndex, 3> top;
    std::size_t count = 0;
    const Eigen::Vector3d& a = triangle.v[0];
    const double highest = std::max({0.0, dot(n, triangle.v[1] - a), dot(n, triangle.v[2] - a)});
    Eigen::Vector3d point = a;
    for (const Eigen::Vector3d& v : triangle.v) {
        if (dot(n, v - a) < highest - slack) continue;
        point = v;
        top[count++] = {local.column_of(v[0]), local.row_of(v[1])};
    }
    if (count == 3) return true;
    const auto is_below = [&](const LatticeIndex& at) {
        Eigen::Vector3d p;
        return local.find_vertex(at.column, at.row, p) && dot(n, p - point) <= slack;
    };
    if (count == 2) {
        const std::int64_t dx = top[1].column - top[0].column;
        const std::int64_t dy = top[1].row - top[0].row;
        if (dx != 0 && dy != 0) {  // the diagonal of a cell
            return is_below({top[0].column + dx, top[0].row}) &&
                   is_below({top[0].column, top[0].row + dy});
        }
        // A side of two cells: each triangle's third corner lies across from the odd end.
        const bool first_is_odd = ((top[0].column + top[0].row) & 1) != 0;
        const LatticeIndex odd = first_is_odd ? top[0] : top[1];
        const LatticeIndex low{std::min(top[0].column, top[1].column),
                               std::min(top[0].row, top[1].row)};
        const std::int64_t across_x = dx == 0 ? 1 : 0;
        const std::int64_t across_y = dy == 0 ? 1 : 0;
        return local.is_ground(low.column, low.row) &&
               local.is_ground(low.column - across_x, low.row - across_y) &&
               is_below({odd.column + across_x, odd.row + across_y}) &&
               is_below({odd.column - across_x, odd.row - across_y});
    }
    const LatticeIndex at = top[0];
    const bool is_even = ((at.column + at.row) & 1) == 0;
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
        for (std::int64_t dx = -1; dx <= 1; ++dx) {
            if ((dx == 0 && dy == 0) || (dx != 0 && dy != 0 && !is_even)) continue;
            if (!is_below({at.column + dx, at.row + dy})) return false;
        }
    }
    return local.is_ground(at.column, at.row) && local.is_ground(at.column - 1, at.row) &&
           local.is_ground(at.column, at.row - 1) && local.is_ground(at.column - 1, at.row - 1);
}

}  // namespace terrane::internal
