// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

namespace terrane::tools {

/// A displayed surface as a triangle soup with a spatial index; independent of the triangulator, which it checks.
class TriangleHeap {
public:
    struct Triangle {
        WorldPos a, b, c;
    };

    /// The triangles of a mesh at their displayed positions.
    static TriangleHeap from(const TerrainMesh& mesh);
    explicit TriangleHeap(std::vector<Triangle> triangles);

    const std::vector<Triangle>& triangles() const { return triangles_; }
    /// The corners of the triangles, each horizontal position once.
    const std::vector<WorldPos>& vertices() const { return vertices_; }

    /// The displayed height at (x, y): that of the highest triangle if several overlap; absent in a hole.
    /// Cost: O(number of size classes of triangles), because each class has its own grid
    std::optional<double> height(double x, double y) const;

    /// The displayed height of the vertex at (x, y), if any.
    std::optional<double> vertex_height(double x, double y) const;

private:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    void list_triangles();
    void list_vertices();
    std::size_t find_slot(double x, double y) const;

    std::vector<Triangle> triangles_;
    std::vector<WorldPos> vertices_;
    std::vector<std::uint32_t>
        table_;  // indices into vertices_ hashed by position, open addressing
    // Hierarchical grid: each size class of triangles has a grid, and each of its cells lists the triangles that touch
    // the cell. The cells of all grids share one hash table of lists.
    std::vector<double> cells_;         // cell side of each size class in use
    std::vector<std::uint32_t> first_;  // [list count + 1] start of each list in lists_
    std::vector<std::uint32_t> lists_;  // indices into triangles_
};

/// The displayed triangles of volumes with a spatial index, which finds the nearest one by brute force over cells.
class SolidHeap {
public:
    /// @param cell side of the index's cells, metres, > 0
    SolidHeap(const TerrainMesh& mesh, double cell);

    /// The nearest point of the triangles; infinite if none is within `most` metres.
    Eigen::Vector3d nearest(const Eigen::Vector3d& p_world, double most) const;

private:
    using Triangle = std::array<Eigen::Vector3d, 3>;
    using Cell = std::array<std::int64_t, 3>;
    struct CellHash {
        std::size_t operator()(const Cell& cell) const;
    };
    Cell cell_of(const Eigen::Vector3d& p) const;
    void add(const SolidTriangles& solid, MeshSolid::Triangles triangles);

    double cell_;
    std::vector<Triangle> triangles_;
    std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> cells_;  // never iterated
};

/// The point of a triangle nearest to a point.
Eigen::Vector3d nearest_in_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Limit of the movement of a point of the ground between two frames, in pixels of the later one. It applies if the
/// later frame certifies kPopErrorLimit_px or less and the eye moved less than a tenth of its distance to the point.
inline constexpr double kPopLimit_px = 0.5;
inline constexpr double kPopErrorLimit_px = 1.5;

/// Error and movement of a displayed frame, measured by brute force.
struct Measurement {
    double error_px = 0.0;  ///< largest screen error of all points
    double max_pop_px =
        0.0;  ///< largest movement since the previous frame, where kPopLimit_px applies
    double max_pop_elsewhere_px = 0.0;  ///< the same where the limit does not apply
    std::size_t points = 0;             ///< number of points measured
    std::size_t holes = 0;              ///< points without a displayed height
    std::size_t solid_points = 0;       ///< points of volumes measured
    double solid_error_px = 0.0;        ///< largest screen error of these points
    /// Largest movement of volumes, which switch levels of detail at once: excluded from the two figures above.
    double max_solid_pop_px = 0.0;
};

/// Compares the displayed surface with the true surface, with code independent of the triangulator.
///
/// Samples points of the ground inside the four side planes of the view. Half of them are uniform in direction and in
/// the logarithm of the distance, about as a picture shows the ground; the others are on the triangles, the same number
/// on each. The screen error of a point is the vertical distance between displayed and true surface, times pixels per
/// radian, divided by the distance from the eye to the true point or by the near distance, whichever is larger. Points
/// outside the ground are skipped.
///
/// Where volumes replace the heightfield, the points are instead the centroids of triangles of the volumes' finest
/// surface, and the error is their distance to the displayed surface: to triangles of volumes, or vertically to the
/// heightfield where it covers them.
///
/// The movement is the vertical distance between the displayed surfaces of two frames at a fixed point of the true
/// surface that both frames see, in pixels of the later frame. It is measured at the sampled points and at every vertex
/// of both frames. Between vertices it is never larger, because the triangles of one mesh subdivide those of the other.
class Verifier {
public:
    /// @param least_points least number of points in a frame, if the view has enough ground
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
    /// The displayed point nearest to a point of a volume; infinite in a hole.
    static Eigen::Vector3d displayed(const Frame& frame, const Eigen::Vector3d& p_world);
    bool is_replaced(double x, double y) const;

    bool is_ground(double x, double y) const;
    void sample_picture(const Camera& camera, Points& points) const;
    void sample_triangles(const TriangleHeap& heap, Points& points) const;

    const HeightSource& source_;
    std::size_t least_points_;
    std::optional<Frame> before_, older_;          // of the last two calls of measure()
    std::shared_ptr<const ResidentSet> resident_;  // of the frame being measured
    WorldRect drawn_;                              // ground that the frame draws
};

}  // namespace terrane::tools
