// SPDX-License-Identifier: MIT
#include "options/command.h"
#include "output/summary.h"
#include "source/terrain_options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <utility>

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

nlohmann::ordered_json describe(const Terrain& terrain) {
    const HeightSource& source = *terrain.source;
    const Lattice& lattice = source.lattice();
    const WorldRect& extent = source.extent();
    const HeightInterval guaranteed = source.interval(extent);
    nlohmann::ordered_json info;
    info["terrain"] = terrain.name;
    info["extent_m"] = {extent.west, extent.south, extent.east, extent.north};
    // of a raster the range of its samples; of a fractal a guaranteed interval
    info["min_m"] = terrain.dem ? terrain.dem->min_m : guaranteed.low;
    info["max_m"] = terrain.dem ? terrain.dem->max_m : guaranteed.high;
    info["guaranteed_m"] = {guaranteed.low, guaranteed.high};
    info["levels"] = lattice.finest_level + 1;
    info["root_size_m"] = lattice.root_size();
    info["roots"] = {lattice.root_count_x, lattice.root_count_y};
    // along the square of them that is resident; 0: all are
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
        info["samples"] = {dem.columns, dem.rows};
        info["cell_m"] = {dem.cell_x, dem.cell_y};
        info["geographic"] = dem.geographic;
        info["centre"] = {dem.centre_x, dem.centre_y};
        info["metres_per_unit"] = {dem.metres_per_unit_x, dem.metres_per_unit_y};
        info["scale_error"] = dem.scale_error;
        info["crs_from_world"] = format_crs_from_world(dem);
        info["world_from_crs"] = format_world_from_crs(dem);
    }
    if (terrain.volumes != nullptr) info["volumes"] = describe_volumes(*terrain.volumes);
    return info;
}

/// For people: a line for each volume.
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
    const CommandResult<Terrain> terrain = open_terrain(options.terrain);
    if (!terrain) return pass_on(terrain.error());
    const nlohmann::ordered_json info = describe(*terrain);
    print_summary(options.json ? info : list_volumes(info), options.json);
    return {};
}

}  // namespace

void add_info_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<InfoOptions>();
    CLI::App* info = app.add_subcommand(
        "info",
        "Describes a terrain: extent, heights, levels, the conversion to its coordinates, volumes");
    add_terrain_options(*info, options->terrain);
    info->add_flag("--json", options->json, "Print one JSON object");
    info->footer("Example: terrane info --dem tools/data/jacksboro.tif --json");
    info->callback([&context, options] { context.run = [options] { return run_info(*options); }; });
}

}  // namespace terrane::tools
