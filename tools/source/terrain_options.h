// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"

#include <terrane/dem/dem_heights.h>
#include <terrane/store/chunk_store.h>
#include <terrane/terrain/fractal_heights.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace terrane::tools {

/// Which terrain, as every subcommand is told: --dem, --seed, both, or --scene.
struct TerrainOptions {
    std::string dem;                      ///< path of a raster or a baked terrain; "" for none
    std::optional<std::uint64_t> seed;    ///< of the fractal, or of the detail on the raster
    std::optional<FractalKind> fractal;   ///< fbm unless said; only without a raster
    std::string scene;                    ///< path of a JSON file; "" for none
    std::optional<double> detail_m;       ///< finest spacing, metres
    std::optional<double> dem_memory_mb;  ///< most memory for opening a raster, mebibytes
    std::string cache;                    ///< a folder, "beside" or "off"; "": the user's own
};

/// Adds --dem, --seed, --fractal, --scene, --detail-m, --dem-memory-mb and --cache. `options` must outlive the parse.
void add_terrain_options(CLI::App& app, TerrainOptions& options);

/// A terrain that was chosen on the command line.
struct Terrain {
    std::shared_ptr<const HeightSource> source;
    std::optional<DemInfo> dem;  ///< what the raster is, where there is one
    std::string name;            ///< what a person would call it: the raster's path, the seed
    std::optional<StoreInfo> store = std::nullopt;  ///< of a baked terrain
};

/// What a scene file says, and nothing else: {"dem": "file.tif", "seed": 7, "detail_m": 1} or
/// {"seed": 7, "fractal": "ridged"}. A raster's path counts from the scene file's folder.
///
/// @param path where the text came from: for messages, and for that folder
CommandResult<TerrainOptions> parse_scene(const std::string& text, const std::string& path);

/// Opens what was chosen. A fractal's finest spacing is the largest power of two that is at most
/// detail_m, 1 m without; a raster's is its own cell, 1 m with detail.
///
/// Fails: exit_usage where nothing was chosen or a value is out of range; exit_failed where a file
///        cannot be read or makes no sense
CommandResult<Terrain> open_terrain(const TerrainOptions& options);

}  // namespace terrane::tools
