// SPDX-License-Identifier: MIT
#include "crowd/schemes/crowd_shapes.h"

#include <terrane/collision/compound.h>
#include <terrane/collision/convex_hull.h>
#include <terrane/collision/ground_cast.h>

#include <numbers>
#include <vector>

namespace terrane::tools {
namespace {

// Corners on one meridian, from pole to pole, without the poles.
std::vector<Eigen::Vector3d> meridian(const BallMesh& mesh, int number, double scale) {
    // Motion::at() gives the same bits on every machine; sin() and cos() do not.
    Motion tilt, turn;
    tilt.rotation_vector = Eigen::Vector3d(0.0, std::numbers::pi, 0.0);
    turn.rotation_vector = Eigen::Vector3d(0.0, 0.0, 2.0 * std::numbers::pi);
    const Pose around = turn.at(static_cast<double>(number) / (2 * mesh.rings));
    std::vector<Eigen::Vector3d> corners;
    for (int ring = 1; ring <= mesh.rings; ++ring) {
        const Pose down = tilt.at(static_cast<double>(ring) / (mesh.rings + 1));
        Eigen::Vector3d corner = mesh.radius * (around.rotation * down.rotation.col(2));
        corner.x() *= scale / mesh.aspect;
        corner.y() *= scale / mesh.aspect;
        corners.push_back(corner);
    }
    return corners;
}

}  // namespace

Shape make_ball(const BallMesh& mesh) {
    constexpr double kDent = 0.7;
    const int meridians = 2 * mesh.rings;
    const Eigen::Vector3d pole(0.0, 0.0, mesh.radius);
    std::vector<Eigen::Vector3d> points{pole, -pole};
    if (!mesh.is_dented) {
        for (int number = 0; number < meridians; ++number) {
            const std::vector<Eigen::Vector3d> corners = meridian(mesh, number, 1.0);
            points.insert(points.end(), corners.begin(), corners.end());
        }
        return ConvexHull::create(points).value();
    }
    std::vector<CompoundPart> parts;
    for (int number = 0; number < meridians; ++number) {
        points.resize(2);
        const double scale = number % 2 == 0 ? 1.0 : kDent;
        for (const int side : {number, number + 1}) {
            const std::vector<Eigen::Vector3d> corners = meridian(mesh, side % meridians, scale);
            points.insert(points.end(), corners.begin(), corners.end());
        }
        parts.push_back({ConvexHull::create(points).value(), Pose{}});
    }
    return Compound::create(parts).value();
}

}  // namespace terrane::tools
