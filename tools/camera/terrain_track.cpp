// SPDX-License-Identifier: MIT
#include "camera/terrain_track.h"

#include <string_view>
#include <utility>

namespace terrane::tools {

GeoReference make_geo_reference(const std::optional<DemInfo>& dem) {
    GeoReference reference;
    if (!dem) return reference;
    reference.is_geographic = dem->geographic;
    reference.longitude = dem->centre_x;
    reference.latitude = dem->centre_y;
    reference.metres_per_degree_x = dem->metres_per_unit_x;
    reference.metres_per_degree_y = dem->metres_per_unit_y;
    reference.why_not =
        dem->crs.empty() ? "this raster has no CRS" : "this raster's CRS is " + dem->crs;
    return reference;
}

Result<CameraPath> follow_track(Track track, const HeightSource& source,
                                const CameraPathSettings& settings) {
    constexpr std::string_view kStart = "start must ";
    Result<CameraPath> path = CameraPath::create(std::move(track), source, settings);
    if (!path && path.error().message.starts_with(kStart)) {
        Error error = path.error();
        error.message = "--start-s must " + error.message.substr(kStart.size());
        return tl::unexpected(std::move(error));
    }
    return path;
}

}  // namespace terrane::tools
