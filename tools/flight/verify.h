// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

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

    /// The displayed height over a point; the highest where triangles overlap, nothing where there
    /// is a hole. Cost: O(sizes of triangles that there are).
    std::optional<double> height(double x, double y) const;

private:
    // A triangle is listed in each cell that it touches of a grid whose cells are about its size.
    struct Entry {
        std::int64_t column, row;
        std::uint32_t triangle;
    };
    struct Grid {
        double cell = 1.0;
        std::vector<Entry> entries;  // by row, then column
    };

    std::vector<Triangle> triangles_;
    std::vector<Grid> grids_;
};

/// What a frame really shows, found by brute force.
struct Measurement {
    double error_px = 0.0;    ///< largest screen error of all points that were looked at
    double max_pop_px = 0.0;  ///< largest movement since the frame before, where the eye moved less
                              ///< than a tenth of the distance
    double max_near_pop_px = 0.0;  ///< the same for the points that are closer
    std::size_t points = 0;        ///< that were looked at
    std::size_t holes = 0;         ///< of them without a triangle
};

/// Compares what is displayed with the true surface, by code that shares nothing with the
/// triangulator.
///
/// Throws points over the ground inside the four side planes of the view: half of them spread over
/// directions and, by ratio, distances, as a picture spreads them; half over the triangles, the same
/// number in each. Screen error of a point: vertical distance of displayed and true surface, times
/// pixels per radian, over the distance from the eye to the true point, never less than the near
/// distance. Points that are no ground are left out. The same points are held against the frame before
/// where it saw them.
class Verifier {
public:
    /// @param least_points that a frame is measured with, where the view has that much ground
    explicit Verifier(const HeightSource& source, std::size_t least_points = 100'000);

    /// Measures a frame; frames come in order.
    Measurement measure(const TerrainMesh& mesh, const View& view);
    Measurement measure(TriangleHeap heap, const View& view);

private:
    struct Frame {
        TriangleHeap heap;
        View view;
    };

    bool is_ground(double x, double y) const;

    const HeightSource& source_;
    std::size_t least_points_;
    std::optional<Frame> before_;
};

}  // namespace terrane::tools
