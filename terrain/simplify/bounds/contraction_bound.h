// SPDX-License-Identifier: MIT
#pragma once

#include "simplify/bounds/star_mesh.h"
#include "simplify/bounds/triangle_bound.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>

namespace terrane::internal {

/// Triangles that share an edge with a smaller cosine of their normals lie on each other: a thousandth of a radian.
inline constexpr double kFoldedCosine = -(1.0 - 5e-7);

/// Decides whether a vertex can be contracted, and how far the surface moves.
class ContractionBound {
public:
    /// @param vertices, bounds views that must stay: [vertices], [triangles]
    ContractionBound(std::span<const Eigen::Vector3d> vertices,
                     std::span<const TriangleBound> bounds)
        : vertices_(vertices), bounds_(bounds) {}

    /// Contracts u onto ring.vertices[0] in thought. True: the new triangles are well shaped, none is turned over, and
    /// the old ones map onto them; error() and bound() are set.
    ///
    /// @param limit error above which the rest does not matter, metres
    bool evaluate(std::uint32_t u, const Ring& ring, double limit);

    /// The same with a certificate for triangles of any shape: every point of the old ones moves along the edge to the
    /// target, the farther the nearer it is to u. Never a smaller error than the edge's length.
    bool evaluate_along_edge(std::uint32_t u, const Ring& ring);

    /// Largest error of the new triangles, metres.
    double error() const { return error_; }
    /// Of the new triangle in the place of ring.triangles[i], 1 <= i <= ring.count - 2.
    const TriangleBound& bound(std::size_t i) const { return new_bounds_[i]; }

private:
    struct Point {
        double x = 0.0, y = 0.0;
    };
    /// A corner of the overlay inside a new triangle.
    struct OverlayCorner {
        std::size_t spoke = 0;               ///< old one that it is on; kEverySpoke: the image of u
        double along = 0.0;                  ///< the old spoke, 0 at u
        std::array<double, 3> weights = {};  ///< of the new triangle's corners, the target first
        Eigen::Vector3d displacement;        ///< from the new to the old surface, metres
        double rounding = 0.0;               ///< of the displacement
        double distance = 0.0;               ///< length of the displacement, less its rounding
    };
    struct CellCorner {
        std::array<double, 3> old_weights, new_weights;
        double distance;
    };
    // Tolerance of places in the plane, of the size of the star. Corners of cells that are outside by less are taken in
    // as well: too many corners do no harm. Rounding is below 1e-15.
    static constexpr double kPlaceTolerance = 1e-12;
    static constexpr std::size_t kEverySpoke = ~std::size_t{0};
    static constexpr std::size_t kMaxCorners = 2 * kMaxValence + 4;
    // Three neighbours, the image, and each spoke's crossings with two spokes.
    static constexpr std::size_t kMaxCellCorners = 8;
    /// What an old and a new triangle have in common.
    struct Cell {
        std::array<CellCorner, kMaxCellCorners> corners;
        std::size_t count = 0;
        std::array<double, 3> edges = {};  ///< of the old triangle's bound, as constant
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

    // Of one contraction, relative to u.
    std::array<Eigen::Vector3d, kMaxValence + 1> ring_;  // [ring.count]
    std::array<Point, kMaxValence + 1> flat_;            // [ring.count]
    std::array<double, kMaxValence + 1> flat_length_;    // [ring.count] from the image of u
    Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();
    Point image_;                                     // of u
    double size_ = 0.0;                               // twice the longest spoke
    std::array<OverlayCorner, kMaxCorners> corners_;  // of one new triangle
    std::size_t corner_count_ = 0;
    std::array<Cell, kMaxValence> cells_;  // of one new triangle
    std::size_t cell_count_ = 0;
    std::array<TriangleBound, kMaxValence + 1> new_bounds_;
    double error_ = 0.0;
};

}  // namespace terrane::internal
