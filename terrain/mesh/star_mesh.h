// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"

#include <terrane/base/math.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// A vertex with more triangles than this is not contracted, and no contraction may create one: this bounds the cost.
inline constexpr std::size_t kMaxValence = 48;
inline constexpr std::uint32_t kNoTriangle = ~std::uint32_t{0};

/// The triangles around a vertex u in order. Triangle i is (u, vertices[i], vertices[i + 1]), cyclically; at a border,
/// triangles[i] is kNoTriangle.
struct Ring {
    std::array<std::uint32_t, kMaxValence + 1> vertices;
    std::array<std::uint32_t, kMaxValence + 1> triangles;
    std::array<std::uint8_t, kMaxValence + 1> corners;  ///< [triangles] u's corner, 0 to 2
    std::size_t count = 0;                              ///< number of vertices
    bool is_closed =
        false;  ///< no border; otherwise the border is between the last vertex and the first

    /// The same ring, starting at another vertex. @param first index in vertices
    Ring rotated(std::size_t first) const;
};

/// Vertices adjacent to a vertex, in the order in which they occur in its triangles.
struct Neighbours {
    std::array<std::uint32_t, 2 * kMaxValence> vertices;
    std::array<std::uint8_t, 2 * kMaxValence>
        edge_triangles;  ///< number of triangles at the edge to this neighbour
    std::size_t count = 0;
    bool has_all = true;  ///< false if there are more than kMaxValence triangles

    bool contains(std::uint32_t vertex) const {
        for (std::size_t i = 0; i < count; ++i) {
            if (vertices[i] == vertex) return true;
        }
        return false;
    }
};

/// Triangles with a list for each vertex, for contractions. Accepts any triangles, manifold or not.
class StarMesh {
public:
    using Triangle = std::array<std::uint32_t, 3>;

    StarMesh(std::size_t vertex_count, std::span<const Triangle> triangles);

    std::size_t triangle_count() const { return slots_.size(); }
    const Triangle& triangle(std::size_t index) const { return slots_[index].triangle; }
    bool is_alive(std::size_t triangle) const { return slots_[triangle].triangle[0] != kGone; }
    std::size_t alive_count() const { return alive_count_; }

    /// Prefetches a vertex's first triangle.
    void prefetch(std::uint32_t vertex) const {
        const std::uint32_t corner = first_corner_[vertex];
        if (corner == kEnd) return;
        __builtin_prefetch(&slots_[corner / 3]);
    }
    /// Sorts the triangles around a vertex. Returns false if they do not form one disk or half disk with consistent
    /// winding, or are more than kMaxValence.
    bool find_ring(std::uint32_t vertex, Ring& ring_out);
    void find_neighbours(std::uint32_t vertex, Neighbours& neighbours_out);
    /// Whether a vertex has a triangle with these other two corners that is not a triangle of `not_of`.
    bool has_triangle(std::uint32_t vertex, std::uint32_t second, std::uint32_t third,
                      std::uint32_t not_of);
    /// The triangle whose winding contains the directed edge between two vertices; kNoTriangle if there is none.
    std::uint32_t triangle_at(std::uint32_t from, std::uint32_t to);
    void remove(std::uint32_t triangle);
    /// Adds a triangle, whose index is the old triangle_count().
    void add(const Triangle& triangle);
    /// Moves u onto ring.vertices[0]: removes the triangles at this edge; the others keep their index.
    void contract(std::uint32_t u, const Ring& ring);

private:
    static constexpr std::uint32_t kGone = ~std::uint32_t{0};
    static constexpr std::uint32_t kEnd = ~std::uint32_t{0};

    // Visits the corners (3 * triangle + i) of a vertex, and unlinks the corners of removed triangles. `visit` returns
    // false to stop.
    template <class Visit>
    void visit_corners(std::uint32_t vertex, const Visit& visit);

    // In one struct, because both are read at every corner.
    struct Slot {
        Triangle triangle;
        std::array<std::uint32_t, 3> next;  // [corners] next corner of the same vertex
    };

    std::uint32_t& next(std::uint32_t corner) { return slots_[corner / 3].next[corner % 3]; }

    std::vector<Slot> slots_;                  // [triangles]
    std::vector<std::uint32_t> first_corner_;  // [vertices]
    std::size_t alive_count_ = 0;
};

/// Two bounds of the distance from a triangle to the points of the input that map to the triangle. Both hold.
struct TriangleBound {
    /// This box contains the displacements from points of the triangle to the corresponding points of the input,
    /// metres.
    std::array<double, 3> low = {}, high = {};
    /// At the point with barycentric weights w0, w1, w2, the distance is at most
    /// constant + edges[0] w0 w1 + edges[1] w1 w2 + edges[2] w2 w0, metres. The quadratic terms vanish at the corners,
    /// because these are vertices of the input, displaced by little more than rounding.
    std::array<double, 3> edges = {};
    double constant = 0.0;  ///< metres

    /// Adds points of the input that are within a distance of some point of the triangle.
    void include(double distance);

    /// The smaller of the largest distances that the two bounds allow, rounded up.
    double largest() const;
};

/// Two triangles that share an edge count as folded onto each other if the cosine of the angle between their normals is
/// below this: the normals are within a thousandth of a radian of opposite.
inline constexpr double kFoldedCosine = -(1.0 - 5e-7);

/// Decides whether a vertex can be contracted, and bounds how far the surface moves.
class ContractionBound {
public:
    /// @param vertices, bounds [vertices], [triangles]; the viewed arrays must outlive this object
    ContractionBound(std::span<const Eigen::Vector3d> vertices,
                     std::span<const TriangleBound> bounds)
        : vertices_(vertices), bounds_(bounds) {}

    /// Evaluates the contraction of u onto ring.vertices[0] without performing it. Returns true if the new triangles
    /// are well shaped, none is flipped, and the old ones map onto them; error() and bound() are then set.
    ///
    /// @param limit evaluation stops if the error exceeds this, metres
    bool evaluate(std::uint32_t u, const Ring& ring, double limit);

    /// As evaluate(), with a certificate for triangles of any shape: every point of the old triangles moves parallel to
    /// the edge to the target, by more the nearer it is to u. The error is never smaller than the edge's length.
    bool evaluate_along_edge(std::uint32_t u, const Ring& ring);

    /// Largest error of the new triangles, metres.
    double error() const { return error_; }
    /// Bound of the new triangle that replaces ring.triangles[i], 1 <= i <= ring.count - 2.
    const TriangleBound& bound(std::size_t i) const { return new_bounds_[i]; }

private:
    struct Point {
        double x = 0.0, y = 0.0;
    };
    /// A corner of the overlay inside a new triangle.
    struct OverlayCorner {
        std::size_t spoke = 0;  ///< the old spoke that it lies on; kEverySpoke: the image of u
        double along = 0.0;     ///< parameter along the old spoke, 0 at u
        std::array<double, 3> weights = {};  ///< of the new triangle's corners, the target first
        Eigen::Vector3d displacement;        ///< from the new to the old surface, metres
        double rounding = 0.0;               ///< rounding error of the displacement
        double distance = 0.0;               ///< length of the displacement minus its rounding
    };
    struct CellCorner {
        std::array<double, 3> old_weights, new_weights;
        double distance;
    };
    // Tolerance of positions in the plane, relative to the size of the star. Corners that are outside a cell by less
    // than this are included, because surplus corners are harmless. Rounding is below 1e-15.
    static constexpr double kPlaceTolerance = 1e-12;
    static constexpr std::size_t kEverySpoke = ~std::size_t{0};
    static constexpr std::size_t kMaxCorners = 2 * kMaxValence + 4;
    // Three neighbours, the image, and the crossings of each spoke with two spokes.
    static constexpr std::size_t kMaxCellCorners = 8;
    /// The intersection of an old and a new triangle.
    struct Cell {
        std::array<CellCorner, kMaxCellCorners> corners;
        std::size_t count = 0;
        std::array<double, 3> edges = {};  ///< the old triangle's bound, like `constant`
        double constant = 0.0;
    };

    static double area(const Point& a, const Point& b, const Point& c);

    bool set_frame(std::uint32_t u, const Ring& ring);
    bool do_not_turn(const Ring& ring) const;
    bool are_new_triangles_good(const Ring& ring) const;
    bool is_image_inside(const Ring& ring) const;
    bool find_corners(const Ring& ring, std::size_t k);
    void add_image_of_u(std::size_t k);
    bool add_crossings(const Ring& ring, std::size_t k, bool is_second);
    void add_corner(const OverlayCorner& corner);
    void bound_triangle(const Ring& ring, std::size_t k);
    void add_cell(const Ring& ring, std::size_t i, TriangleBound& bound);
    static void bound_cell(const Cell& cell, bool is_along_edge, TriangleBound& bound);

    std::span<const Eigen::Vector3d> vertices_;
    std::span<const TriangleBound> bounds_;

    // Data of one contraction, relative to u.
    std::array<Eigen::Vector3d, kMaxValence + 1> ring_;  // [ring.count]
    std::array<Point, kMaxValence + 1> flat_;            // [ring.count]
    std::array<double, kMaxValence + 1> flat_length_;  // [ring.count] distance from the image of u
    Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();
    Point image_;                                     // image of u
    double size_ = 0.0;                               // twice the length of the longest spoke
    std::array<OverlayCorner, kMaxCorners> corners_;  // of one new triangle
    std::size_t corner_count_ = 0;
    std::array<Cell, kMaxValence> cells_;  // of one new triangle
    std::size_t cell_count_ = 0;
    std::array<TriangleBound, kMaxValence + 1> new_bounds_;
    double error_ = 0.0;
};

/// Distance from a point to a box; 0 inside.
inline double distance_to_box(const Eigen::Vector3d& p, const Aabb& box) {
    double square = 0.0;
    for (Eigen::Index k = 0; k < 3; ++k) {
        const double outside = std::max({box.low[k] - p[k], p[k] - box.high[k], 0.0});
        square += outside * outside;
    }
    return std::sqrt(square);
}

/// Largest distance from a point of the triangle `from` to the triangle `to`, rounded up. It is attained at a corner,
/// because the distance from a convex set is convex.
double largest_distance(const Corners& from, const Corners& to);

/// Upper bound of the distance of a triangle's points from a set of triangles: splits the triangle until further splits
/// would not bring its parts nearer to a single triangle of the set, and returns the largest distance of a part.
///
/// @param limit   stops splitting once the bound exceeds this
/// @param nearest double(const Corners& part): least largest_distance() from a part to a triangle of the set
template <class Nearest>
double distance_to_set(const Corners& triangle, double limit, const Nearest& nearest) {
    // Parts shorter than this fraction of their distance are not split: the distance would change little.
    constexpr double kShortPart = 0.5;
    constexpr int kMostSplits = 2;
    struct Part {
        Corners corners;
        int splits;
    };
    // Depth first: at each level three other parts are left on the stack.
    std::array<Part, 3 * kMostSplits + 1> stack;
    std::size_t count = 0;
    stack[count++] = {triangle, 0};
    double largest = 0.0;
    while (count > 0 && largest <= limit) {
        const Part part = stack[--count];
        const Corners& c = part.corners;
        const double distance = nearest(c);
        if (distance <= largest) continue;
        double longest = 0.0;
        for (std::size_t i = 0; i < 3; ++i)
            longest = std::max(longest, length(c[(i + 1) % 3] - c[i]));
        if (part.splits == kMostSplits || longest < kShortPart * distance) {
            largest = distance;
            continue;
        }
        const Eigen::Vector3d a = 0.5 * (c[0] + c[1]), b = 0.5 * (c[1] + c[2]),
                              d = 0.5 * (c[2] + c[0]);
        for (const Corners& quarter :
             {Corners{c[0], a, d}, Corners{a, c[1], b}, Corners{d, b, c[2]}, Corners{a, b, d}})
            stack[count++] = {quarter, part.splits + 1};
    }
    return largest;
}

}  // namespace terrane::internal
