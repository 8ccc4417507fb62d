// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/dem_heights.h>
#include <terrane/playback/camera_path.h>
#include <terrane/playback/track.h>

#include <optional>

namespace terrane::tools {

/// Where longitudes and latitudes lie in the world of a raster, or why there are none.
GeoReference make_geo_reference(const std::optional<DemInfo>& dem);

/// CameraPath::create() along a track; its errors name the flag --start-s.
Result<CameraPath> follow_track(Track track, const HeightSource& source,
                                const CameraPathSettings& settings);

}  // namespace terrane::tools
