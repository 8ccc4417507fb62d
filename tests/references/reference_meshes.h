// SPDX-License-Identifier: MIT
#pragma once

#include "reference_maps.h"

#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::test {

/// A triangulation of a table over some of its samples.
struct TableMesh {
    std::vector<std::array<int, 2>> vertices;             ///< column and row
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from above
};

/// Largest vertical distance of a sample from the mesh, metres, by looking at every sample of every
/// triangle; infinite where the triangles do not cover the table once.
double measure_error(const HeightTable& table, const TableMesh& mesh);

/// Greedy insertion into a Delaunay triangulation: the sample that is furthest off goes in next,
/// until none is further off than `tolerance` metres.
TableMesh make_greedy_tin(const HeightTable& table, double tolerance);

/// The smallest conforming longest-edge bisection of a square table of 2^n + 1 samples a side that
/// has no sample further off than `tolerance` metres in any triangle that could still be split.
TableMesh make_minimal_closure(const HeightTable& table, double tolerance);

/// Column and row of a sample.
using Place = std::array<int, 2>;

/// Twice the signed area of a triangle, positive where it is counter-clockwise.
inline std::int64_t cross(const Place& a, const Place& b, const Place& c) {
    return std::int64_t{b[0] - a[0]} * (c[1] - a[1]) - std::int64_t{c[0] - a[0]} * (b[1] - a[1]);
}

struct Worst {
    double error = 0.0;
    Place place{};
};

/// The sample of a closed triangle that is furthest from its plane.
///
/// @param corners  counter-clockwise, of positive area
Worst find_worst(const HeightTable& table, const std::array<Place, 3>& corners);

/// Top-down refinement of a table from scratch, frame by frame, to compare with: nested certified
/// errors and nested bounding balls, a budget by exact order statistic, 32-bit indices. Nothing is
/// paged, nothing morphs.
class SoarReference {
public:
    /// Requires a source of one root square.
    explicit SoarReference(const TableHeights& source);

    /// Refines what may err by more than tau_px where the view can see it.
    /// @return triangles
    std::size_t refine(const View& view, double tau_px);

    /// Refines with the lowest threshold that needs at most `budget` triangles (>= 2).
    std::size_t refine_to_budget(const View& view, std::size_t budget);

    /// Of the last frame, into TableHeights::padded(): 3 a triangle, counter-clockwise from above.
    std::span<const std::uint32_t> indices() const { return {indices_.data(), used_}; }
    /// Threshold of the last frame, pixels.
    double tau_px() const { return static_cast<double>(tau_); }

    /// Whether triangles outside the side planes of the view stay as they are. Default: yes.
    bool culls = true;

private:
    struct Vertex {
        float height = 0.0f;
        float error = 0.0f;   ///< certified, nested, metres
        float radius = 0.0f;  ///< of a ball around all that lies below, nested, metres
    };
    struct Point {
        std::int32_t x, y;
    };
    /// Seen from the eye, single precision.
    struct Screen {
        float eye_x, eye_y, eye_z;
        float pixels, near_distance;
        float normals[4][3];
    };

    void make_radii();
    void look(const View& view);
    std::size_t index(Point p) const {
        return static_cast<std::size_t>(p.y) * static_cast<std::size_t>(side_) +
               static_cast<std::size_t>(p.x);
    }
    /// Screen error of a vertex, 0 where its ball is outside; clears the bits of `planes` that the
    /// ball is inside of.
    float priority(Point p, const Vertex& vertex, unsigned& planes) const;
    void gather(Point apex, Point left, Point right, int depth, unsigned planes);
    void emit(Point apex, Point left, Point right, int depth, unsigned planes);
    void emit_all();

    int side_ = 0;
    int depth_ = 0;  ///< bisections from a root triangle to half a cell
    float spacing_ = 1.0f;
    std::vector<Vertex> vertices_;
    Screen screen_{};
    float tau_ = 0.0f;
    std::vector<float> priorities_;
    std::vector<std::uint32_t> indices_;
    std::size_t used_ = 0;  ///< of indices_
};

}  // namespace terrane::test
