// SPDX-License-Identifier: MIT
#pragma once

#include "frames/triangle_heap.h"

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <optional>

namespace terrane::tools {

/// No more than this may the ground move between two frames, in pixels of the later one, where the
/// later frame certifies kPopErrorLimit_px or less and the eye moved less than a tenth of the distance.
inline constexpr double kPopLimit_px = 0.5;
inline constexpr double kPopErrorLimit_px = 1.5;

/// What a frame really shows, found by brute force.
struct Measurement {
    double error_px = 0.0;    ///< largest screen error of all points that were looked at
    double max_pop_px = 0.0;  ///< largest movement since the frame before, where it has a limit
    double max_pop_elsewhere_px = 0.0;  ///< ... and where it has none
    std::size_t points = 0;             ///< that were looked at
    std::size_t holes = 0;              ///< of them without a displayed height
};

/// Compares what is displayed with the true surface, by code that shares nothing with the
/// triangulator.
///
/// Throws points over the ground inside the four side planes of the view: half of them spread over
/// directions and, by ratio, distances, as a picture spreads them; half over the triangles, the same
/// number in each. Screen error of a point: vertical distance of displayed and true surface, times
/// pixels per radian, over the distance from the eye to the true point, never less than the near
/// distance. Points that are no ground are left out.
///
/// Movement: how far the displayed surface moved under a fixed point of the true surface that both
/// frames saw, measured like an error of the later frame. Besides the points, at every vertex of both
/// frames: between them a movement is never larger, as the triangles of one mesh divide the other's.
class Verifier {
public:
    /// @param least_points that a frame is measured with, where the view has that much ground
    explicit Verifier(const HeightSource& source, std::size_t least_points = 100'000);

    /// Measures a frame; frames come in order.
    Measurement measure(const TerrainMesh& mesh, const View& view);
    /// @param certified_px what the frame says about its own error
    Measurement measure(TriangleHeap heap, const View& view, double certified_px = 0.0);

private:
    /// A view with what every point asks of it.
    struct Camera {
        explicit Camera(const View& view);
        bool sees(const WorldPos& p_world) const;
        /// Screen size of a vertical distance at a point.
        double to_pixels(double metres, const WorldPos& p_world) const;

        View view;
        Frustum frustum;
        double pixels_per_radian;
    };
    struct Frame {
        TriangleHeap heap;
        Camera camera;
    };
    class Points;

    bool is_ground(double x, double y) const;
    void sample_picture(const Camera& camera, Points& points) const;
    void sample_triangles(const TriangleHeap& heap, Points& points) const;

    const HeightSource& source_;
    std::size_t least_points_;
    std::optional<Frame> before_;
};

}  // namespace terrane::tools
