// SPDX-License-Identifier: MIT
#include "program/command.h"
#include "program/options.h"
#include "program/progress.h"
#include "program/summary.h"
#include "scene/terrain_options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

struct InfoOptions {
    TerrainOptions terrain;
    bool json = false;
};

/// "X = centre_x + x / metres_per_unit_x" with the axis names of the raster's CRS.
std::string format_crs_from_world(const DemInfo& dem) {
    const char* const east = dem.geographic ? "longitude" : "easting";
    const char* const north = dem.geographic ? "latitude" : "northing";
    return fmt::format("{} = {} + x / {}; {} = {} + y / {}", east, dem.centre_x,
                       dem.metres_per_unit_x, north, dem.centre_y, dem.metres_per_unit_y);
}

std::string format_world_from_crs(const DemInfo& dem) {
    const char* const east = dem.geographic ? "longitude" : "easting";
    const char* const north = dem.geographic ? "latitude" : "northing";
    return fmt::format("x = ({} - {}) * {}; y = ({} - {}) * {}", east, dem.centre_x,
                       dem.metres_per_unit_x, north, dem.centre_y, dem.metres_per_unit_y);
}

/// A place on the Earth, with the scale of the plane there.
nlohmann::ordered_json describe_place(const Georeference& georeference, double x, double y) {
    const Eigen::Vector3d lonlat = georeference.lonlat_from_world({x, y, 0.0});
    const PlaneScale scale = georeference.scale_at(x, y);
    nlohmann::ordered_json place;
    place["lonlat"] = {lonlat.x(), lonlat.y()};
    place["scale"] = {scale.x, scale.y};
    // Without the noise of rounding
    constexpr double kPerDegree = 1e9;
    place["convergence_deg"] =
        std::round(scale.convergence * 180.0 / std::numbers::pi * kPerDegree) / kPerDegree;
    return place;
}

/// Adds where a raster is on the Earth: at its middle and its corners, NaN where it is beyond its projection.
void describe_earth(const Terrain& terrain, nlohmann::ordered_json& info_out) {
    const Result<Georeference> georeference = georeference_of(terrain);
    if (!georeference) {
        info_out["heights"] = "unknown, " + georeference.error().message;
        return;
    }
    info_out["heights"] = georeference->describe_heights();
    const WorldRect& e = terrain.source->extent();
    const WorldVec2 middle = middle_of(e);
    info_out["middle"] = describe_place(*georeference, middle.x(), middle.y());
    info_out["south_west"] = describe_place(*georeference, e.west, e.south);
    info_out["south_east"] = describe_place(*georeference, e.east, e.south);
    info_out["north_west"] = describe_place(*georeference, e.west, e.north);
    info_out["north_east"] = describe_place(*georeference, e.east, e.north);
}

nlohmann::ordered_json describe(const Terrain& terrain) {
    const HeightSource& source = *terrain.source;
    const Lattice& lattice = source.lattice();
    const WorldRect& extent = source.extent();
    const HeightInterval guaranteed = source.interval(extent);
    nlohmann::ordered_json info;
    info["terrain"] = terrain.name;
    info["extent_m"] = {extent.west, extent.south, extent.east, extent.north};
    // range of a raster's samples, or guaranteed interval of a fractal
    info["min_m"] = terrain.dem ? terrain.dem->min_m : guaranteed.low;
    info["max_m"] = terrain.dem ? terrain.dem->max_m : guaranteed.high;
    info["guaranteed_m"] = {guaranteed.low, guaranteed.high};
    info["levels"] = lattice.finest_level + 1;
    info["root_size_m"] = lattice.root_size();
    info["roots"] = {lattice.root_count_x, lattice.root_count_y};
    // side of the root window, in root squares; 0: all root squares are resident
    info["root_window"] = lattice.root_window;
    info["finest_spacing_m"] = lattice.spacing;
    // origin of cell indices; cells with an even index sum are split from south-west to north-east
    info["lattice_origin_m"] = {lattice.origin_x, lattice.origin_y};
    info["quantum_m"] = lattice.quantum;
    info["crs"] = terrain.dem ? terrain.dem->crs : std::string();
    info["nodata_share"] = terrain.dem ? terrain.dem->nodata_share : 0.0;
    info["filled_share"] = terrain.dem ? terrain.dem->filled_share : 0.0;
    if (terrain.store) {
        info["chunks"] = terrain.store->chunk_count;
        info["bytes"] = terrain.store->bytes;
        info["max_error_m"] = terrain.store->max_error_m;
        info["sha"] = terrain.store->sha;
    }
    if (terrain.dem) {
        const DemInfo& dem = *terrain.dem;
        // What each was taken to be, and from where; a baked terrain does not tell.
        for (const auto& [key, text] : {std::pair{"numbers", &dem.numbers},
                                        {"height_unit", &dem.height_unit},
                                        {"vertical_axis", &dem.vertical_axis},
                                        {"void", &dem.nodata},
                                        {"placement", &dem.placement}}) {
            if (!text->empty()) info[key] = *text;
        }
        info["samples"] = {dem.columns, dem.rows};
        info["cell_m"] = {dem.cell_x, dem.cell_y};
        info["geographic"] = dem.geographic;
        info["centre"] = {dem.centre_x, dem.centre_y};
        info["metres_per_unit"] = {dem.metres_per_unit_x, dem.metres_per_unit_y};
        info["scale_error"] = dem.scale_error;
        if (dem.resampling_error > 0.0) info["resampling_error_m"] = dem.resampling_error;
        if (dem.projection == DemProjection::local) {
            info["middle_lonlat"] = {dem.middle_longitude, dem.middle_latitude};
        }
        info["crs_from_world"] = format_crs_from_world(dem);
        info["world_from_crs"] = format_world_from_crs(dem);
        describe_earth(terrain, info);
    }
    if (terrain.volumes != nullptr) info["volumes"] = describe_volumes(*terrain.volumes);
    return info;
}

/// One line per volume, for people.
nlohmann::ordered_json list_volumes(nlohmann::ordered_json info) {
    if (!info.contains("volumes")) return info;
    const nlohmann::ordered_json volumes = std::move(info["volumes"]);
    info["volumes"] = volumes.size();
    for (std::size_t i = 0; i < volumes.size(); ++i) {
        info[fmt::format("volumes[{}]", i)] = volumes[i];
    }
    return info;
}

CommandResult<void> run_info(const InfoOptions& options) {
    TERRANE_TRY(const Terrain terrain, open_terrain(options.terrain));
    nlohmann::ordered_json info = describe(terrain);
    // Without --json they are lines on standard error.
    if (options.json && terrain.dem) info["notes"] = terrain.dem->notes;
    print_summary(options.json ? info : list_volumes(info), options.json);
    return {};
}

}  // namespace

void add_info_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<InfoOptions>();
    CLI::App* info = app.add_subcommand(
        "info",
        "Describes a terrain: extent, heights, levels, the conversion to its coordinates, volumes");
    add_terrain_options(*info, options->terrain, {"volumes"});
    info->add_flag("--json", options->json, "Print one JSON object");
    info->footer("Example: terrane info --dem tools/data/jacksboro.tif --json");
    info->callback([&context, options] { context.run = [options] { return run_info(*options); }; });
}

namespace {

struct BakeOptions {
    TerrainOptions terrain;
    std::string out;
    std::size_t levels = 0;
    std::size_t threads = 0;
    std::vector<double> region;
    bool json = false;
};

CommandResult<void> run_bake(const BakeOptions& options) {
    TerrainOptions wanted = options.terrain;
    wanted.world = WorldKind::bounded;
    TERRANE_TRY(const Terrain terrain, open_terrain(wanted));
    BakeSettings settings;
    const int levels = terrain.source->lattice().finest_level + 1;
    if (options.levels > static_cast<std::size_t>(levels)) {
        return usage_error(fmt::format("--levels must be 1 to {} over this terrain, got {}", levels,
                                       options.levels));
    }
    settings.level_count = static_cast<int>(options.levels);
    settings.worker_count = static_cast<int>(options.threads);
    settings.note = note_of(terrain);
    if (!options.region.empty()) {
        settings.region =
            WorldRect{options.region[0], options.region[1], options.region[2], options.region[3]};
    }
    Progress progress("baking");
    watch_for_interrupts();
    settings.progress = [&progress](double share) {
        progress.show(share);
        return !is_interrupted();
    };
    // a store contains only heights: a scene adds its volumes to a baked terrain as to any other
    const Result<StoreInfo> baked =
        ChunkStore::bake(*heightfield_of(terrain), options.out, settings);
    if (!baked && baked.error().code == ErrorCode::invalid_argument) {
        return usage_error(baked.error().message);
    }
    if (!baked) return pass_on(baked.error());
    nlohmann::ordered_json summary;
    summary["chunks"] = baked->chunk_count;
    summary["bytes"] = baked->bytes;
    summary["max_error_m"] = baked->max_error_m;
    summary["sha"] = baked->sha;
    summary["out"] = options.out;
    if (terrain.volumes != nullptr) {
        summary["volumes_left_out"] = describe_volumes(*terrain.volumes).size();
    }
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_bake_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<BakeOptions>();
    CLI::App* bake = app.add_subcommand("bake",
                                        "Writes a terrain as a file of compressed chunks with "
                                        "exact bounds, which --dem opens at once");
    add_terrain_options(*bake, options->terrain, {});
    bake->add_option("--out", options->out, "File to write; one that is there is replaced")
        ->type_name("FILE.terrane")
        ->required();
    add_count(*bake, "--levels", options->levels, 1,
              "Levels to bake, from the root squares on; all of them unless said");
    bake->add_option(
            "--region", options->region,
            "Bake a part of the world only: west, south, east, north in metres, widened to "
            "whole chunks")
        ->type_name("W,S,E,N")
        ->delimiter(',')
        ->expected(4);
    add_count(
        *bake, "--threads", options->threads, 1,
        "Threads that make chunks, as many as the machine has unless said; the file is the same");
    bake->add_flag("--json", options->json, "Print one JSON object");
    bake->footer("Example: terrane bake --dem tools/data/jacksboro.tif --out jacksboro.terrane");
    bake->callback([&context, options] { context.run = [options] { return run_bake(*options); }; });
}

}  // namespace terrane::tools
