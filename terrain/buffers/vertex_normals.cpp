// SPDX-License-Identifier: MIT
#include "buffers/vertex_normals.h"

#include <cmath>

namespace terrane::internal {

SampleNormals::SampleNormals(const ResidentSet& resident, const Chunk& chunk)
    : chunk_(chunk),
      west_(resident.find_chunk({chunk.key.x - 1, chunk.key.y, chunk.key.level})),
      east_(resident.find_chunk({chunk.key.x + 1, chunk.key.y, chunk.key.level})),
      south_(resident.find_chunk({chunk.key.x, chunk.key.y - 1, chunk.key.level})),
      north_(resident.find_chunk({chunk.key.x, chunk.key.y + 1, chunk.key.level})),
      slope_of_quantum_(resident.lattice().quantum /
                        (resident.lattice().spacing * static_cast<double>(chunk.step))) {}

Eigen::Vector3f SampleNormals::at(std::size_t sample) const {
    const auto column = static_cast<int>(sample % kChunkSamples);
    const auto row = static_cast<int>(sample / kChunkSamples);
    struct Side {
        double height;
        int steps;  // 0: there is no sample on this side
    };
    const double here = chunk_.heights[sample];
    const auto beside = [&](int c, int r, const Chunk* neighbour) -> Side {
        const bool is_inside = c >= 0 && r >= 0 && c < kChunkSamples && r < kChunkSamples;
        if (is_inside) return {static_cast<double>(chunk_.heights[sample_index(c, r)]), 1};
        if (neighbour == nullptr) return {here, 0};
        // a neighbour's border is this chunk's: its sample at -1 is the neighbour's last but one
        const auto across = [](int i) {
            return i < 0 ? i + kChunkCells : i >= kChunkSamples ? i - kChunkCells : i;
        };
        return {static_cast<double>(neighbour->heights[sample_index(across(c), across(r))]), 1};
    };
    const auto slope = [&](const Side& low, const Side& high) {
        return slope_of_quantum_ * (high.height - low.height) / (low.steps + high.steps);
    };
    const double slope_x = slope(beside(column - 1, row, west_), beside(column + 1, row, east_));
    const double slope_y = slope(beside(column, row - 1, south_), beside(column, row + 1, north_));
    const double length = std::sqrt(slope_x * slope_x + slope_y * slope_y + 1.0);
    return {static_cast<float>(-slope_x / length), static_cast<float>(-slope_y / length),
            static_cast<float>(1.0 / length)};
}

std::vector<Eigen::Vector3f> solid_normals(const MeshSolid& solid) {
    const std::vector<Eigen::Vector3d>& vertices = solid.chunk->solid->triangles().vertices_world;
    std::vector<Eigen::Vector3d> sums(vertices.size(), Eigen::Vector3d::Zero());
    visit_triangles(solid, [&](const std::array<std::uint32_t, 3>& t) {
        const Eigen::Vector3d a = vertices[t[1]] - vertices[t[0]];
        const Eigen::Vector3d b = vertices[t[2]] - vertices[t[0]];
        const Eigen::Vector3d twice_area(a.y() * b.z() - a.z() * b.y(),
                                         a.z() * b.x() - a.x() * b.z(),
                                         a.x() * b.y() - a.y() * b.x());
        for (const std::uint32_t corner : t) sums[corner] += twice_area;
    });
    std::vector<Eigen::Vector3f> normals;
    normals.reserve(sums.size());
    for (const Eigen::Vector3d& sum : sums) {
        const double length = std::sqrt(sum.x() * sum.x() + sum.y() * sum.y() + sum.z() * sum.z());
        if (length > 0.0) {
            normals.emplace_back(static_cast<float>(sum.x() / length),
                                 static_cast<float>(sum.y() / length),
                                 static_cast<float>(sum.z() / length));
        } else {
            normals.emplace_back(0.0f, 0.0f, 1.0f);
        }
    }
    return normals;
}

}  // namespace terrane::internal
