// SPDX-License-Identifier: MIT
// Sources: G. van den Bergen. Ray casting against general convex objects with application to continuous
//          collision detection. 2004 (the motion is clipped by the planes between closest points).
// Deviations: the first plane is the triangle's, which excludes most columns.
#include "ground/cast/column_entry.h"

#include "base/vector_math.h"

#include <algorithm>

namespace terrane::internal {
namespace {

constexpr double kNear = 16.0;  // tolerances: at smaller gaps directions are refined

// The direction of the distance between a shape and a column; false where all candidate axes must be tested.
bool find_widest(const LocalShape& shape, const Eigen::Vector3d& centre, const Triangle& triangle,
                 double ground_offset, Eigen::Vector3d& n_out) {
    if (shape.kind == ShapeKind::round) {
        return find_direction(find_closest_core(centre, shape.core, triangle), n_out);
    }
    return ground_offset == 0.0 &&
           find_direction(find_closest_in_column(*shape.hull, centre, triangle), n_out);
}

ColumnEntry find_curved_entry(const LocalShape& shape, const Eigen::Vector3d& velocity,
                              const Triangle& triangle, double tolerance, double ground_offset,
                              double from, double limit) {
    constexpr int kSteps =
        200;  // reached only by grazing within the tolerance, which counts as a hit then
    double time = 0.0;
    // At that time: the largest gap, and for how long the best plane separates.
    double widest = -kInfinity;
    double wait = -kInfinity;
    Eigen::Vector3d normal = triangle.normal;
    const auto test_plane = [&](const Eigen::Vector3d& n, double gap_at_start) {
        const double closing = -dot(n, velocity);
        const double gap = gap_at_start - time * closing;
        if (gap > widest) {
            widest = gap;
            normal = n;
        }
        if (gap < 0.0) return;
        const double rest = std::min(0.125 * tolerance, 0.5 * gap);
        wait = std::max(wait, closing > 0.0 ? (gap - rest) / closing : kInfinity);
    };
    const auto test_top = [&](const Eigen::Vector3d& n, double gap) {
        test_plane(n, gap + ground_offset);
    };
    test_top(triangle.normal, gap_along(triangle.normal, shape, triangle));
    if (!(wait < limit)) return {};
    if (widest > 0.25 * tolerance) {
        time = wait;
        if (shape.kind == ShapeKind::round && ground_offset < shape.radius) {
            // The common case: an end meets the face.
            const double side = dot(triangle.normal, shape.core) > 0.0 ? -1.0 : 1.0;
            const Eigen::Vector3d end = shape.centre + time * velocity + side * shape.core;
            if (is_foot_inside(end, triangle)) return {time, triangle.normal};
        }
    }
    time = std::max(time, from);
    for (int i = 0; i < kSteps && time < limit; ++i) {
        widest = wait = -kInfinity;
        const Eigen::Vector3d centre = shape.centre + time * velocity;
        Eigen::Vector3d n;
        if (find_widest(shape, centre, triangle, ground_offset, n)) {
            test_top(n, gap_along(n, shape, triangle));
            if (shape.kind == ShapeKind::hull && widest <= kNear * tolerance) {
                // On a cliff the rounding of the direction matters: make it perpendicular to the edge.
                visit_perpendicular_to_edges(triangle, n, [&](const Eigen::Vector3d& m) {
                    test_top(m, gap_along(m, shape, triangle));
                });
            }
        } else {
            LocalShape moved = shape;
            moved.centre = centre;
            const auto test_moved = [&](const Eigen::Vector3d& m, double gap) {
                test_plane(m, gap - time * dot(m, velocity));
            };
            visit_tops(moved, triangle, [&](const Eigen::Vector3d& m, double gap) {
                test_moved(m, gap + ground_offset);
            });
            visit_walls(moved, triangle, [&](const Eigen::Vector3d& m, double gap) {
                if (is_touching_wall(gap) && dot(m, velocity) <= 0.0) return;
                test_moved(m, gap);
            });
        }
        if (!(time + wait < limit)) return {};
        if (widest <= 0.25 * tolerance) return {time, normal};
        time += wait;
    }
    if (!(time < limit)) return {};
    return {time, normal};
}

}  // namespace

ColumnEntry find_entry(const LocalShape& shape, const Eigen::Vector3d& velocity,
                       const Triangle& triangle, double tolerance, double ground_offset,
                       double from, double limit) {
    if (shape.kind == ShapeKind::box) {
        return find_box_entry(shape, velocity, triangle, tolerance, ground_offset, limit);
    }
    return find_curved_entry(shape, velocity, triangle, tolerance, ground_offset, from, limit);
}

}  // namespace terrane::internal
