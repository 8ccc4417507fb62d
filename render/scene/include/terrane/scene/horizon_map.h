// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <memory>
#include <optional>

namespace terrane {

/// Certified bounds of a frame's drawn ground relative to the true surface, see TerrainMesh.
struct GroundError {
    double refinable_px = 0.0;  ///< bound of TerrainMesh::refinable_error_px, >= 0
    double finest_m = 0.0;      ///< bound of TerrainMesh::finest_error_m, metres, >= 0
};

/// Occlusion by the ground as seen from one eye: for each of 1024 azimuth sectors and about 250 distances, a slope
/// (rise over horizontal distance). Everything beyond the distance and below the slope is behind the drawn ground.
///
/// Conservative: if hides() is true, the frame's ground covers every pixel of the object, provided that holds_for() is
/// true for the drawn mesh. A hidden object is behind the true surface too. It may still cast a visible shadow.
///
/// The map hides nothing if the eye is outside the extent, below the ground or within near_distance of it, if a root
/// square is not resident, or if the source is not certified. Nothing beyond nodata or ground with volumes is hidden.
///
/// Threads: hides() any number at once; build() alone
class HorizonMap {
public:
    HorizonMap();
    HorizonMap(HorizonMap&&) noexcept;
    HorizonMap& operator=(HorizonMap&&) noexcept;
    ~HorizonMap();

    /// Rebuilds the map for a view over the resident chunks. The map hides nothing if the view is invalid, the set is
    /// null, an error is NaN, infinite or negative, or the refinable error plus one pixel is 0.25 radians or more.
    ///
    /// @param largest assumed upper limits of the frame's errors, which Triangulator::update() determines later. One
    ///                pixel is added for rounding on the GPU
    ///
    /// Allocates: 1 MB at first
    /// Cost:      `scene_benchmark --benchmark_filter=horizon`
    void build(const std::shared_ptr<const ResidentSet>& resident, const View& view,
               const GroundError& largest);

    /// Whether the map is valid for a frame: the frame's errors are within the limits, and the eye is above the drawn
    /// ground. If not, restart the frame without the map. True if the map hides nothing.
    ///
    /// @param mesh         mesh of the map's view and resident set
    /// @param is_eye_above for triangles on a device: GpuTriangulator::is_above_ground() of the eye. Without a value,
    ///                     the triangles of `mesh` are searched
    ///
    /// Cost: O(triangles of the chunks below the eye)
    bool holds_for(const TerrainMesh& mesh, std::optional<bool> is_eye_above = {}) const;

    /// Resets the map to one that hides nothing.
    void clear();

    /// Whether the map was built for this view and hides anything.
    bool is_of(const View& view) const;

    /// Whether the ground hides the part of a sphere that is in view. False if unknown, or if the sphere is not finite.
    bool hides(const BoundingSphere& sphere_world) const;
    /// Whether the ground hides the part of a box that is in view. False if unknown, or if the box is not finite.
    bool hides(const Aabb& box_world) const;
    /// Whether hides() may be true for an object in a box whose bounding sphere has its centre there: false saves its
    /// calls for all objects of a group.
    bool may_hide_in(const Aabb& box_world) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace terrane
