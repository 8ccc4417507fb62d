// SPDX-License-Identifier: MIT
#include "scene/terrain_options.h"

#include "program/command.h"
#include "program/options.h"
#include "program/progress.h"
#include "program/summary.h"
#include "scene/scene_bodies.h"

#include <terrane/dem/dem_note.h>
#include <terrane/store/chunk_store.h>
#include <terrane/terrain/chunk.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string_view>
#include <utility>

namespace terrane::tools {
namespace {

constexpr int kChunkLog2 = 7;     // log2 of the number of cells along a chunk's side
constexpr int kMostLevels = 24;   // below the root squares, as Lattice allows
constexpr int kBoundedLog2 = 17;  // log2 of the side of a bounded world and the limit of --world-m
// Log2 of the side of a windowed world's root squares, metres; and how many of them are resident along the window's
// side: a camera in the middle two is at least one root square away from the window's edge.
constexpr int kWindowRootLog2 = 16;
constexpr int kWindow = 4;

// Log2 of the least power of two that is not below a value.
int log2_above(double value) {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    return mantissa == 0.5 ? exponent - 1 : exponent;
}

// Largest coordinate of a world, metres: lattices lie within 2^40 spacings of 0.
double reach_of(int spacing_log2) {
    return std::ldexp(1.0, std::min(kMostWorldLog2 - 1, spacing_log2 + 40));
}

// The multiple of `side` nearest to `place`, among those at least `side` inside the range from -reach to reach.
double middle_near(double place, double side, double reach) {
    const double farthest = reach - side;
    return std::clamp(std::floor(place / side + 0.5) * side, -farthest, farthest);
}

struct RootRange {
    std::int32_t first = 0, count = 0;
};

// The root squares between -reach and reach along an axis whose chunks have keys.
RootRange roots_within(double origin, double side, double reach, int finest_level) {
    const double most = std::ldexp(1.0, 31 - finest_level) - 1.0;
    const double first = std::max(std::ceil((-reach - origin) / side), -most);
    const double end = std::min(std::floor((reach - origin) / side), most);
    return {static_cast<std::int32_t>(first), static_cast<std::int32_t>(end - first)};
}

CommandResult<void> check_start(const std::optional<WorldVec2>& start, double most) {
    if (!start || (std::abs(start->x()) <= most && std::abs(start->y()) <= most)) return {};
    return usage_error(fmt::format(
        "--start-m must be within {:.10g} m of 0,0 along each axis, got {:.10g},{:.10g}", most,
        start->x(), start->y()));
}

// Sets four root squares around a point.
void set_four_roots(double middle_x, double middle_y, int root_log2,
                    FractalSettings& settings_out) {
    settings_out.origin_x = middle_x;
    settings_out.origin_y = middle_y;
    settings_out.root_size_log2 = root_log2;
    settings_out.first_root_x = settings_out.first_root_y = -1;
    settings_out.root_count_x = settings_out.root_count_y = 2;
}

}  // namespace

CommandResult<void> lay_out_world(std::optional<double> side_m,
                                  const std::optional<WorldVec2>& start, WorldKind kind,
                                  FractalSettings& settings_out) {
    const int spacing_log2 = settings_out.finest_spacing_log2;
    const int least_log2 = spacing_log2 + kChunkLog2 + 1;
    const int whole_log2 = std::min(spacing_log2 + kChunkLog2 + kMostLevels + 1, kMostWorldLog2);
    const int most_log2 = kind == WorldKind::whole
                              ? whole_log2
                              : std::max(least_log2, std::min(whole_log2, kBoundedLog2));
    const double least = std::ldexp(1.0, least_log2), most = std::ldexp(1.0, most_log2);
    if (side_m) {
        if (!(*side_m >= least && *side_m <= most)) {
            return usage_error(fmt::format(
                "--world-m must be {:.10g} to {:.10g} over a spacing of {:.6g} m, got {:.10g}",
                least, most, std::ldexp(1.0, spacing_log2), *side_m));
        }
        set_four_roots(0.0, 0.0, log2_above(*side_m) - 1, settings_out);
        return check_start(start, std::ldexp(1.0, settings_out.root_size_log2));
    }
    const double reach = reach_of(spacing_log2);
    TERRANE_TRY(check_start(start, reach));
    const WorldVec2 middle = start.value_or(WorldVec2(0.0, 0.0));
    const auto middle_of_world = [&](double place, int root_log2) {
        return middle_near(place, std::ldexp(1.0, root_log2), reach);
    };
    if (kind != WorldKind::windowed) {
        const int root_log2 = most_log2 - 1;
        set_four_roots(middle_of_world(middle.x(), root_log2),
                       middle_of_world(middle.y(), root_log2), root_log2, settings_out);
        return {};
    }
    const int root_log2 = std::clamp(kWindowRootLog2, spacing_log2 + kChunkLog2,
                                     spacing_log2 + kChunkLog2 + kMostLevels);
    const double side = std::ldexp(1.0, root_log2);
    settings_out.root_size_log2 = root_log2;
    settings_out.origin_x = middle_of_world(middle.x(), root_log2);
    settings_out.origin_y = middle_of_world(middle.y(), root_log2);
    const int finest_level = root_log2 - spacing_log2 - kChunkLog2;
    const RootRange x = roots_within(settings_out.origin_x, side, reach, finest_level);
    const RootRange y = roots_within(settings_out.origin_y, side, reach, finest_level);
    settings_out.first_root_x = x.first;
    settings_out.root_count_x = x.count;
    settings_out.first_root_y = y.first;
    settings_out.root_count_y = y.count;
    settings_out.root_window = kWindow;
    return {};
}

WorldRect square_around(const WorldVec2& place, double side, const WorldRect& extent) {
    const double half = 0.5 * side;
    return {std::max(extent.west, place.x() - half), std::max(extent.south, place.y() - half),
            std::min(extent.east, place.x() + half), std::min(extent.north, place.y() + half)};
}

WorldVec2 middle_of(const WorldRect& rect) {
    return {0.5 * (rect.west + rect.east), 0.5 * (rect.south + rect.north)};
}

namespace {

/// Range of a fractal's finest spacing: a finer lattice is not representable, and with a coarser one a root square
/// would be smaller than a chunk.
constexpr int kFinestLog2 = -15, kCoarsestLog2 = 9;

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr double kMostMemory_mb = 1e9;
constexpr const char* kGdalCache_mb = "256";

using Json = nlohmann::ordered_json;

const std::array<std::string, 19> kSceneKeys{
    "dem",          "seed",   "fractal",  "detail_m", "bodies",  "surface",   "volumes",
    "objects",      "nodes",  "water",    "water_m",  "imagery", "materials", "height_unit",
    "height_scale", "nodata", "encoding", "cell_m",   "project"};

/// Keys that not every command uses.
constexpr std::array<std::string_view, 9> kPartKeys{
    "bodies", "surface", "volumes", "objects", "nodes", "imagery", "materials", "water", "water_m"};

std::string quoted(const std::string& text) { return "'" + text + "'"; }

/// In the order of FractalKind.
constexpr std::string_view kFractalKinds[] = {"fbm", "ridged", "hybrid", "warped"};

std::optional<FractalKind> parse_fractal_kind(std::string_view text) {
    const auto* const found = std::ranges::find(kFractalKinds, text);
    if (found == std::end(kFractalKinds)) return std::nullopt;
    return static_cast<FractalKind>(found - std::begin(kFractalKinds));
}

/// The finest voxel of volumes and digs, which may determine the finest spacing; absent if the user gave a spacing.
std::optional<double> deciding_voxel(const TerrainOptions& options) {
    if (options.detail_m) return std::nullopt;
    if (options.volumes == nullptr) return options.dig_spacing;
    const double voxel = finest_voxel(*options.volumes);
    return std::min(voxel, options.dig_spacing.value_or(voxel));
}

CommandResult<Terrain> open_fractal(const TerrainOptions& options) {
    const std::optional<double> voxel = deciding_voxel(options);
    const double detail_m = options.detail_m.value_or(std::min(voxel.value_or(1.0), 1.0));
    int exponent = 0;
    std::frexp(detail_m, &exponent);  // detail = mantissa * 2^exponent, mantissa 0.5 to 1
    const int spacing_log2 = exponent - 1;
    if (spacing_log2 < kFinestLog2 || spacing_log2 > kCoarsestLog2) {
        const std::string range =
            fmt::format("of a fractal must be {:.6g} to {:.6g}, got {:.6g}",
                        std::ldexp(1.0, kFinestLog2), std::ldexp(1.0, kCoarsestLog2), detail_m);
        if (voxel) return failure("the finest voxel_m of the volumes " + range);
        return usage_error("--detail-m " + range);
    }
    FractalSettings settings;
    settings.seed = *options.seed;
    settings.kind = options.fractal.value_or(settings.kind);
    settings.finest_spacing_log2 = spacing_log2;
    // the first octaves are the same at any spacing; a lattice finer than a metre gets further octaves for detail at
    // its own scale
    settings.octave_count =
        std::clamp(settings.octave_count - spacing_log2, settings.octave_count, 24);
    if (const auto laid_out =
            lay_out_world(options.world_m, options.start, options.world, settings);
        !laid_out)
        return pass_on(laid_out.error());
    TERRANE_TRY(std::shared_ptr<const HeightSource> source, FractalHeights::create(settings));
    std::string name = fmt::format("seed {}", settings.seed);
    if (settings.kind != FractalKind::fbm) {
        name += fmt::format(" ({})", kFractalKinds[static_cast<std::size_t>(settings.kind)]);
    }
    return Terrain{.source = source,
                   .dem = std::nullopt,
                   .name = std::move(name),
                   .is_endless = !options.world_m,
                   .start = options.start};
}

/// Sets the start position of commands on a raster.
CommandResult<Terrain> begin_at(const TerrainOptions& options, Terrain terrain) {
    const WorldRect& extent = terrain.source->extent();
    std::optional<WorldVec2> start = options.start;
    if (options.start_lonlat) {
        const Result<Georeference> georeference = georeference_of(terrain);
        if (!georeference) {
            return failure("--start-lonlat needs a raster with a CRS: " +
                           georeference.error().message);
        }
        start = georeference
                    ->world_from_lonlat({options.start_lonlat->x(), options.start_lonlat->y(), 0.0})
                    .head<2>();
    }
    if (start && !extent.contains(start->x(), start->y())) {
        const std::string lonlat =
            options.start_lonlat ? fmt::format(" (longitude {:.10g}, latitude {:.10g})",
                                               options.start_lonlat->x(), options.start_lonlat->y())
                                 : std::string();
        return failure(fmt::format(
            "{} must be over the raster, {:.10g} to {:.10g} and {:.10g} to {:.10g}, got "
            "{:.10g},{:.10g}{}",
            options.start_lonlat ? "--start-lonlat" : "--start-m", extent.west, extent.east,
            extent.south, extent.north, start->x(), start->y(), lonlat));
    }
    terrain.start = start;
    return terrain;
}

std::string user_cache_folder() {
    // relative paths must be ignored: XDG Base Directory Specification 0.8
    const char* const xdg = std::getenv("XDG_CACHE_HOME");
    if (xdg != nullptr && xdg[0] == '/') return std::string(xdg) + "/terrane";
    const char* const home = std::getenv("HOME");
    if (home != nullptr && home[0] == '/') return std::string(home) + "/.cache/terrane";
    return {};
}

/// The terrain of an opened store.
Terrain terrain_of_store(std::shared_ptr<const HeightSource> source, const StoreInfo& info,
                         std::string name) {
    Terrain terrain{
        .source = std::move(source), .dem = std::nullopt, .name = std::move(name), .store = info};
    // Another program may have written another note, which the terrain does not need.
    terrain.dem = dem_of_note(info.note);
    return terrain;
}

CommandResult<Terrain> open_dem(const TerrainOptions& options) {
    const bool is_remote = is_http_store(options.dem);
    if (is_remote || ChunkStore::is_store(options.dem)) {
        if (options.seed) return usage_error("--seed does not go with a baked terrain");
        if (options.detail_m) return usage_error("--detail-m does not go with a baked terrain");
        if (!options.raster.is_empty()) {
            return usage_error(fmt::format("{} do not go with a baked terrain", kRasterFlags));
        }
        if (!is_remote) {
            TERRANE_TRY(Terrain baked, open_baked(options.dem));
            return begin_at(options, std::move(baked));
        }
        TERRANE_TRY(const auto files,
                    open_http_store(options.dem, options.http, user_cache_folder()));
        StoreInfo info;
        TERRANE_TRY(auto source, ChunkStore::open(files, &info));
        Terrain baked = terrain_of_store(std::move(source), info, files->place());
        baked.http = files;
        return begin_at(options, std::move(baked));
    }
    DemSettings settings;
    settings.detail_seed = options.seed;
    options.raster.apply(settings);
    settings.finest_spacing = options.detail_m.value_or(options.seed ? 1.0 : 0.0);
    const std::optional<double> voxel = deciding_voxel(options);
    // keeps the default spacing of detail if it is fine enough for the voxel
    if (voxel && !(options.seed && std::numbers::sqrt2 * *voxel >= settings.finest_spacing)) {
        settings.finest_spacing = *voxel;
        settings.spacing_tolerance = std::numbers::sqrt2;
    }
    if (options.dem_memory_mb) {
        settings.memory_bytes = static_cast<std::size_t>(*options.dem_memory_mb * kMebibyte);
    }
    // GDAL's cache, by default 5 % of the machine's memory, is not part of that limit; keeps a value set by the user
    setenv("GDAL_CACHEMAX", kGdalCache_mb, 0);
    Progress progress("opening " + options.dem);
    settings.progress = [&progress](double share) {
        progress.show(share);
        return true;
    };
    settings.cache = choose_cache(options.cache);
    settings.scan_file = options.scan_file;
    DemInfo info;
    Result<std::shared_ptr<const HeightSource>> source =
        DemHeights::open(options.dem, settings, &info);
    if (!source) {
        if (source.error().code != ErrorCode::invalid_argument) return pass_on(source.error());
        // the message names the flag of a setting instead of its field
        std::string message = source.error().message;
        constexpr std::string_view kSpacing = "finest_spacing", kUnit = "height_unit";
        if (message.starts_with(kSpacing)) {
            message.replace(0, kSpacing.size(), voxel ? "the finest voxel_m" : "--detail-m");
            return voxel ? failure(std::move(message)) : usage_error(std::move(message));
        }
        if (message.starts_with(kUnit)) message.replace(0, kUnit.size(), "--height-unit");
        return usage_error(std::move(message));
    }
    if (!info.cache_note.empty()) {
        print_note(info.cache_note);
    }
    for (const std::string& note : info.notes) print_note(note);
    std::string name = options.dem;
    if (options.seed) name += fmt::format(" with detail of seed {}", *options.seed);
    return begin_at(options, {.source = *source, .dem = info, .name = std::move(name)});
}

/// Adds the content of a scene to its terrain.
CommandResult<Terrain> play_scene(const std::string& path, TerrainOptions scene, Terrain terrain) {
    terrain.bodies = std::move(scene.bodies);
    terrain.objects = std::move(scene.objects);
    terrain.nodes = std::move(scene.nodes);
    terrain.water = scene.water;
    terrain.materials = scene.materials;
    if (scene.imagery) {
        TERRANE_TRY(auto imagery,
                    open_imagery(*scene.imagery, terrain.dem ? &*terrain.dem : nullptr));
        terrain.imagery = std::move(imagery);
    }
    if (scene.volumes != nullptr) {
        auto placed = place_volumes(*scene.volumes, *terrain.source);
        if (!placed) return failure(fmt::format("scene '{}': {}", path, placed.error().message));
        terrain.volumes = *std::move(placed);
        terrain.heightfield = terrain.source;
        TERRANE_TRY(auto source, with_volumes(terrain, terrain.heightfield));
        terrain.source = std::move(source);
    }
    if (!scene.surface) return terrain;
    TERRANE_TRY(auto surface, open_surface(*scene.surface, terrain.dem ? &*terrain.dem : nullptr));
    terrain.surface = std::move(surface);
    return terrain;
}

CommandResult<std::string> read_text(const std::string& path) {
    // checked first, because a folder would open as an empty stream
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::is_regular_file(status)) {
        return failure("cannot open scene " + quoted(path) + ": " +
                       (error ? error.message() : "it is not a file"));
    }
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file.good() && !file.eof()) return failure("cannot read scene " + quoted(path));
    return text;
}

}  // namespace

void add_terrain_options(CLI::App& app, TerrainOptions& options,
                         std::initializer_list<const char*> scene_parts) {
    options.command = app.get_name();
    options.scene_parts.assign(scene_parts.begin(), scene_parts.end());
    app.add_option("--dem", options.dem,
                   "Raster of heights, in any format that GDAL reads, or a terrain that 'terrane "
                   "bake' wrote, or the address of its folder or terrain.json on an HTTP server")
        ->type_name("FILE")
        ->group("Terrain");
    std::optional<std::uint64_t>* const seed = &options.seed;
    CLI::Option* seed_option = app.add_option_function<std::string>(
        "--seed",
        [seed](const std::string& text) {
            std::uint64_t value = 0;
            const char* end = text.data() + text.size();
            const auto [rest, error] = std::from_chars(text.data(), end, value);
            if (error != std::errc() || rest != end) {
                throw CLI::ValidationError(
                    "--seed", fmt::format("must be 0 to 18446744073709551615, got '{:.60}'", text));
            }
            *seed = value;
        },
        "Fractal terrain of this seed; with --dem, fractal detail below the raster's resolution");
    seed_option->type_name("N")->group("Terrain");
    std::optional<FractalKind>* const fractal = &options.fractal;
    CLI::Option* fractal_option = add_choice(
        app, "--fractal", {std::begin(kFractalKinds), std::end(kFractalKinds)}, 0,
        [fractal](std::size_t number) { *fractal = static_cast<FractalKind>(number); },
        "Kind of the fractal, with --seed and no --dem: the same roughness everywhere, sharp "
        "ridges, "
        "smooth valleys below rough heights, or folds; fbm unless said");
    fractal_option->default_str("")->type_name("KIND")->group("Terrain");
    CLI::Option* scene_option = app.add_option(
        "--scene", options.scene,
        "The same choices in a JSON file, with the keys dem, seed, fractal, "
        "detail_m, height_unit, height_scale, nodata, encoding, cell_m and project; and bodies, "
        "which drop, drive and walk play, and fly shows, surface, the friction by place, "
        "volumes: caves, tunnels, digs, objects, which fly, drive and walk show and mesh writes, "
        "nodes, which they show, "
        "and for pictures materials of the ground, water, and imagery, a raster of colours. A note "
        "names those that the command does not use");
    scene_option->type_name("FILE.json")->group("Terrain");
    scene_option->excludes("--dem")->excludes("--seed")->excludes("--fractal");
    app.add_option(
           "--cache", options.cache,
           "Where the bounds of a raster are kept, so that it opens faster the next time: a "
           "folder, 'beside' the raster, or 'off'; without it the user's cache folder")
        ->type_name("DIR")
        ->group("Terrain");
    add_http_options(app, options.http);
    add_raster_options(app, options.raster);
    std::optional<double>* const detail = &options.detail_m;
    app.add_option_function<std::string>(
           "--detail-m",
           [detail](const std::string& text) {
               *detail = parse_number(text);
               if (!*detail || !(**detail > 0.0)) {
                   throw CLI::ValidationError(
                       "--detail-m", fmt::format("must be a number above 0, got '{:.60}'", text));
               }
           },
           "Finest spacing of the ground, metres: without it a raster's own cell, and 1 where "
           "there "
           "is a seed")
        ->type_name("X")
        ->group("Terrain");
    std::optional<double>* const world = &options.world_m;
    app.add_option_function<std::string>(
           "--world-m",
           [world](const std::string& text) {
               *world = parse_number(text);
               if (!*world || !(**world > 0.0)) {
                   throw CLI::ValidationError(
                       "--world-m", fmt::format("must be a number above 0, got '{:.60}'", text));
               }
           },
           "With --seed and no --dem: side of the world, a square around 0,0, metres, raised to a "
           "power of two. Without it the world reaches to 2^31 m, and bake takes 131072 m of it "
           "around "
           "--start-m")
        ->type_name("SIDE")
        ->group("Terrain");
    CLI::Option* start =
        add_place(
            app, "--start-m", options.start,
            "Where flights, drives, walks, drops and views begin, metres; 0,0 with --seed alone "
            "and else the middle "
            "of the terrain, unless said")
            ->group("Terrain");
    add_place(app, "--start-lonlat", options.start_lonlat,
              "The same as a longitude and a latitude, degrees in WGS 84, over a raster with a CRS")
        ->type_name("LON,LAT")
        ->excludes(start)
        ->group("Terrain");
    std::optional<double>* const memory = &options.dem_memory_mb;
    app.add_option_function<std::string>(
           "--dem-memory-mb",
           [memory](const std::string& text) {
               *memory = parse_number(text);
               if (!*memory || !(**memory > 0.0 && **memory <= kMostMemory_mb)) {
                   throw CLI::ValidationError(
                       "--dem-memory-mb",
                       fmt::format("must be above 0 to {:g}, got '{}'", kMostMemory_mb, text));
               }
           },
           "Most memory for opening and holding a raster, MiB, besides up to 256 for GDAL's cache; "
           "what needs more is refused. 2048 unless said")
        ->type_name("N")
        ->group("Terrain");
}

Result<Georeference> georeference_of(const Terrain& terrain) {
    if (terrain.dem) return Georeference::create(*terrain.dem);
    return fail(ErrorCode::invalid_argument, "this terrain has no raster");
}

std::shared_ptr<const HeightSource> heightfield_of(const Terrain& terrain) {
    return terrain.heightfield ? terrain.heightfield : terrain.source;
}

WorldRect work_region(const Terrain& terrain) {
    const WorldRect& extent = terrain.source->extent();
    if (!terrain.start && !terrain.is_endless) return extent;
    return square_around(terrain.start.value_or(WorldVec2(0.0, 0.0)), kWorkSide, extent);
}

WorldVec2 start_of(const Terrain& terrain) {
    return terrain.start.value_or(middle_of(work_region(terrain)));
}

CommandResult<std::shared_ptr<const HeightSource>> with_volumes(
    const Terrain& terrain, std::shared_ptr<const HeightSource> heightfield) {
    if (terrain.volumes == nullptr) return heightfield;
    TERRANE_TRY(auto source, add_volumes(std::move(heightfield), *terrain.volumes));
    return source;
}

CommandResult<TerrainOptions> parse_scene(const std::string& text, const std::string& path) {
    const Parsed<Json> scene = parse_json(text);
    if (!scene) return failure(fmt::format("scene '{}': {}", path, scene.error()));
    if (!scene->is_object()) {
        return failure(
            fmt::format("scene '{}' must be a JSON object, got {}", path, shown(*scene)));
    }
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    TerrainOptions options;
    for (const auto& item : scene->items()) {
        const std::string& key = item.key();
        const Json& value = item.value();
        if (std::ranges::find(kPartKeys, key) != kPartKeys.end() && !value.empty())
            options.scene_parts.push_back(key);
        const auto wrong = [&](const char* wanted) {
            return failure(
                fmt::format("scene '{}': {} must be {}, got {}", path, key, wanted, shown(value)));
        };
        if (key == "dem") {
            if (!value.is_string() || value.get<std::string>().empty()) return wrong("a path");
            // GDAL's virtual paths (/vsizip/...) are absolute too
            options.dem = value.get<std::string>();
            if (!is_http_store(options.dem)) options.dem = raster_path(folder, options.dem);
        } else if (key == "seed") {
            if (!value.is_number_unsigned()) return wrong("a whole number of at least 0");
            options.seed = value.get<std::uint64_t>();
        } else if (key == "fractal") {
            if (value.is_string()) options.fractal = parse_fractal_kind(value.get<std::string>());
            if (!options.fractal) return wrong("fbm, ridged, hybrid or warped");
        } else if (key == "detail_m") {
            if (!value.is_number() || !(value.get<double>() > 0.0)) return wrong("above 0");
            options.detail_m = value.get<double>();
        } else if (key == "imagery") {
            Parsed<SceneImagery> imagery = read_imagery(value, folder.string());
            if (!imagery) return failure(fmt::format("scene '{}': {}", path, imagery.error()));
            options.imagery = *std::move(imagery);
        } else if (key == "water_m") {
            if (!value.is_number() || !(std::abs(value.get<double>()) <= 1e9))
                return wrong("a number within 1e9");
            if (scene->contains("water"))
                return failure(
                    fmt::format("scene '{}': water and water_m exclude each other", path));
            options.water = SceneWater{.level = value.get<double>()};
        } else if (key == "water") {
            const Parsed<SceneWater> water = read_water(value);
            if (!water) return failure(fmt::format("scene '{}': {}", path, water.error()));
            options.water = *water;
        } else if (key == "materials") {
            const Parsed<SceneMaterials> materials = read_materials(value);
            if (!materials) return failure(fmt::format("scene '{}': {}", path, materials.error()));
            options.materials = *materials;
        } else if (key == "bodies") {
            Parsed<std::vector<PlacedBody>> bodies = read_bodies(value, folder.string());
            if (!bodies) return failure(fmt::format("scene '{}': {}", path, bodies.error()));
            options.bodies = *std::move(bodies);
        } else if (key == "surface") {
            Parsed<SceneSurface> surface = read_surface(value, folder.string());
            if (!surface) return failure(fmt::format("scene '{}': {}", path, surface.error()));
            options.surface = *std::move(surface);
        } else if (key == "volumes") {
            auto volumes = read_volumes(value, folder.string());
            if (!volumes) return failure(fmt::format("scene '{}': {}", path, volumes.error()));
            options.volumes = *std::move(volumes);
        } else if (key == "objects") {
            Parsed<SceneObjects> objects = read_objects(value, folder.string());
            if (!objects) return failure(fmt::format("scene '{}': {}", path, objects.error()));
            if (!objects->meshes.empty())
                options.objects = std::make_shared<const SceneObjects>(*std::move(objects));
        } else if (key == "nodes") {
            Parsed<SceneNodes> nodes = read_nodes(value, folder.string());
            if (!nodes) return failure(fmt::format("scene '{}': {}", path, nodes.error()));
            if (!nodes->nodes.empty())
                options.nodes = std::make_shared<const SceneNodes>(*std::move(nodes));
        } else if (const Parsed<bool> is_raster_key = read_raster_key(key, value, options.raster);
                   !is_raster_key) {
            return wrong(is_raster_key.error().c_str());
        } else if (!*is_raster_key) {
            return failure(fmt::format("scene '{}': unknown key '{}'{}", path, key,
                                       did_you_mean(key, kSceneKeys)));
        }
    }
    if (options.dem.empty() && !options.seed) {
        return failure("scene " + quoted(path) + " names no terrain: it needs dem, seed or both");
    }
    return options;
}

CommandResult<Terrain> open_terrain(const TerrainOptions& options) {
    if (options.detail_m && !(std::isfinite(*options.detail_m) && *options.detail_m > 0.0)) {
        return usage_error(
            fmt::format("--detail-m must be a number above 0, got {:.6g}", *options.detail_m));
    }
    if (!options.scene.empty()) {
        TERRANE_TRY(const std::string text, read_text(options.scene));
        TERRANE_TRY(TerrainOptions scene, parse_scene(text, options.scene));
        if (options.detail_m) scene.detail_m = options.detail_m;
        scene.world_m = options.world_m;
        scene.world = options.world;
        scene.start = options.start;
        scene.start_lonlat = options.start_lonlat;
        scene.dig_spacing = options.dig_spacing;
        scene.dem_memory_mb = options.dem_memory_mb;
        scene.raster.override_by(options.raster);
        scene.cache = options.cache;
        scene.http = options.http;
        std::vector<std::string> unused = scene.scene_parts;
        std::erase_if(unused, [&](const std::string& key) {
            return std::ranges::find(options.scene_parts, key) != options.scene_parts.end();
        });
        TERRANE_TRY(Terrain terrain, open_terrain(scene));
        TERRANE_TRY(terrain, play_scene(options.scene, std::move(scene), std::move(terrain)));
        if (!unused.empty()) {
            print_note(fmt::format("{} does not use {} of the scene '{}'", options.command,
                                   fmt::join(unused, ", "), options.scene));
        }
        return terrain;
    }
    if (options.start_lonlat && options.dem.empty()) {
        return usage_error("--start-lonlat goes with a raster (--dem)");
    }
    if (options.fractal && !(options.seed && options.dem.empty())) {
        return usage_error("--fractal goes with --seed and without --dem");
    }
    if (options.world_m && !(options.seed && options.dem.empty())) {
        return usage_error("--world-m goes with a seed and without a raster");
    }
    if (!options.dem.empty()) return open_dem(options);
    if (options.dem_memory_mb) return usage_error("--dem-memory-mb goes with --dem");
    if (!options.raster.is_empty()) {
        return usage_error(fmt::format("{} go with a raster (--dem)", kRasterFlags));
    }
    if (options.seed) return open_fractal(options);
    return usage_error("no terrain chosen: give --dem FILE, --seed N, both, or --scene FILE.json");
}

std::string note_of(const Terrain& terrain) {
    return terrain.dem ? note_of(*terrain.dem) : std::string();
}

CommandResult<Terrain> open_baked(const std::string& path) {
    StoreInfo info;
    TERRANE_TRY(std::shared_ptr<const HeightSource> source, ChunkStore::open(path, &info));
    return terrain_of_store(std::move(source), info, path);
}

void describe_http(const Terrain& terrain, nlohmann::ordered_json& summary_out) {
    if (terrain.http) summary_out["http"] = describe(terrain.http->statistics());
}

DemCache choose_cache(const std::string& option) {
    if (option == "off") return {};
    if (option == "beside") return {DemCache::Place::beside, user_cache_folder()};
    return {DemCache::Place::folder, option.empty() ? user_cache_folder() : option};
}

namespace {

std::size_t count_roots(const Terrain& terrain) {
    return static_cast<std::size_t>(terrain.source->lattice().resident_root_count());
}

std::string root_squares(std::size_t count) {
    return count == 1 ? "its root square" : fmt::format("its {} root squares", count);
}

}  // namespace

CommandResult<void> check_budget(const Terrain& terrain, std::size_t budget) {
    const std::size_t roots = count_roots(terrain);
    if (budget >= 2 * roots) return {};
    return failure(fmt::format(
        "--budget must be at least {} for this terrain, 2 triangles for {}, got {}", 2 * roots,
        roots == 1 ? "its root square" : "each of its root squares", budget));
}

CommandResult<void> check_memory(const Terrain& terrain, double memory_mb) {
    // the root squares of two windows are resident while the window moves
    const std::size_t windows = terrain.source->lattice().root_window > 0 ? 2 : 1;
    const std::size_t roots = windows * count_roots(terrain);
    const double least = static_cast<double>(roots * Chunk::max_bytes()) / 0x1p20;
    if (memory_mb >= least) return {};
    // rounded up, so that the value in the message is enough
    return failure(
        fmt::format("--memory-mb must be at least {:.6g} for this terrain, room for {}, got {:.6g}",
                    std::ceil(least * 1e3) / 1e3, root_squares(roots), memory_mb));
}

}  // namespace terrane::tools
