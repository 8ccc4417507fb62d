// SPDX-License-Identifier: MIT
#pragma once

#include "frames/solid_verify.h"
#include "frames/triangle_heap.h"

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <memory>
#include <optional>

namespace terrane::tools {

/// Limit of the movement of the ground between two frames, in pixels of the later one. Holds where the later frame
/// certifies kPopErrorLimit_px or less and the eye moved less than a tenth of the distance to the point.
inline constexpr double kPopLimit_px = 0.5;
inline constexpr double kPopErrorLimit_px = 1.5;

/// Error and movement of a displayed frame, measured by brute force.
struct Measurement {
    double error_px = 0.0;  ///< largest screen error of all points
    double max_pop_px =
        0.0;  ///< largest movement since the previous frame, where kPopLimit_px holds
    double max_pop_elsewhere_px = 0.0;  ///< the same where it does not
    std::size_t points = 0;             ///< number of points measured
    std::size_t holes = 0;              ///< points without a displayed height
    std::size_t solid_points = 0;       ///< points of volumes measured
    double solid_error_px = 0.0;        ///< their part of error_px
    /// Largest movement of volumes, which change their level of detail at once: not in the two figures above.
    double max_solid_pop_px = 0.0;
};

/// Compares the displayed surface with the true surface, with code independent of the triangulator.
///
/// Samples points of the ground inside the four side planes of the view: half of them uniform in direction and in the
/// logarithm of the distance, about as a picture shows the ground; half over the triangles, the same number in each.
/// Screen error of a point: vertical distance of displayed and true surface, times pixels per radian, over the distance
/// from the eye to the true point or the near distance, whichever is larger. Points outside the ground are skipped.
///
/// Where volumes replace the heightfield, the points are instead in the middle of triangles of the finest surface of
/// volumes, and the error is their distance to what is displayed: to triangles of volumes, or vertically to the
/// heightfield where that closes over them.
///
/// Movement: vertical distance between the two displayed surfaces at a fixed point of the true surface that both frames
/// see, in pixels of the later frame. Measured at the points and at every vertex of both frames: between vertices it is
/// never larger, as the triangles of one mesh subdivide those of the other.
class Verifier {
public:
    /// @param least_points number of points of a frame, where the view has enough ground
    explicit Verifier(const HeightSource& source, std::size_t least_points = 100'000);

    /// Measures a frame. Call in order of time.
    Measurement measure(const TerrainMesh& mesh, const View& view);
    /// @param certified_px error bound of the frame
    Measurement measure(TriangleHeap heap, const View& view, double certified_px = 0.0);

private:
    /// A view with its derived values.
    struct Camera {
        explicit Camera(const View& view);
        bool sees(const WorldPos& p_world) const;
        /// Screen size, pixels, of a vertical distance at a point.
        double to_pixels(double metres, const WorldPos& p_world) const;

        View view;
        Frustum frustum;
        double pixels_per_radian;
    };
    struct Frame {
        TriangleHeap heap;
        Camera camera;
        std::optional<SolidHeap> solids;
    };
    class Points;

    void measure_solids(Measurement& result) const;
    /// The displayed point that is nearest to a point of a volume; infinite in a hole.
    static Eigen::Vector3d displayed(const Frame& frame, const Eigen::Vector3d& p_world);
    bool is_replaced(double x, double y) const;

    bool is_ground(double x, double y) const;
    void sample_picture(const Camera& camera, Points& points) const;
    void sample_triangles(const TriangleHeap& heap, Points& points) const;

    const HeightSource& source_;
    std::size_t least_points_;
    std::optional<Frame> before_, older_;          // of the last measure(), and of the one before
    std::shared_ptr<const ResidentSet> resident_;  // of the frame
    WorldRect drawn_;                              // ground that the frame draws
};

}  // namespace terrane::tools
