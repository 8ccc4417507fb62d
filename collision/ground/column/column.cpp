// SPDX-License-Identifier: MIT
// Sources: S. Gottschalk, M. Lin, D. Manocha. OBBTree. SIGGRAPH 1996 (separating axes).
// Deviations: a column has no bottom, so that only axes with z >= 0 count; its sides add the cross products of the
//             vertical with the box's edges.
#include "ground/column/column.h"

#include "base/vector_math.h"
#include "ground/column/round_column.h"
#include "ground/frame/triangle_plane.h"

namespace terrane::internal {
namespace {

double compute_box_lift(const LocalShape& box, const Triangle& triangle, double floor) {
    const TrianglePlane plane(triangle);
    const Eigen::Vector3d lowest = box.deepest_point(triangle.normal);
    if (is_over(lowest, triangle)) return plane.above(lowest);
    double lift = -kInfinity;
    // The vertical through each corner of the triangle, cut by the box's slabs.
    for (const Eigen::Vector3d& v : triangle.v) {
        double low = -kInfinity;
        double high = kInfinity;
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d& axis = box.axes[static_cast<std::size_t>(i)];
            // |level + axis z * z| <= half, z counted from v
            const double level = dot(axis, v - box.centre);
            if (axis[2] == 0.0) {
                if (std::abs(level) > box.half[i]) high = -kInfinity;
                continue;
            }
            const double z0 = (-box.half[i] - level) / axis[2];
            const double z1 = (box.half[i] - level) / axis[2];
            low = std::max(low, std::min(z0, z1));
            high = std::min(high, std::max(z0, z1));
        }
        if (low <= high) lift = std::max(lift, -low);
    }
    // The edges of the box's underside, clipped to the triangle seen from above. No point of an edge is further below
    // the plane than its ends.
    std::array<double, 8> below;
    for (int k = 0; k < 8; ++k) below[static_cast<std::size_t>(k)] = plane.above(box.corner(k));
    for (int i = 0; i < 3; ++i) {
        const int j0 = (i + 1) % 3;
        const int j1 = (i + 2) % 3;
        for (int k = 0; k < 8; ++k) {
            if ((k >> i & 1) != 0) continue;
            const double at_from = below[static_cast<std::size_t>(k)];
            const double at_to = below[static_cast<std::size_t>(k | 1 << i)];
            if (!(std::max(at_from, at_to) > std::max(floor, lift))) continue;
            // An edge between two faces that point up is not on the underside.
            const auto points_up = [&](int j) {
                const double z = box.axes[static_cast<std::size_t>(j)][2];
                return (k >> j & 1) != 0 ? z > 0.0 : z < 0.0;
            };
            if (points_up(j0) && points_up(j1)) continue;
            const Eigen::Vector3d from = box.corner(k);
            const Eigen::Vector3d to = box.corner(k | 1 << i);
            double first = 0.0;
            double last = 1.0;
            for (std::size_t j = 0; j < 3; ++j) {
                const double d0 = left_of(triangle.v[j], triangle.v[(j + 1) % 3], from);
                const double d1 = left_of(triangle.v[j], triangle.v[(j + 1) % 3], to);
                if (d0 < 0.0 && d1 < 0.0)
                    last = -1.0;
                else if (d0 < 0.0)
                    first = std::max(first, d0 / (d0 - d1));
                else if (d1 < 0.0)
                    last = std::min(last, d0 / (d0 - d1));
            }
            if (first > last) continue;
            const Eigen::Vector3d edge = 2.0 * box.half[i] * box.axes[static_cast<std::size_t>(i)];
            lift =
                std::max({lift, plane.above(from + first * edge), plane.above(from + last * edge)});
        }
    }
    return lift;
}

}  // namespace

bool find_direction(const ClosestPair& pair, Eigen::Vector3d& n_out) {
    // Below this distance the direction between the closest points is rounding noise.
    constexpr double kTiny = 1e-9;
    if (!(pair.distance > kTiny)) return false;
    const Eigen::Vector3d direction = (pair.on_shape - pair.on_triangle) / pair.distance;
    return direction[2] >= -kTiny && make_escape_direction(direction, n_out);
}

bool find_core_direction(const LocalShape& shape, const Triangle& triangle,
                         Eigen::Vector3d& n_out) {
    return find_direction(find_closest_core(shape.centre, shape.core, triangle), n_out);
}

Separation find_separation(const LocalShape& shape, const Triangle& triangle, bool with_walls) {
    Separation best;
    const auto take = [&best](const Eigen::Vector3d& n, double gap) {
        if (gap > best.gap) best = {n, gap};
    };
    visit_tops(shape, triangle, take);
    if (with_walls) visit_walls(shape, triangle, take);
    return best;
}

double compute_column_lift(const LocalShape& shape, const Triangle& triangle, double floor) {
    if (shape.kind == ShapeKind::box) return compute_box_lift(shape, triangle, floor);
    if (shape.kind == ShapeKind::round) return compute_round_lift(shape, triangle);
    return compute_hull_lift(*shape.hull, shape.centre, triangle, floor);
}

}  // namespace terrane::internal
