// SPDX-License-Identifier: MIT
#include "shapes/polyhedron.h"

#include <cstddef>

namespace terrane::internal {
namespace {

using Edge = Polyhedron::Edge;

// Faces -x, +x, -y, +y, -z, +z, counter-clockwise seen from outside.
constexpr std::array<std::uint32_t, 24> kLoops = {0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4,
                                                  2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6};

constexpr std::uint32_t face_with_side(std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t side = 0; side < 24; ++side) {
        const std::uint32_t face = side / 4;
        if (kLoops[side] == from && kLoops[4 * face + (side + 1) % 4] == to) return face;
    }
    return Polyhedron::kNoFace;
}

constexpr std::array<Edge, 12> make_edges() {
    std::array<Edge, 12> edges{};
    std::size_t count = 0;
    for (std::uint32_t from = 0; from < 8; ++from) {
        for (std::uint32_t bit = 1; bit < 8; bit *= 2) {
            if ((from & bit) != 0) continue;
            const std::uint32_t to = from | bit;
            edges[count++] = {from, to, face_with_side(from, to), face_with_side(to, from)};
        }
    }
    return edges;
}

constexpr std::array<std::uint32_t, 24> make_neighbours() {
    std::array<std::uint32_t, 24> neighbours{};
    std::size_t count = 0;
    for (std::uint32_t vertex = 0; vertex < 8; ++vertex) {
        for (std::uint32_t bit = 4; bit != 0; bit /= 2) {  // lower vertices first
            if ((vertex & bit) != 0) neighbours[count++] = vertex ^ bit;
        }
        for (std::uint32_t bit = 1; bit < 8; bit *= 2) {
            if ((vertex & bit) == 0) neighbours[count++] = vertex ^ bit;
        }
    }
    return neighbours;
}

constexpr std::array<Edge, 12> kEdges = make_edges();
constexpr std::array<std::uint32_t, 9> kFirstNeighbour = {0, 3, 6, 9, 12, 15, 18, 21, 24};
constexpr std::array<std::uint32_t, 24> kNeighbours = make_neighbours();

}  // namespace

Polyhedron box_polyhedron(const Eigen::Vector3d& half_extents, BoxStorage& storage_out) {
    for (std::size_t i = 0; i < 8; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const double half = half_extents[axis];
            storage_out.vertices[i][axis] = (i >> axis & 1) != 0 ? half : -half;
        }
    }
    for (std::uint32_t i = 0; i < 6; ++i) {
        const int axis = static_cast<int>(i / 2);
        Polyhedron::Face& face = storage_out.faces[i];
        face.normal = Eigen::Vector3d::Zero();
        face.normal[axis] = i % 2 == 0 ? -1.0 : 1.0;
        face.offset = half_extents[axis];
        face.first = 4 * i;
        face.count = 4;
    }
    return {storage_out.vertices, storage_out.faces, kLoops, kEdges, kFirstNeighbour, kNeighbours};
}

}  // namespace terrane::internal
