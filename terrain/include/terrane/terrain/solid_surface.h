// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane {

/// The part of a joined solid that a triangle belongs to.
enum class SolidPart : std::uint8_t {
    ground,    ///< part of a triangle of the heightfield, clipped
    cavity,    ///< below the heightfield: wall, floor or ceiling of a void
    overhang,  ///< above the heightfield: the surface of added solid
};

/// A coarser version of a chunk's triangles for drawing: the same border, over a subset of the vertices.
struct SolidLevel {
    std::vector<std::array<std::uint32_t, 3>> triangles = {};  ///< indices of vertices
    double error_m = 0.0;  ///< bound of the two-sided distance to the finest version, metres
};

/// A bound for the part of a surface inside a box.
struct SolidErrorBox {
    Aabb box_world;        ///< metres
    double error_m = 0.0;  ///< bound of the two-sided distance to the true surface there, metres
};

/// Triangles of the solid surface over a chunk, as plain arrays.
struct SolidTriangles {
    std::vector<Eigen::Vector3d> vertices_world = {};  ///< metres
    /// Indices of vertices, counter-clockwise seen from outside the solid.
    std::vector<std::array<std::uint32_t, 3>> triangles = {};
    std::vector<SolidPart> parts = {};  ///< [triangles]
    /// Number of triangles that are part of the heightfield; they come first, also in each level.
    std::size_t ground_count = 0;
    /// Triangles of the chunk's heightfield that are not part of the surface: 2 * cell_index(), + 1 for the northern
    /// triangle of the cell.
    std::vector<std::uint16_t> replaced = {};
    /// Triangles of the heightfield that are not replaced and share a corner with a replaced one, as indices of
    /// vertices. Queries for rays and heights test these triangles too, so that nothing passes between the two
    /// surfaces. They are not drawn.
    std::vector<std::array<std::uint32_t, 3>> kept_neighbours = {};
    double error_m = 0.0;  ///< bound of the two-sided distance to the true surface, metres
    /// Tighter bounds, in boxes that together contain all triangles; may be empty.
    std::vector<SolidErrorBox> error_boxes = {};
    std::vector<std::uint32_t> error_box_of = {};  ///< [triangles], or empty if error_boxes is
    /// Bound of the two-sided distance between this surface and the heightfield alone, metres.
    double hidden_error_m = 0.0;
    std::vector<SolidLevel> levels = {};  ///< from fine to coarse, with ascending errors
    /// For the western, eastern, southern and northern side: triangles, as indices of vertices, that close the surface
    /// along that side if the neighbour's solid surface is not drawn. The surface made of these triangles, this chunk's
    /// triangles and the neighbour's heightfield is watertight.
    std::array<std::vector<std::array<std::uint32_t, 3>>, 4> caps = {};
};

/// The surface of the joined solid over one chunk that volumes touch. It consists of the heightfield's triangles that
/// are not replaced, and of the triangles in this class. Chunks without it have only the heightfield.
///
/// Immutable. Threads: any number
class SolidSurface {
public:
    /// Requires indices in range, and as many parts as triangles.
    ///
    /// Cost: O(n log n)
    explicit SolidSurface(SolidTriangles triangles);
    SolidSurface(const SolidSurface&) = delete;
    SolidSurface& operator=(const SolidSurface&) = delete;
    ~SolidSurface();

    /// The arrays that the surface was created from.
    const SolidTriangles& triangles() const { return triangles_; }
    /// Bounding box of the triangles; empty (low > high) if there are none.
    const Aabb& bounds() const { return bounds_; }
    /// Whether a triangle of the heightfield is not part of the surface.
    /// @param cell cell_index()
    bool is_replaced(std::size_t cell, bool is_north) const {
        return replaced_[2 * cell + (is_north ? 1 : 0)];
    }

    /// Intersection of a ray with a triangle.
    struct Hit {
        double t = 0.0;              ///< the hit is at from_world + t * displacement
        std::uint32_t triangle = 0;  ///< index; kept_neighbours are numbered after triangles
    };
    /// The first triangle that a ray hits, from either side; at equal t, the one with the lowest index. A ray through
    /// an edge or a vertex hits one of the adjacent triangles.
    ///
    /// @param begin, end interval of t, closed
    /// Cost: O(log n + triangles near the ray)
    std::optional<Hit> ray(const Eigen::Vector3d& from_world, const Eigen::Vector3d& displacement,
                           double begin, double end) const;
    /// The highest intersection of the vertical line through (x, y) with a triangle, at most at `at_most`; Hit::t is
    /// its world z.
    std::optional<Hit> highest(double x, double y, double at_most) const;

    /// Writes the indices of the triangles whose boxes overlap or touch a box, and possibly of some that miss it by
    /// less than 2^-22 of the coordinates relative to bounds().low. kept_neighbours are numbered after triangles. The
    /// order depends only on the surface and the box. Returns the number of indices written; if it is below out.size(),
    /// no more follow.
    ///
    /// @param box_world  metres; a side may be infinite
    /// @param cursor     0 for the first call, then unchanged between calls
    /// @param out        caller's buffer
    /// Cost: O(log n + triangles near the box)
    std::size_t find_overlaps(const Aabb& box_world, std::uint32_t& cursor,
                              std::span<std::uint32_t> out) const;
    /// Corners of a triangle, counter-clockwise seen from outside the solid.
    std::array<Eigen::Vector3d, 3> corners_world(std::uint32_t triangle) const {
        const std::array<std::uint32_t, 3>& c = corners(triangle);
        const auto& v = triangles_.vertices_world;
        return {v[c[0]], v[c[1]], v[c[2]]};
    }
    /// Whether a triangle is one of SolidTriangles::kept_neighbours, which are copies from the heightfield.
    bool is_kept_neighbour(std::uint32_t triangle) const {
        return triangle >= triangles_.triangles.size();
    }

    /// Bound of the two-sided distance to the true surface around a triangle, metres.
    double error_m(std::uint32_t triangle) const {
        return triangle < triangles_.error_box_of.size()
                   ? triangles_.error_boxes[triangles_.error_box_of[triangle]].error_m
                   : triangles_.error_m;
    }
    /// Unit normal of a triangle, out of the solid.
    Eigen::Vector3d normal(std::uint32_t triangle) const;
    /// Bytes of memory.
    std::size_t bytes() const;

private:
    struct Tree;
    std::uint32_t triangle_count() const {
        return static_cast<std::uint32_t>(triangles_.triangles.size() +
                                          triangles_.kept_neighbours.size());
    }
    const std::array<std::uint32_t, 3>& corners(std::uint32_t triangle) const {
        const std::size_t count = triangles_.triangles.size();
        return triangle < count ? triangles_.triangles[triangle]
                                : triangles_.kept_neighbours[triangle - count];
    }

    SolidTriangles triangles_;
    Aabb bounds_;
    std::bitset<2 * 128 * 128> replaced_;
    std::unique_ptr<const Tree> tree_;
};

}  // namespace terrane
