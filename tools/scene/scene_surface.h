// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/value_parsing.h"

#include <terrane/dem/imagery_raster.h>
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

/// `imagery` of a scene: colours that are draped over the ground.
struct SceneImagery {
    std::string raster;
    std::vector<int> bands;  ///< of red, green and blue, or of grey; empty: the file's own choice
};

/// Parses `imagery` of a scene: the file of a raster, or `{"file":"..","bands":[3,2,1]}`. Errors begin with the path of
/// the key.
///
/// @param folder that a relative file is found from
Parsed<SceneImagery> read_imagery(const nlohmann::ordered_json& value, const std::string& folder);

/// Opens the raster over the DEM by its georeferencing where both have a CRS, else with its middle at world (0, 0).
///
/// @param dem null where the terrain is no raster
///
/// Fails as ImageryRaster::open()
Result<std::shared_ptr<const ImagerySource>> open_imagery(const SceneImagery& imagery,
                                                          const DemInfo* dem);

/// The surface as a map. A raster lies over the DEM by its georeferencing where the DEM has a CRS, else with its middle
/// at world (0, 0).
///
/// @param dem null where the terrain is no raster
///
/// Fails as SurfaceRaster::open()
Result<std::shared_ptr<const SurfaceMap>> open_surface(const SceneSurface& surface,
                                                       const DemInfo* dem);

}  // namespace terrane::tools
