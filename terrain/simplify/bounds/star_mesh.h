// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Vertices with more triangles than this stay, and none gets more by a contraction: work for one contraction is
/// bounded.
inline constexpr std::size_t kMaxValence = 48;
inline constexpr std::uint32_t kNoTriangle = ~std::uint32_t{0};

/// The triangles around a vertex u in order. Triangle i is (u, vertices[i], vertices[i + 1]), cyclic; that of a border
/// is kNoTriangle.
struct Ring {
    std::array<std::uint32_t, kMaxValence + 1> vertices;
    std::array<std::uint32_t, kMaxValence + 1> triangles;
    std::array<std::uint8_t, kMaxValence + 1> corners;  ///< [triangles] which corner u is, 0 to 2
    std::size_t count = 0;                              ///< of vertices
    bool is_closed =
        false;  ///< no border; else the border is between the last vertex and the first

    /// The same with another first vertex. @param first index in vertices
    Ring rotated(std::size_t first) const;
};

/// Vertices joined to a vertex, in the order in which its triangles name them.
struct Neighbours {
    std::array<std::uint32_t, 2 * kMaxValence> vertices;
    std::array<std::uint8_t, 2 * kMaxValence>
        edge_triangles;  ///< how many triangles the edge to it has
    std::size_t count = 0;
    bool has_all = true;  ///< false: more than kMaxValence triangles

    bool contains(std::uint32_t vertex) const {
        for (std::size_t i = 0; i < count; ++i) {
            if (vertices[i] == vertex) return true;
        }
        return false;
    }
};

/// Triangles as a list for each vertex, for contractions. Any triangles: manifold or not.
class StarMesh {
public:
    using Triangle = std::array<std::uint32_t, 3>;

    StarMesh(std::size_t vertex_count, std::span<const Triangle> triangles);

    std::size_t triangle_count() const { return slots_.size(); }
    const Triangle& triangle(std::size_t index) const { return slots_[index].triangle; }
    bool is_alive(std::size_t triangle) const { return slots_[triangle].triangle[0] != kGone; }
    std::size_t alive_count() const { return alive_count_; }

    /// Asks for the memory of a vertex's first triangle.
    void prefetch(std::uint32_t vertex) const {
        const std::uint32_t corner = first_corner_[vertex];
        if (corner == kEnd) return;
        __builtin_prefetch(&slots_[corner / 3]);
    }
    /// Sorts the triangles around a vertex. False where they are not one disk or half disk with consistent winding, or
    /// more than kMaxValence.
    bool find_ring(std::uint32_t vertex, Ring& ring_out);
    void find_neighbours(std::uint32_t vertex, Neighbours& neighbours_out);
    /// Whether a triangle of a vertex other than those of u has two other corners.
    bool has_triangle(std::uint32_t vertex, std::uint32_t second, std::uint32_t third,
                      std::uint32_t not_of);
    /// The triangle with an edge from one vertex to another in its winding; kNoTriangle where there is none.
    std::uint32_t triangle_at(std::uint32_t from, std::uint32_t to);
    /// Takes a triangle out.
    void remove(std::uint32_t triangle);
    /// Moves u onto ring.vertices[0]: its triangles with that vertex go, the others keep their index.
    void contract(std::uint32_t u, const Ring& ring);

private:
    static constexpr std::uint32_t kGone = ~std::uint32_t{0};
    static constexpr std::uint32_t kEnd = ~std::uint32_t{0};

    // Visits the corners (3 * triangle + i) of a vertex; removes those of triangles that are gone. visit: bool, false
    // ends it.
    template <class Visit>
    void visit_corners(std::uint32_t vertex, const Visit& visit);

    // Together, because both are read at every corner.
    struct Slot {
        Triangle triangle;
        std::array<std::uint32_t, 3> next;  // corner of the same vertex, of each corner
    };

    std::uint32_t& next(std::uint32_t corner) { return slots_[corner / 3].next[corner % 3]; }

    std::vector<Slot> slots_;                  // [triangles]
    std::vector<std::uint32_t> first_corner_;  // [vertices]
    std::size_t alive_count_ = 0;
};

}  // namespace terrane::internal
