// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/triangulator.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::test {

/// Objects that share a frame's triangle budget with the ground.
struct CostObjects {
    /// The triangles that the objects in view need at each threshold; valid until the next call.
    std::function<std::span<const TriangleDemand>(const View&)> demands;
    /// Chooses their levels of detail for a threshold, pixels, and returns the triangles of the frame's objects.
    std::function<std::size_t(double threshold_px)> draw;
};

/// What a flight and a drop are played in.
struct CostScene {
    std::shared_ptr<const HeightSource> source;  ///< of the ground around (0, 0)
    int body_count = 20;                         ///< of the drop
    std::unique_ptr<CostObjects> objects;        ///< null: none
};

/// The scenes that this program was built with: `plane`, `fractal` and `bodies`; with dem also `dem` and `dem_detail`;
/// with scene `objects`; with volume `volumes`; with all three `all`.
std::vector<std::string_view> cost_scene_names();

/// A scene by its name.
///
/// `bodies`, `objects` and `volumes` are the plane with 1000 bodies, 20,000 trees, a tunnel and a pit. `all` is all of
/// them on the DEM with detail.
///
/// @param dem path of the raster of `dem`, `dem_detail` and `all`
///
/// Fails: invalid_argument for an unknown name; as DemHeights::open()
Result<CostScene> make_cost_scene(std::string_view name, const std::string& dem);

}  // namespace terrane::test
