// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>

namespace terrane::internal {

struct ClimbTable;

/// A closed, convex polyhedron with its neighbourhoods: what queries see of a box or of a hull. A
/// view: whoever made it outlives it. Body frame, metres.
///
/// Flat sets are polyhedra too: coplanar points make two faces with opposite normals and one loop
/// each way; two points make one edge and no face; one point makes no edge. Only a box, whose
/// table is always that of 8 corners, may have corners that coincide.
///
/// Threads: any number at once. Copies are cheap: six spans and a pointer.
struct Polyhedron {
    /// Beside the edge of two points there is no face.
    static constexpr std::uint32_t kNoFace = ~std::uint32_t{0};

    /// A flat face with every vertex on it, coplanar triangles merged.
    struct Face {
        Eigen::Vector3d normal;   ///< unit, outward
        double offset = 0.0;      ///< normal . x <= offset for the polyhedron's points x, metres
        std::uint32_t first = 0;  ///< its loop: loops[first] to loops[first + count - 1],
        std::uint32_t count = 0;  ///< at least 3, counter-clockwise seen from outside
    };

    /// A side of two faces. Each is listed once, with from < to, ordered by (from, to).
    struct Edge {
        std::uint32_t from = 0;         ///< vertex
        std::uint32_t to = 0;           ///< vertex
        std::uint32_t left = kNoFace;   ///< the face whose loop runs from -> to
        std::uint32_t right = kNoFace;  ///< the face whose loop runs to -> from
    };

    std::span<const Eigen::Vector3d> vertices;
    std::span<const Face> faces;
    std::span<const std::uint32_t> loops;  ///< vertices of every face's loop, face by face
    std::span<const Edge> edges;
    /// Vertices that share an edge with vertex i, in increasing order:
    /// neighbours[first_neighbour[i]] to neighbours[first_neighbour[i + 1] - 1].
    std::span<const std::uint32_t> first_neighbour;  ///< vertices.size() + 1 of them
    std::span<const std::uint32_t> neighbours;
    const ClimbTable* climb = nullptr;  ///< for find_extreme(), where there are many vertices
};

/// What of a box's polyhedron depends on its size; the rest is one table for all.
struct BoxStorage {
    std::array<Eigen::Vector3d, 8> vertices;
    std::array<Polyhedron::Face, 6> faces;
};

/// The polyhedron of a box around the origin: 8 vertices, 6 faces, 12 edges. At extents of 0 vertices
/// coincide and faces have no area, but their normals stay.
///
/// Vertex i lies at +x where bit 0 of i is set, else at -x; bit 1 is y, bit 2 is z. Faces are
/// -x, +x, -y, +y, -z, +z.
///
/// @param half_extents metres, finite and >= 0
/// @param storage_out  the view points into it: it must outlive the view and stay where it is
///
/// Allocates: nothing
Polyhedron box_polyhedron(const Eigen::Vector3d& half_extents, BoxStorage& storage_out);

}  // namespace terrane::internal
