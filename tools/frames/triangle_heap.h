// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/triangulator.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace terrane::tools {

/// A displayed surface as a heap of triangles, without any of the structure that made it: what a
/// judge may know of a mesh.
class TriangleHeap {
public:
    struct Triangle {
        WorldPos a, b, c;
    };

    /// Takes the triangles of a mesh at their displayed places.
    static TriangleHeap from(const TerrainMesh& mesh);
    explicit TriangleHeap(std::vector<Triangle> triangles);

    const std::vector<Triangle>& triangles() const { return triangles_; }
    /// The triangles' corners, each place in the plane once.
    const std::vector<WorldPos>& vertices() const { return vertices_; }

    /// The displayed height over a point; the highest where triangles overlap, nothing where there
    /// is a hole. Cost: O(sizes of triangles that there are).
    std::optional<double> height(double x, double y) const;

    /// The displayed height at a vertex, nothing where none is.
    std::optional<double> vertex_height(double x, double y) const;

private:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    void list_triangles();
    void list_vertices();
    std::size_t find_slot(double x, double y) const;

    std::vector<Triangle> triangles_;
    std::vector<WorldPos> vertices_;
    std::vector<std::uint32_t> table_;  // into vertices_ by place, open addressing
    // A triangle is listed under each cell that it touches of a grid whose cells are about its size;
    // cells of all grids share one hash table of lists.
    std::vector<double> cells_;         // sides, one for each size of triangles that there is
    std::vector<std::uint32_t> first_;  // [lists + 1] where a list begins
    std::vector<std::uint32_t> lists_;  // triangles
};

}  // namespace terrane::tools
