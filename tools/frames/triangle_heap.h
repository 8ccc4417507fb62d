// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/triangulator.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace terrane::tools {

/// A displayed surface as a triangle soup with a spatial index: independent of the data structures of the
/// triangulator, for checking it.
class TriangleHeap {
public:
    struct Triangle {
        WorldPos a, b, c;
    };

    /// The triangles of a mesh at their displayed positions.
    static TriangleHeap from(const TerrainMesh& mesh);
    explicit TriangleHeap(std::vector<Triangle> triangles);

    const std::vector<Triangle>& triangles() const { return triangles_; }
    /// The corners of the triangles, each position in the plane once.
    const std::vector<WorldPos>& vertices() const { return vertices_; }

    /// The displayed height at (x, y); the highest where triangles overlap, absent in a hole.
    /// Cost: O(number of size classes of triangles), as each has its own grid.
    std::optional<double> height(double x, double y) const;

    /// The displayed height of the vertex at (x, y); absent where there is none.
    std::optional<double> vertex_height(double x, double y) const;

private:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    void list_triangles();
    void list_vertices();
    std::size_t find_slot(double x, double y) const;

    std::vector<Triangle> triangles_;
    std::vector<WorldPos> vertices_;
    std::vector<std::uint32_t>
        table_;  // indices into vertices_ hashed by position, open addressing
    // Hierarchical grid: a triangle is listed in each cell that it touches of the grid of its size class; the cells of
    // all grids share one hash table of lists.
    std::vector<double> cells_;         // cell side of each size class in use
    std::vector<std::uint32_t> first_;  // [list count + 1] start of each list in lists_
    std::vector<std::uint32_t> lists_;  // indices into triangles_
};

}  // namespace terrane::tools
