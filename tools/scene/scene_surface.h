// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/value_parsing.h"

#include <terrane/dem/surface_raster.h>

#include <memory>
#include <string>
#include <vector>

namespace terrane::tools {

/// `surface` of a scene: friction by place.
struct SceneSurface {
    std::string raster;              ///< path of a raster of friction; "" for rectangles
    std::vector<SurfaceRect> rects;  ///< the last one that contains a place decides
};

/// Parses `surface` of a scene: the file of a raster, or
/// `[{"rect":[west,south,east,north],"friction":f,"restitution":r}..]`, metres of the world. Errors begin with the path
/// of the key.
///
/// @param folder that a relative file is found from
Parsed<SceneSurface> read_surface(const nlohmann::ordered_json& value, const std::string& folder);

/// The surface as a map. A raster lies over the DEM by its georeferencing where the DEM has a CRS, else with its middle
/// at world (0, 0).
///
/// @param dem null where the terrain is no raster
///
/// Fails as SurfaceRaster::open()
Result<std::shared_ptr<const SurfaceMap>> open_surface(const SceneSurface& surface,
                                                       const DemInfo* dem);

}  // namespace terrane::tools
