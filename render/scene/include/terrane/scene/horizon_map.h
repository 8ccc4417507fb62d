// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/aabb.h>
#include <terrane/terrain/bounding_sphere.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <memory>

namespace terrane {

/// What the ground hides from an eye: for each of 1024 sectors of azimuth and some 250 bins of distance, the slope
/// (rise over horizontal distance) up to which everything beyond is behind the drawn ground.
///
/// Conservative: what hides() is true of has no pixel that the frame's ground does not cover, provided that
///   - the mesh that is drawn has an error_px (TerrainMesh) of at most the map's ground_error_px;
///   - the eye is above the drawn ground.
/// It is a matter of sight alone: what is hidden may still cast a visible shadow.
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

    /// Replaces the map by that of a view over the resident chunks. An invalid view, a null set, and an error that is
    /// NaN, below 0 or a quarter of a radian and more give a map that hides nothing.
    ///
    /// @param ground_error_px largest TerrainMesh::error_px of the frame, pixels. A pixel more is left for rounding on
    ///                        the GPU. It is not known before Triangulator::update(): take an upper limit, and where it
    ///                        was exceeded, begin the frame again without the map
    ///
    /// Allocates: 1 MB at first
    /// Cost:      `scene_benchmark --benchmark_filter=horizon`
    void build(const std::shared_ptr<const ResidentSet>& resident, const View& view,
               double ground_error_px);

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
