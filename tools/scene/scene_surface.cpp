// SPDX-License-Identifier: MIT
#include "scene/scene_surface.h"

#include "scene/scene_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kMostBands = 65535;

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

Parsed<SceneImagery> read_imagery(const Json& value, const std::string& folder) {
    SceneImagery imagery;
    const auto is_path = [](const Json& text) {
        return text.is_string() && !text.get<std::string>().empty();
    };
    if (value.is_object()) {
        if (const Parsed<void> good = check_keys(value, "imagery", {"file", "bands"}); !good)
            return wrong(good.error());
    }
    const Json file = value.is_object() ? value.value("file", Json()) : value;
    if (!is_path(file)) {
        return wrong("imagery must be a path or an object with a file, got " + shown(value));
    }
    imagery.raster = (std::filesystem::path(folder) / file.get<std::string>()).string();
    if (!value.is_object() || !value.contains("bands")) return imagery;
    const Json& bands = value["bands"];
    const auto is_band = [](const Json& band) {
        return band.is_number_unsigned() && band.get<std::uint64_t>() <= kMostBands;
    };
    if (!bands.is_array() || (bands.size() != 1 && bands.size() != 3) ||
        !std::ranges::all_of(bands, is_band)) {
        return wrong("imagery.bands must be 1 or 3 numbers of bands, got " + shown(bands));
    }
    for (const Json& band : bands) imagery.bands.push_back(band.get<int>());
    return imagery;
}

Result<std::shared_ptr<const ImagerySource>> open_imagery(const SceneImagery& imagery,
                                                          const DemInfo* dem) {
    ImageryRasterSettings settings;
    settings.bands = imagery.bands;
    if (dem != nullptr) settings.aligned_with = *dem;
    return ImageryRaster::open(imagery.raster, settings);
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
