// SPDX-License-Identifier: MIT
#include "cost/scenes.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/function_heights.h>

#include <algorithm>
#include <utility>

#if TERRANE_COST_DEM
#include <terrane/dem/dem_heights.h>
#endif
#if TERRANE_COST_SCENE
#include "scene/objects/random_scene.h"

#include <terrane/scene/scene.h>
#endif
#if TERRANE_COST_VOLUME
#include <terrane/volume/volume_heights.h>
#endif

namespace terrane::test {
namespace {

using Source = std::shared_ptr<const HeightSource>;

Result<Source> make_plane() {
    return heights_from_function([](double, double) { return 0.0; },
                                 {.extent = {-2048.0, -2048.0, 2048.0, 2048.0},
                                  .slope = 0.0,
                                  .range = HeightInterval{0.0, 0.0}});
}

// Low hills of 4 km x 4 km.
Result<Source> make_hills() {
    FractalSettings settings;
    settings.seed = 7;
    settings.octave_count = 6;
    settings.amplitude = 20.0;
    settings.wavelength_log2 = 10;
    settings.root_size_log2 = 11;
    return FractalHeights::create(settings);
}

#if TERRANE_COST_DEM
Result<Source> open_dem(const std::string& path, bool has_detail) {
    DemSettings settings;
    if (has_detail) {
        settings.finest_spacing = 1.0;
        settings.detail_seed = 7;
    }
    return DemHeights::open(path, settings);
}
#endif

#if TERRANE_COST_SCENE
// Trees over 4 km x 4 km, whose feet stand on the source's true surface.
Result<std::unique_ptr<CostObjects>> plant_trees(const HeightSource& source) {
    auto created = Scene::create({});
    if (!created) return tl::unexpected(created.error());
    const auto scene = std::make_shared<Scene>(std::move(*created));
    const auto model = scene->add_model(tree_model());
    if (!model) return tl::unexpected(model.error());
    Random random(7);
    std::vector<PlacedObject> trees = spread_objects(random, 20'000, 2000.0);
    for (PlacedObject& tree : trees) {
        WorldPos& place = tree.position_world;
        place.z() = source.height(place.x(), place.y());
    }
    if (const auto group = scene->add_group(*model, trees); !group)
        return tl::unexpected(group.error());
    auto objects = std::make_unique<CostObjects>();
    objects->demands = [scene](const View& view) { return scene->begin_frame(view); };
    objects->draw = [scene](double threshold_px) {
        scene->end_frame(threshold_px);
        return scene->counts().triangles;
    };
    return objects;
}
#endif

#if TERRANE_COST_VOLUME
// A pit under the bodies and a tunnel from it to the east, below the surface at (0, 0).
Result<Source> dig(const Source& heights) {
    const double z = heights->height(0.0, 0.0);
    VolumeOperation pit, tunnel;
    pit.shape = VolumeSphere{.radius = 8.0};
    pit.world_from_shape.translation = {0.0, 0.0, z};
    pit.voxel = 1.0;
    tunnel.shape = VolumeTube{.path_shape = {{0.0, 0.0, -4.0}, {200.0, 0.0, -4.0}}, .radius = 3.0};
    tunnel.world_from_shape.translation = {0.0, 0.0, z};
    tunnel.voxel = 1.0;
    const VolumeOperation operations[] = {pit, tunnel};
    const auto volumes = Volumes::create(heights->lattice(), operations);
    if (!volumes) return tl::unexpected(volumes.error());
    const auto joined = VolumeHeights::create(heights, *volumes);
    if (!joined) return tl::unexpected(joined.error());
    return Source(*joined);
}
#endif

Error unknown(std::string_view name) {
    std::string known;
    for (const std::string_view scene : cost_scene_names())
        known += (known.empty() ? "" : ", ") + std::string(scene);
    return {ErrorCode::invalid_argument,
            "no scene \"" + std::string(name) + "\"; known are " + known};
}

Result<Source> make_source(std::string_view name, [[maybe_unused]] const std::string& dem) {
    if (name == "fractal") return make_hills();
#if TERRANE_COST_DEM
    if (name == "dem") return open_dem(dem, false);
    if (name == "dem_detail" || name == "all") return open_dem(dem, true);
#endif
    return make_plane();
}

}  // namespace

std::vector<std::string_view> cost_scene_names() {
    return {
        "plane", "fractal", "bodies",
#if TERRANE_COST_DEM
            "dem", "dem_detail",
#endif
#if TERRANE_COST_SCENE
            "objects",
#endif
#if TERRANE_COST_VOLUME
            "volumes",
#endif
#if TERRANE_COST_DEM && TERRANE_COST_SCENE && TERRANE_COST_VOLUME
            "all",
#endif
    };
}

Result<CostScene> make_cost_scene(std::string_view name, const std::string& dem) {
    const std::vector<std::string_view> names = cost_scene_names();
    if (std::find(names.begin(), names.end(), name) == names.end())
        return tl::unexpected(unknown(name));
    Result<Source> source = make_source(name, dem);
    if (!source) return tl::unexpected(source.error());
    CostScene scene{.source = std::move(*source), .objects = nullptr};
    if (name == "bodies" || name == "all") scene.body_count = 1000;
#if TERRANE_COST_SCENE
    if (name == "objects" || name == "all") {
        auto objects = plant_trees(*scene.source);
        if (!objects) return tl::unexpected(objects.error());
        scene.objects = std::move(*objects);
    }
#endif
#if TERRANE_COST_VOLUME
    if (name == "volumes" || name == "all") {
        Result<Source> dug = dig(scene.source);
        if (!dug) return tl::unexpected(dug.error());
        scene.source = std::move(*dug);
    }
#endif
    return scene;
}

}  // namespace terrane::test
