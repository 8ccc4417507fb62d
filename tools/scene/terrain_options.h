// SPDX-License-Identifier: MIT
#pragma once

#include "program/command.h"
#include "scene/http_terrain.h"
#include "scene/raster_options.h"
#include "scene/scene_bodies.h"
#include "scene/scene_nodes.h"
#include "scene/scene_objects.h"
#include "scene/scene_volumes.h"

#include <terrane/base/math.h>
#include <terrane/dem/dem_heights.h>
#include <terrane/dem/georeference.h>
#include <terrane/store/chunk_store.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/surface.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// Log2 of the largest side of a fractal's world, metres: from -2^31 to 2^31 m.
inline constexpr int kMostWorldLog2 = 32;

/// Side of the square of an endless world in which a command works, metres.
inline constexpr double kWorkSide = 131072.0;

/// Size of a fractal's world without --world-m.
enum class WorldKind {
    /// As large as its spacing allows, up to kMostWorldLog2, with a root window of twice kWorkSide that moves with the
    /// camera: for commands that draw or play.
    windowed,
    /// As large as `windowed`, in four root squares: for queries, which load little.
    whole,
    /// A side of kWorkSide around the start, in four root squares: for commands that read the whole world.
    bounded,
};

/// Sets the root squares of a fractal's world. With a side, the world is centred on (0, 0). Without a side, the
/// multiple of a root square's side nearest to the start becomes the world's centre or, if it is windowed, the origin
/// of its chunk keys: at fine spacings keys have a short range, and the world must contain the start. Heights depend
/// only on position and seed, not on the world.
///
/// @param side_m  value of --world-m, metres; rounded up to a power of two, and divided into four root squares
/// @param start   value of --start-m
/// @param settings_out its spacing must be set
///
/// Fails: exit_usage if the side or the start is out of range
CommandResult<void> lay_out_world(std::optional<double> side_m,
                                  const std::optional<WorldVec2>& start, WorldKind kind,
                                  FractalSettings& settings_out);

/// A square around a position, clipped to an extent that contains the position. Metres.
WorldRect square_around(const WorldVec2& place, double side, const WorldRect& extent);

/// The centre of a rectangle.
WorldVec2 middle_of(const WorldRect& rect);

/// The terrain of a subcommand: --dem, --seed, both, or --scene.
struct TerrainOptions {
    std::string dem;  ///< path of a raster, or path or address of a baked terrain; "" for none
    std::optional<std::uint64_t> seed;   ///< of the fractal, or of the detail on the raster
    std::optional<FractalKind> fractal;  ///< fbm if absent; only without a raster
    std::string scene;                   ///< path of a JSON file; "" for none
    std::optional<double> detail_m;      ///< finest spacing, metres
    std::optional<double> dig_spacing = std::nullopt;  ///< spacing required for digging, metres
    RasterOptions raster = {};                         ///< meaning of a raster's numbers
    std::optional<double> dem_memory_mb;  ///< memory limit for opening a raster, mebibytes
    std::vector<PlacedBody> bodies = {};  ///< of a scene
    std::optional<SceneSurface> surface = std::nullopt;      ///< of a scene
    std::shared_ptr<const SceneVolumes> volumes = {};        ///< of a scene; null: none
    std::shared_ptr<const SceneObjects> objects = {};        ///< of a scene; null: none
    std::shared_ptr<const SceneNodes> nodes = {};            ///< of a scene; null: none
    std::optional<SceneWater> water = std::nullopt;          ///< of a scene
    std::optional<SceneMaterials> materials = std::nullopt;  ///< of a scene
    std::optional<SceneImagery> imagery = std::nullopt;      ///< of a scene
    std::optional<double> world_m = std::nullopt;            ///< side of a fractal's world, metres
    WorldKind world = WorldKind::windowed;                   ///< of a fractal without world_m
    std::optional<WorldVec2> start = std::nullopt;           ///< start position of commands, metres
    std::optional<WorldVec2> start_lonlat = std::nullopt;    ///< the same as longitude and latitude
    std::string scan_file = {};                              ///< as DemSettings::scan_file
    std::string cache;         ///< a folder, "beside" or "off"; "": the user's cache folder
    HttpOptions http = {};     ///< of a baked terrain at an address
    std::string command = {};  ///< name of the command, for notes
    std::vector<std::string> scene_parts = {};  ///< see add_terrain_options(); of a scene: its own
};

/// Adds --dem, --seed, --fractal, --scene, --detail-m, --world-m, --start-m, --start-lonlat, --dem-memory-mb, --cache
/// and the flags of HttpOptions and RasterOptions. `options` must outlive the app's parse().
///
/// @param scene_parts keys of a scene that the command uses, among bodies, surface, volumes, objects, nodes, imagery,
///                    materials and water (and water_m): open_terrain() notes the others that a scene has
void add_terrain_options(CLI::App& app, TerrainOptions& options,
                         std::initializer_list<const char*> scene_parts);

/// A terrain selected on the command line.
struct Terrain {
    std::shared_ptr<const HeightSource> source;     ///< source for a pager, including volumes
    std::optional<DemInfo> dem;                     ///< of a raster
    std::string name;                               ///< for messages: the raster's path or the seed
    std::optional<StoreInfo> store = std::nullopt;  ///< of a baked terrain
    std::shared_ptr<const HttpFiles> http = {};  ///< of a baked terrain at an address; null: none
    std::vector<PlacedBody> bodies = {};         ///< of a scene
    std::shared_ptr<const SurfaceMap> surface = {};          ///< of a scene; null: none
    std::shared_ptr<const SceneVolumeField> volumes = {};    ///< of a scene; null: none
    std::shared_ptr<const SceneObjects> objects = {};        ///< of a scene; null: none
    std::shared_ptr<const SceneNodes> nodes = {};            ///< of a scene; null: none
    std::optional<SceneWater> water = std::nullopt;          ///< of a scene
    std::optional<SceneMaterials> materials = std::nullopt;  ///< of a scene
    std::shared_ptr<const ImagerySource> imagery = {};       ///< of a scene; null: none
    std::shared_ptr<const HeightSource> heightfield =
        {};                   ///< the source without its volumes; null: none
    bool is_endless = false;  ///< whether a fractal's world is as large as its spacing allows
    std::optional<WorldVec2> start =
        std::nullopt;  ///< start position of commands, inside the extent, metres
};

/// The part of the world in which a command works, to which built-in paths, default views and tints are fitted. It is
/// the extent; but with a start or in an endless world it is the square of side kWorkSide around the start, by default
/// (0, 0), clipped to the extent.
WorldRect work_region(const Terrain& terrain);

/// Default position of a command, metres: the start if there is one, otherwise the centre of work_region().
WorldVec2 start_of(const Terrain& terrain);

/// The place of a terrain on the Earth. Fails: invalid_argument without a raster, and as Georeference::create()
Result<Georeference> georeference_of(const Terrain& terrain);

/// The source of a terrain without its volumes.
std::shared_ptr<const HeightSource> heightfield_of(const Terrain& terrain);

/// Adds the volumes of a terrain to another source of its heightfield, such as a slower one. Returns `heightfield` if
/// the terrain has no volumes.
CommandResult<std::shared_ptr<const HeightSource>> with_volumes(
    const Terrain& terrain, std::shared_ptr<const HeightSource> heightfield);

/// Parses a scene file: {"dem": "file.tif", "seed": 7, "detail_m": 1} or {"seed": 7, "fractal": "ridged"}, with
/// `bodies` (read_bodies()), `surface` (read_surface()), `volumes` (read_volumes()), `objects` (read_objects()),
/// `nodes` (read_nodes()), `imagery` (read_imagery()), `materials` (read_materials()), `water` (read_water()),
/// `water_m` and the keys of RasterOptions as optional keys; refuses other keys. Paths of files are relative to the
/// folder of the scene file.
///
/// @param path of the scene file: for messages and relative paths
CommandResult<TerrainOptions> parse_scene(const std::string& text, const std::string& path);

/// Opens the selected terrain. The finest spacing of a fractal is the largest power of two up to detail_m, by default 1
/// m. That of a raster is detail_m, by default its cell, or 1 m if it has detail. Volumes refine a default that is
/// coarser than their finest voxel: a fractal gets the largest power of two up to the voxel; square cells are halved
/// until they are at most the square root of 2 times the voxel; other rasters get exactly the voxel.
/// TerrainOptions::dig_spacing acts like a voxel. A baked terrain has its own spacing. lay_out_world() sets the world
/// of a fractal.
///
/// Fails: exit_usage if no terrain is selected or a value is out of range; exit_failed if a file cannot be read or is
///        invalid
CommandResult<Terrain> open_terrain(const TerrainOptions& options);

/// The description of the raster of a terrain, for the note of its store; "" without a raster.
std::string note_of(const Terrain& terrain);

/// Adds "http", the statistics of a terrain at an address, to a summary.
void describe_http(const Terrain& terrain, nlohmann::ordered_json& summary_out);

/// Opens a terrain written by `terrane bake`.
CommandResult<Terrain> open_baked(const std::string& path);

/// The cache of bounds selected by --cache. For "" it is the user's cache folder, $XDG_CACHE_HOME/terrane or
/// $HOME/.cache/terrane; there is no cache if neither variable is set.
DemCache choose_cache(const std::string& option);

/// Largest triangle budget.
inline constexpr std::size_t kMostTriangles = 1'000'000'000;

/// Check that --budget (triangles) and --memory-mb are enough for the root squares of the terrain, which are always
/// resident. Fail with exit_failed, not exit_usage, because the number of root squares depends on the terrain.
CommandResult<void> check_budget(const Terrain& terrain, std::size_t budget);
CommandResult<void> check_memory(const Terrain& terrain, double memory_mb);

}  // namespace terrane::tools
