// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

struct ClimbTable;

/// Non-owning view of a closed convex polyhedron with adjacency: a box or a hull. Body frame, metres.
///
/// Degenerate polyhedra: coplanar points have two faces with opposite normals and opposite loops; two points have one
/// edge and no face; one point has no edge. Only a box, which always has 8 vertices, may have coincident vertices.
///
/// Threads: any number at once. Copies are cheap: six spans and a pointer.
struct Polyhedron {
    /// Stands for the faces of the edge of a two-point polyhedron, which has no faces.
    static constexpr std::uint32_t kNoFace = ~std::uint32_t{0};

    /// A flat face with every vertex on it, coplanar triangles merged.
    struct Face {
        Eigen::Vector3d normal;   ///< unit, outward
        double offset = 0.0;      ///< normal . x <= offset for the polyhedron's points x, metres
        std::uint32_t first = 0;  ///< its loop: loops[first] to loops[first + count - 1],
        std::uint32_t count = 0;  ///< at least 3, counter-clockwise seen from outside
    };

    /// An edge between two faces. Each edge is listed once, with from < to; edges are sorted by (from, to).
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
    const ClimbTable* climb = nullptr;  ///< for find_extreme(); null: scan
};

/// The data of a box's polyhedron that depend on its size; all others are constant tables.
struct BoxStorage {
    std::array<Eigen::Vector3d, 8> vertices;
    std::array<Polyhedron::Face, 6> faces;
};

/// The polyhedron of a box around the origin: 8 vertices, 6 faces, 12 edges. If an extent is 0, vertices coincide, and
/// faces have no area but keep their normals.
///
/// Vertex i lies at +x if bit 0 of i is set, else at -x; bit 1 is for y, bit 2 for z. The order of the faces is -x, +x,
/// -y, +y, -z, +z.
///
/// @param half_extents metres, finite and >= 0
/// @param storage_out  the view points into it: it must outlive the view and must not move
///
/// Allocates: nothing
Polyhedron box_polyhedron(const Eigen::Vector3d& half_extents, BoxStorage& storage_out);

/// Data of the hill climb of find_extreme(): the vertices' neighbours in a triangulation of the surface, and start
/// vertices.
struct ClimbTable {
    std::vector<std::uint32_t> first_neighbour;  ///< [vertices + 1] as in Polyhedron
    std::vector<std::uint32_t> neighbours;
    std::vector<std::uint32_t> starts;  ///< [cells of a cube map] a vertex near the extreme
    int resolution = 0;                 ///< of the cube map, which has 6 resolution^2 cells
    /// Two dot products with one direction are in exact order if they differ by more than this times the 1-norm of the
    /// direction, metres.
    double slack = 0.0;
};

/// Number of vertices from which a climb is faster than a scan: in extremes_benchmark both take 44 ns at 42 to 44
/// vertices.
inline constexpr std::size_t kClimbFrom = 44;

/// Support vertex: the vertex with the largest dot(direction, vertex) as computed by vector_math.h, the lowest index on
/// a tie; vertex 0 for a direction of 0 or NaN. Scan and climb give the same vertex for every direction.
///
/// @param direction body frame, any length
///
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      that of find_extreme_by_climb() if the hull has a ClimbTable, else that of find_extreme_by_scan()
std::uint32_t find_extreme(const Polyhedron& hull, const Eigen::Vector3d& direction);

/// Evaluates every vertex: about 1 ns each.
std::uint32_t find_extreme_by_scan(std::span<const Eigen::Vector3d> vertices,
                                   const Eigen::Vector3d& direction);

/// Starts at a vertex from the table, climbs over neighbours, then searches all vertices within rounding of the
/// maximum; falls back to a scan if there are many. Takes about 40 ns for round hulls of any size. In a direction
/// orthogonal to a face with many vertices it is as slow as a scan.
std::uint32_t find_extreme_by_climb(std::span<const Eigen::Vector3d> vertices,
                                    const ClimbTable& table, const Eigen::Vector3d& direction);

/// Fills in the start vertices.
///
/// @param table_out its neighbours and slack must be set already
void fill_climb_starts(std::span<const Eigen::Vector3d> vertices, ClimbTable& table_out);

}  // namespace terrane::internal
