// SPDX-License-Identifier: MIT
#include "support/meshes/objects.h"

#include "support/meshes/shapes.h"
#include "support/random.h"

#include <cmath>
#include <numbers>

namespace terrane::test {
namespace {

// A cone or its lower part about the z axis, closed below.
void add_cone(double low, double high, double low_radius, double high_radius, int sides,
              const std::array<std::uint8_t, 4>& colour, TriangleMesh& mesh) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const auto count = static_cast<std::uint32_t>(sides);
    for (std::uint32_t i = 0; i < count; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / count;
        const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0.0);
        mesh.positions.push_back(out * low_radius + Eigen::Vector3d(0, 0, low));
        mesh.positions.push_back(out * high_radius + Eigen::Vector3d(0, 0, high));
    }
    mesh.positions.push_back({0.0, 0.0, low});
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t a = first + 2 * i, b = first + 2 * ((i + 1) % count);
        mesh.triangles.push_back({a, b, b + 1});
        if (high_radius > 0.0) mesh.triangles.push_back({a, b + 1, a + 1});
        mesh.triangles.push_back({first + 2 * count, b, a});
    }
    mesh.colours.resize(mesh.positions.size(), colour);
}

}  // namespace

TriangleMesh make_tree(int sides) {
    TriangleMesh mesh;
    add_cone(0.0, 1.6, 0.22, 0.18, sides, {96, 72, 52, 255}, mesh);
    add_cone(1.2, 4.2, 1.9, 0.0, sides, {52, 84, 40, 255}, mesh);
    add_cone(3.0, 6.2, 1.5, 0.0, sides, {58, 94, 44, 255}, mesh);
    add_cone(4.8, 8.0, 1.0, 0.0, sides, {66, 104, 50, 255}, mesh);
    return mesh;
}

TriangleMesh make_rock(int depth, std::uint64_t seed) {
    const ShapeMesh sphere = make_sphere(0.8, depth);
    TriangleMesh mesh;
    Random random(seed);
    std::vector<Eigen::Vector3d> dents;
    for (int i = 0; i < 12; ++i) dents.push_back(random.direction());
    for (const Eigen::Vector3d& p : sphere.vertices) {
        double radius = 1.0;
        for (const Eigen::Vector3d& dent : dents)
            radius = std::min(radius, 0.82 / std::max(p.normalized().dot(dent), 0.5));
        mesh.positions.push_back(radius * p.cwiseProduct(Eigen::Vector3d(1.1, 0.9, 0.75)));
    }
    mesh.triangles.assign(sphere.triangles.begin(), sphere.triangles.end());
    mesh.colours.assign(mesh.positions.size(), {138, 132, 124, 255});
    return mesh;
}

}  // namespace terrane::test
