// SPDX-License-Identifier: MIT
#include "scene/culling/random_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane::test {

View random_view(Random& random, const WorldPos& near_world) {
    View view;
    view.eye_world = near_world + random.between(0.0, 30.0) * random.direction();
    const Eigen::Matrix3d rotation = random.rotation();
    view.forward = rotation.col(0);
    view.up = rotation.col(1);
    view.vertical_fov = random.between(0.017, 2.97);
    view.width_px = 1 + random.below(2000);
    view.height_px = 1 + random.below(2000);
    return view;
}

Eigen::Vector3d any_perpendicular(const Eigen::Vector3d& direction, Random& random) {
    for (;;) {
        const Eigen::Vector3d square = direction.cross(random.direction());
        if (square.norm() > 0.1) return square.normalized();
    }
}

OrientedBox random_box(Random& random, const WorldPos& centre_world, double size) {
    OrientedBox box;
    box.frame_from_box = {random.rotation(), centre_world};
    for (int axis = 0; axis < 3; ++axis)
        box.half_extents[axis] = random.below(8) == 0 ? 0.0 : random.between(0.0, size);
    return box;
}

Projection project_to_box(const OrientedBox& box) {
    return [box](const Eigen::Vector3d& p) -> Eigen::Vector3d {
        const Pose& pose = box.frame_from_box;
        const Eigen::Vector3d local = pose.rotation.transpose() * (p - pose.translation);
        return pose * Eigen::Vector3d(local.cwiseMax(-box.half_extents).cwiseMin(box.half_extents));
    };
}

Projection project_to_ball(const BoundingSphere& ball) {
    return [ball](const Eigen::Vector3d& p) -> Eigen::Vector3d {
        const Eigen::Vector3d apart = p - ball.centre;
        const double distance = apart.norm();
        return distance <= ball.radius
                   ? p
                   : Eigen::Vector3d(ball.centre + apart * (ball.radius / distance));
    };
}

// The nearest of the three edges' nearest points and of the projection to the plane.
Projection project_to_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c) {
    return [corners = std::array<Eigen::Vector3d, 3>{a, b, c}](
               const Eigen::Vector3d& p) -> Eigen::Vector3d {
        Eigen::Vector3d best = corners[0];
        const auto take = [&](const Eigen::Vector3d& q) {
            if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
        };
        const Eigen::Vector3d normal =
            (corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized();
        const Eigen::Vector3d on_plane = p - normal * normal.dot(p - corners[0]);
        bool is_inside = normal.squaredNorm() > 0.5;
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d edge = corners[(i + 1) % 3] - corners[i];
            const double squared = edge.squaredNorm();
            const double share =
                squared > 0.0 ? std::clamp(edge.dot(p - corners[i]) / squared, 0.0, 1.0) : 0.0;
            take(corners[i] + share * edge);
            is_inside &= normal.dot(edge.cross(on_plane - corners[i])) >= 0.0;
        }
        if (is_inside) take(on_plane);
        return best;
    };
}

Projection project_to_view(const View& view, double far_distance) {
    struct HalfSpace {
        Eigen::Vector3d normal;
        double offset;
    };
    std::vector<HalfSpace> planes;
    for (const Eigen::Vector3d& normal : make_frustum(view).normals)
        planes.push_back({normal, normal.dot(view.eye_world)});
    if (std::isfinite(far_distance))
        planes.push_back({-view.forward, -view.forward.dot(view.eye_world) - far_distance});
    return [planes](const Eigen::Vector3d& p) -> Eigen::Vector3d {
        Eigen::Vector3d x = p;
        std::vector<Eigen::Vector3d> corrections(planes.size(), Eigen::Vector3d::Zero());
        for (int round = 0; round < 3000; ++round) {
            double moved = 0.0;
            for (std::size_t i = 0; i < planes.size(); ++i) {
                const Eigen::Vector3d y = x + corrections[i];
                const double at = planes[i].normal.dot(y) - planes[i].offset;
                const Eigen::Vector3d next = at < 0.0 ? y - planes[i].normal * at : y;
                corrections[i] = y - next;
                moved = std::max(moved, (next - x).norm());
                x = next;
            }
            if (moved < 1e-12) break;
        }
        return x;
    };
}

Apart are_apart(const Projection& a, const Projection& b, const Eigen::Vector3d& start) {
    Eigen::Vector3d p = start;
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d q = a(p);
        p = b(q);
        const double distance = (p - q).norm();
        if (distance < 1e-9) return Apart::no;
        // Steps shrink geometrically at worst like the square of the iteration: far from 0 they are final.
        if (before - distance < 1e-10 * distance && distance > 1e-5) return Apart::yes;
        before = distance;
    }
    return Apart::unknown;
}

}  // namespace terrane::test
