// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace terrane::tools {

/// The displayed triangles of volumes, with a spatial index: for distances from points, by brute force over cells.
class SolidHeap {
public:
    /// @param cell side of the index's cells, metres, > 0
    SolidHeap(const TerrainMesh& mesh, double cell);

    /// The point of the triangles that is nearest to a point; infinite where none is within `most` metres.
    Eigen::Vector3d nearest(const Eigen::Vector3d& p_world, double most) const;

private:
    using Triangle = std::array<Eigen::Vector3d, 3>;
    using Cell = std::array<std::int64_t, 3>;
    struct CellHash {
        std::size_t operator()(const Cell& cell) const;
    };
    Cell cell_of(const Eigen::Vector3d& p) const;
    void add(const SolidTriangles& solid, MeshSolid::Triangles triangles);

    double cell_;
    std::vector<Triangle> triangles_;
    std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> cells_;  // never iterated
};

/// The point of a triangle that is nearest to a point.
Eigen::Vector3d nearest_in_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace terrane::tools
