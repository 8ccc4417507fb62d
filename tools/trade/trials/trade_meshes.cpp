// SPDX-License-Identifier: MIT
#include "trade/trials/trade_meshes.h"

#include "world/body_random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace terrane::tools {
namespace {

// The mesh with each triangle cut into four; new corners lie on the unit sphere.
TriangleMesh subdivided(const TriangleMesh& mesh) {
    TriangleMesh fine;
    fine.positions = mesh.positions;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [entry, is_new] = middles.try_emplace(
            std::minmax(a, b), static_cast<std::uint32_t>(fine.positions.size()));
        if (is_new) {
            fine.positions.emplace_back((mesh.positions[a] + mesh.positions[b]).normalized());
        }
        return entry->second;
    };
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        const std::uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]),
                            ca = middle(t[2], t[0]);
        fine.triangles.push_back({t[0], ab, ca});
        fine.triangles.push_back({ab, t[1], bc});
        fine.triangles.push_back({ca, bc, t[2]});
        fine.triangles.push_back({ab, bc, ca});
    }
    return fine;
}

}  // namespace

std::vector<Eigen::Vector3d> sphere_points(std::size_t count) {
    BodyRandom random(5, count);
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < count; ++i) {
        const std::array<double, 3> p = random.direction<3>();
        points.emplace_back(p[0], p[1], p[2]);
    }
    return points;
}

TriangleMesh make_boulder(int subdivisions, double roughness) {
    TriangleMesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int i = 0; i < subdivisions; ++i) mesh = subdivided(mesh);
    for (Eigen::Vector3d& p : mesh.positions) {
        // waves in three directions: smooth, so that coarser meshes are near it
        const double wave =
            std::sin(5.0 * p.x() + 1.0) * std::sin(4.0 * p.y() + 2.0) * std::sin(6.0 * p.z() + 0.5);
        p *= 1.0 + roughness * wave;
    }
    return mesh;
}

TriangleMesh make_rod_mesh(int triangles) {
    constexpr int kSides = 4;
    const int rings = std::max(1, triangles / (2 * kSides));
    TriangleMesh mesh;
    for (int ring = 0; ring <= rings; ++ring) {
        for (int side = 0; side < kSides; ++side) {
            const double angle = 2.0 * std::numbers::pi * side / kSides;
            mesh.positions.emplace_back(20.0 * ring / rings - 10.0, std::cos(angle),
                                        std::sin(angle));
        }
    }
    for (int ring = 0; ring < rings; ++ring) {
        for (int side = 0; side < kSides; ++side) {
            const auto a = static_cast<std::uint32_t>(kSides * ring + side);
            const auto b = static_cast<std::uint32_t>(kSides * ring + (side + 1) % kSides);
            mesh.triangles.push_back({a, b, b + kSides});
            mesh.triangles.push_back({a, b + kSides, a + kSides});
        }
    }
    return mesh;
}

}  // namespace terrane::tools
