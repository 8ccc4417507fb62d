// SPDX-License-Identifier: MIT
// Sources: C. Ericson. Real-Time Collision Detection. 2005, section 5.1.5 (nearest point of a triangle).
#include "frames/solid_verify.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::tools {
namespace {

Eigen::Vector3d nearest_in_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
    const Eigen::Vector3d along = b - a;
    const double square = along.squaredNorm();
    const double t = square > 0.0 ? std::clamp((p - a).dot(along) / square, 0.0, 1.0) : 0.0;
    return a + t * along;
}

}  // namespace

Eigen::Vector3d nearest_in_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double square = normal.squaredNorm();
    if (square > 0.0 && (b - a).cross(p - a).dot(normal) >= 0.0 &&
        (c - b).cross(p - b).dot(normal) >= 0.0 && (a - c).cross(p - c).dot(normal) >= 0.0) {
        return p - (p - a).dot(normal) / square * normal;
    }
    const Eigen::Vector3d of_edges[] = {nearest_in_segment(p, a, b), nearest_in_segment(p, b, c),
                                        nearest_in_segment(p, c, a)};
    return *std::ranges::min_element(
        of_edges, {}, [&](const Eigen::Vector3d& q) { return (q - p).squaredNorm(); });
}

std::size_t SolidHeap::CellHash::operator()(const Cell& cell) const {
    std::uint64_t h = 0;
    for (const std::int64_t i : cell) {
        h = (h ^ (h >> 29) ^ static_cast<std::uint64_t>(i)) * 0x9e3779b97f4a7c15u;
    }
    return static_cast<std::size_t>(h ^ (h >> 32));
}

SolidHeap::Cell SolidHeap::cell_of(const Eigen::Vector3d& p) const {
    Cell cell;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        cell[axis] =
            static_cast<std::int64_t>(std::floor(p[static_cast<Eigen::Index>(axis)] / cell_));
    }
    return cell;
}

SolidHeap::SolidHeap(const TerrainMesh& mesh, double cell) : cell_(cell) {
    for (const MeshSolid& drawn : mesh.solids) {
        const SolidTriangles& solid = drawn.chunk->solid->triangles();
        add(solid, drawn.triangles);
        for (const MeshSolid::Triangles& cap : drawn.caps) add(solid, cap);
    }
}

void SolidHeap::add(const SolidTriangles& solid, MeshSolid::Triangles triangles) {
    for (const auto& [a, b, c] : triangles) {
        const auto index = static_cast<std::uint32_t>(triangles_.size());
        const Triangle& t = triangles_.emplace_back(
            Triangle{solid.vertices_world[a], solid.vertices_world[b], solid.vertices_world[c]});
        const Cell low = cell_of(t[0].cwiseMin(t[1]).cwiseMin(t[2]));
        const Cell high = cell_of(t[0].cwiseMax(t[1]).cwiseMax(t[2]));
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
            for (std::int64_t y = low[1]; y <= high[1]; ++y) {
                for (std::int64_t x = low[0]; x <= high[0]; ++x) {
                    cells_[{x, y, z}].push_back(index);
                }
            }
        }
    }
}

Eigen::Vector3d SolidHeap::nearest(const Eigen::Vector3d& p_world, double most) const {
    Eigen::Vector3d best = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    double least = most;
    const Cell middle = cell_of(p_world);
    // shells of cells; one at distance i holds nothing nearer than i - 1 cells
    for (std::int64_t i = 0; cell_ * static_cast<double>(i - 1) <= least; ++i) {
        for (std::int64_t z = -i; z <= i; ++z) {
            for (std::int64_t y = -i; y <= i; ++y) {
                const bool is_face = std::abs(z) == i || std::abs(y) == i;
                for (std::int64_t x = -i; x <= i;
                     x += is_face ? 1 : std::max<std::int64_t>(1, 2 * i)) {
                    const auto found = cells_.find({middle[0] + x, middle[1] + y, middle[2] + z});
                    if (found == cells_.end()) continue;
                    for (const std::uint32_t t : found->second) {
                        const Triangle& triangle = triangles_[t];
                        const Eigen::Vector3d q =
                            nearest_in_triangle(p_world, triangle[0], triangle[1], triangle[2]);
                        const double distance = (q - p_world).norm();
                        if (distance > least) continue;
                        least = distance;
                        best = q;
                    }
                }
            }
        }
    }
    return best;
}

}  // namespace terrane::tools
