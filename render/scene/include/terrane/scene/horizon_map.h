// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <memory>

namespace terrane {

/// Certified bounds of a frame's drawn ground relative to the true surface, see TerrainMesh.
struct GroundError {
    double refinable_px = 0.0;  ///< of TerrainMesh::refinable_error_px, >= 0
    double finest_m = 0.0;      ///< of TerrainMesh::finest_error_m, metres, >= 0
};

/// Occlusion by the ground as seen from one eye: for each of 1024 azimuth sectors and about 250 distance bins, the
/// slope (rise over horizontal distance) below which everything farther away is behind the drawn ground.
///
/// Conservative: if hides() is true, the frame's ground covers every pixel of the object, provided that holds_for() is
/// true for the drawn mesh. Hidden means behind the drawn ground, hence behind the true surface wherever that is not
/// lower than the drawn one. A hidden object may still cast a visible shadow.
///
/// Hides nothing if the eye is outside the extent, below the ground or within near_distance of it, while a root square
/// is not resident, beyond nodata or ground with volumes, and if the source is not certified.
///
/// Threads: hides() any number at once; build() alone
class HorizonMap {
public:
    HorizonMap();
    HorizonMap(HorizonMap&&) noexcept;
    HorizonMap& operator=(HorizonMap&&) noexcept;
    ~HorizonMap();

    /// Rebuilds the map for a view over the resident chunks. The map hides nothing for an invalid view, a null set, and
    /// errors that are NaN, infinite, negative, or, in pixels, a quarter of a radian or more.
    ///
    /// @param largest upper limits of the frame's errors, which are not known before Triangulator::update(). One more
    ///                pixel is allowed for rounding on the GPU
    ///
    /// Allocates: 1 MB at first
    /// Cost:      `scene_benchmark --benchmark_filter=horizon`
    void build(const std::shared_ptr<const ResidentSet>& resident, const View& view,
               const GroundError& largest);

    /// Whether the map is valid for a frame: the frame's errors are within the limits, and the eye is above the drawn
    /// ground. If not, restart the frame without the map. True if the map hides nothing.
    ///
    /// @param mesh for the map's view and resident set
    ///
    /// Cost: O(triangles of the chunks below the eye)
    bool holds_for(const TerrainMesh& mesh) const;

    /// Resets the map to one that hides nothing.
    void clear();

    /// Whether the map was built for this view and hides anything.
    bool is_of(const View& view) const;

    /// Whether the visible part of a ball is entirely behind the ground. False if unknown, or if the ball is not
    /// finite.
    bool hides(const BoundingSphere& sphere_world) const;
    /// The same for a box.
    bool hides(const Aabb& box_world) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace terrane
