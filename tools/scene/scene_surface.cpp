// SPDX-License-Identifier: MIT
#include "scene/scene_surface.h"

#include "scene/scene_keys.h"

#include <fmt/format.h>

#include <filesystem>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

Parsed<SurfaceRect> read_rect(const Json& object) {
    const Parsed<std::array<double, 4>> edges = read_array<4>(object, "rect");
    if (!edges) return wrong(edges.error());
    const auto [west, south, east, north] = *edges;
    if (!(west <= east && south <= north)) {
        return wrong(fmt::format(
            "rect must be [west, south, east, north] with west <= east and south <= north, got {}",
            shown(object["rect"])));
    }
    if (!object.contains("friction")) return wrong("friction is missing");
    SurfaceRect rect{.rect = {west, south, east, north}};
    const Parsed<double> friction = read_in_range(object, "friction", 0.0, 0.0, 1e6);
    if (!friction) return wrong(friction.error());
    rect.properties.friction = *friction;
    const Parsed<double> restitution =
        read_in_range(object, "restitution", rect.properties.restitution, 0.0, 1.0);
    if (!restitution) return wrong(restitution.error());
    rect.properties.restitution = *restitution;
    return rect;
}

}  // namespace

Parsed<SceneSurface> read_surface(const Json& value, const std::string& folder) {
    SceneSurface surface;
    if (value.is_string() && !value.get<std::string>().empty()) {
        surface.raster = (std::filesystem::path(folder) / value.get<std::string>()).string();
        return surface;
    }
    if (!value.is_array()) {
        return wrong("surface must be a path or a list of rectangles, got " + shown(value));
    }
    for (const Json& each : value) {
        const std::string path = fmt::format("surface[{}]", surface.rects.size());
        const Parsed<void> good = check_keys(each, path, {"rect", "friction", "restitution"});
        if (!good) return wrong(good.error());
        const Parsed<SurfaceRect> rect = read_rect(each);
        if (!rect) return wrong(path + "." + rect.error());
        surface.rects.push_back(*rect);
    }
    return surface;
}

Result<std::shared_ptr<const SurfaceMap>> open_surface(const SceneSurface& surface,
                                                       const DemInfo* dem) {
    if (surface.raster.empty()) return SurfaceMap::from_rects(surface.rects);
    SurfaceRasterSettings settings;
    settings.numbers = SurfaceNumbers::friction;
    if (dem != nullptr && !dem->crs.empty()) settings.aligned_with = *dem;
    return SurfaceRaster::open(surface.raster, settings);
}

}  // namespace terrane::tools
