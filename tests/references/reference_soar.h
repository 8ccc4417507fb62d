// SPDX-License-Identifier: MIT
#pragma once

#include "reference_maps.h"

#include <terrane/terrain/view.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::test {

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
