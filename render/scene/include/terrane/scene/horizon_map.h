// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <memory>

namespace terrane {

/// What a frame's drawn ground is certified to deviate from the true surface by, at most: see TerrainMesh.
struct GroundError {
    double refinable_px = 0.0;  ///< of TerrainMesh::refinable_error_px, >= 0
    double finest_m = 0.0;      ///< of TerrainMesh::finest_error_m, metres, >= 0
};

/// What the ground hides from an eye: for each of 1024 sectors of azimuth and some 250 bins of distance, the slope
/// (rise over horizontal distance) up to which everything beyond is behind the drawn ground.
///
/// Conservative: what hides() is true of has no pixel that the frame's ground does not cover, provided that holds_for()
/// is true of the mesh that is drawn. Hidden means behind the drawn ground, and so behind the true surface where that
/// is not lower than the drawn one. A hidden object may still cast a visible shadow.
///
/// Hides nothing for an eye outside the extent or within near_distance of the ground or below it; while a root square
/// is absent; beyond ground that is nodata or has volumes; of a source that is not certified.
///
/// Threads: hides() any number at once; build() alone
class HorizonMap {
public:
    HorizonMap();
    HorizonMap(HorizonMap&&) noexcept;
    HorizonMap& operator=(HorizonMap&&) noexcept;
    ~HorizonMap();

    /// Replaces the map by that of a view over the resident chunks. An invalid view, a null set, and errors that are
    /// NaN, infinite, below 0, or in pixels a quarter of a radian and more give a map that hides nothing.
    ///
    /// @param largest upper limits of the frame's errors, which are not known before Triangulator::update(). A pixel
    ///                more is left for rounding on the GPU
    ///
    /// Allocates: 1 MB at first
    /// Cost:      `scene_benchmark --benchmark_filter=horizon`
    void build(const std::shared_ptr<const ResidentSet>& resident, const View& view,
               const GroundError& largest);

    /// Whether the map is certain for a frame: its errors are within the limits, and the eye is above its ground. If
    /// not, begin the frame again without the map. True where the map hides nothing.
    ///
    /// @param mesh of the view and the resident set of the map
    ///
    /// Cost: O(triangles of the chunks at the eye)
    bool holds_for(const TerrainMesh& mesh) const;

    /// Hides nothing from now on.
    void clear();

    /// Whether it is the map of this view, and hides anything at all.
    bool is_of(const View& view) const;

    /// Whether all of a ball that the view can show is behind the ground. False where that is not known, and for what
    /// is not finite.
    bool hides(const BoundingSphere& ball_world) const;
    /// The same of a box.
    bool hides(const Aabb& box_world) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace terrane
