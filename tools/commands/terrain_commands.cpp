// SPDX-License-Identifier: MIT
#include "commands/bake_jobs.h"
#include "program/command.h"
#include "program/options.h"
#include "program/progress.h"
#include "program/summary.h"
#include "scene/terrain_options.h"

#include <terrane/store/sealed_file.h>
#include <terrane/store/shard_baker.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
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
    bool is_sharded = false, is_plan = false, is_combine = false, is_verified = false;
    bool is_slurm = false;
    std::vector<std::size_t> shards;
    bool has_mine = false;                ///< whether the shards are those of `rank`
    Rank rank = {};                       ///< of this process
    std::vector<std::string> words = {};  ///< of the command line, for scripts of Slurm
    bool json = false;

    /// Whether the steps of a sharded bake are run apart, or one after the other.
    bool has_shards() const {
        return is_sharded || is_plan || is_combine || is_verified || is_slurm || has_mine ||
               !shards.empty();
    }
};

void describe(const StoreInfo& store, nlohmann::ordered_json& summary) {
    summary["chunks"] = store.chunk_count;
    summary["bytes"] = store.bytes;
    summary["max_error_m"] = store.max_error_m;
    summary["sha"] = store.sha;
}

CommandResult<void> report_error(const Error& error) {
    if (error.code == ErrorCode::invalid_argument) return usage_error(error.message);
    return pass_on(error);
}

/// A hash of the raster, so that shards of two versions of it are not mixed: of its samples, or of its file if it is
/// resampled.
std::string fingerprint_of(const TerrainOptions& options, const Terrain& terrain) {
    if (terrain.dem && !terrain.dem->samples_hash.empty()) return terrain.dem->samples_hash;
    if (options.dem.empty()) return {};
    const auto hash = hash_of_file(options.dem);
    return hash ? hash->text() : std::string();  // a source of GDAL that is not a file
}

/// The shards of --shard: "mine", or numbers separated by commas.
void read_shards(const std::string& text, BakeOptions& options_out) {
    options_out.has_mine = text == "mine";
    if (options_out.has_mine) return;
    const std::optional<std::vector<std::string>> items = parse_list(text);
    for (const std::string& item : items.value_or(std::vector<std::string>())) {
        std::size_t shard = 0;
        const char* const end = item.data() + item.size();
        const auto [rest, error] = std::from_chars(item.data(), end, shard);
        if (error != std::errc() || rest != end) break;
        options_out.shards.push_back(shard);
    }
    if (items && options_out.shards.size() == items->size()) return;
    throw CLI::ValidationError(
        "--shard", fmt::format("must be numbers separated by commas, or mine, got '{:.60}'", text));
}

/// Writes the scripts that bake the shards in jobs of Slurm.
CommandResult<void> run_slurm(const BakeOptions& options, std::size_t shard_count,
                              nlohmann::ordered_json& summary) {
    TERRANE_TRY(const SlurmScripts scripts,
                write_slurm_scripts(options.out, options.words, shard_count, options.threads));
    summary["jobs"] = scripts.job_count;
    summary["scripts"] = scripts.paths;
    summary["submit"] = scripts.submit;
    return {};
}

/// The steps of a sharded bake that the options ask for.
CommandResult<void> run_sharded_bake(const BakeOptions& options, const Terrain& terrain,
                                     BakeSettings settings, nlohmann::ordered_json& summary) {
    const HeightSource& source = *heightfield_of(terrain);
    settings.fingerprint = fingerprint_of(options.terrain, terrain);
    Progress progress("baking");
    std::size_t done = 0, count = 1;
    settings.progress = [&](double share) {
        progress.show((static_cast<double>(done) + share) / static_cast<double>(count));
        return !is_interrupted();
    };
    const auto baker = ShardBaker::create(source, options.out, settings);
    if (!baker) return report_error(baker.error());
    const auto all = static_cast<std::size_t>(baker->shard_count());
    summary["shards"] = all;
    if (options.is_slurm) return run_slurm(options, all, summary);
    std::vector<std::size_t> shards = options.shards;
    const Rank& rank = options.rank;
    for (std::size_t i = rank.number; options.has_mine && i < all; i += rank.count) {
        shards.push_back(i);
    }
    for (std::size_t i = 0; options.is_sharded && i < all; ++i) shards.push_back(i);
    for (const std::size_t shard : shards) {
        if (shard < all) continue;
        return usage_error(fmt::format("--shard must be 0 to {}, got {}", all - 1, shard));
    }
    count = std::max<std::size_t>(shards.size(), 1);
    std::size_t found = 0;
    for (const std::size_t shard : shards) {
        const auto number = static_cast<std::int64_t>(shard);
        const auto baked = baker->bake_shard(number);
        if (!baked) return report_error(baked.error());
        if (!*baked) ++found;
        ++done;
    }
    if (options.has_mine) {
        summary["rank"] = rank.number;
        summary["ranks"] = rank.count;
    }
    if (!shards.empty() || options.has_mine) {
        summary["baked"] = shards.size() - found;
        summary["found"] = found;
    }
    if (!options.is_verified) return {};
    constexpr std::int64_t kEvery = 16;
    std::int64_t verified = 0;
    for (std::size_t shard = 0; shard < all; ++shard) {
        const auto compared = baker->verify_shard(static_cast<std::int64_t>(shard), kEvery);
        if (!compared) return report_error(compared.error());
        verified += *compared;
        if (is_interrupted()) return failure("given up");
    }
    summary["verified"] = verified;
    return {};
}

CommandResult<void> run_bake(BakeOptions options) {
    if (options.has_mine && (options.is_combine || options.is_sharded || options.is_verified)) {
        return usage_error("--shard mine goes alone; --combine follows when all ranks are done");
    }
    if (options.has_mine) {
        TERRANE_TRY(options.rank, rank_of_process());
    }
    nlohmann::ordered_json summary;
    const auto combine = [&]() -> CommandResult<void> {
        const Result<StoreInfo> store = ShardBaker::combine(options.out);
        if (!store) return pass_on(store.error());
        describe(*store, summary);
        return {};
    };
    if (options.is_combine && !options.is_plan && !options.is_sharded && !options.is_verified &&
        options.shards.empty()) {
        TERRANE_TRY(combine());
        summary["out"] = options.out;
        print_summary(summary, options.json);
        return {};
    }
    TerrainOptions wanted = options.terrain;
    wanted.world = WorldKind::bounded;
    if (options.has_shards()) wanted.scan_file = options.out + "/raster.scan";
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
    watch_for_interrupts();
    // a store contains only heights: a scene adds its volumes to a baked terrain as to any other
    if (options.has_shards()) {
        TERRANE_TRY(run_sharded_bake(options, terrain, settings, summary));
        if (options.is_sharded || options.is_combine) TERRANE_TRY(combine());
    } else {
        Progress progress("baking");
        settings.progress = [&progress](double share) {
            progress.show(share);
            return !is_interrupted();
        };
        const Result<StoreInfo> baked =
            ChunkStore::bake(*heightfield_of(terrain), options.out, settings);
        if (!baked) return report_error(baked.error());
        describe(*baked, summary);
    }
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
    bake->add_option("--out", options->out,
                     "File to write; one that is there is replaced. With shards: folder, whose "
                     "complete shards are kept")
        ->type_name("FILE.terrane|FOLDER")
        ->required();
    bake->add_flag("--sharded", options->is_sharded,
                   "Write a folder of files of up to 200 MB, and terrain.json, which --dem opens: "
                   "--plan, each --shard, and --combine");
    bake->add_flag("--plan", options->is_plan,
                   "Write the plan of the shards, and print their number");
    CLI::Option* const shard =
        bake->add_option_function<std::string>(
                "--shard", [options](const std::string& text) { read_shards(text, *options); },
                "Bake only these shards, numbered from 0, in any process on any machine that has "
                "the terrain and the folder; 'mine': every shard of this process's rank, given by "
                "OMPI_COMM_WORLD_RANK and OMPI_COMM_WORLD_SIZE, or SLURM_PROCID and SLURM_NTASKS")
            ->type_name("K,...|mine");
    bake->add_flag("--combine", options->is_combine,
                   "Write terrain.json when all shards are baked; needs no terrain");
    bake->add_flag("--verify", options->is_verified,
                   "Bake one of 16 chunks of all shards again, and compare them");
    bake->add_flag("--slurm", options->is_slurm,
                   "Write the plan, and scripts of Slurm into the folder: bake.sbatch, an array of "
                   "up to 1000 jobs, and combine.sbatch; print how to submit them")
        ->excludes(shard)
        ->excludes("--sharded")
        ->excludes("--combine")
        ->excludes("--verify");
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
    bake->footer(
        "Examples:\n"
        "  terrane bake --dem tools/data/jacksboro.tif --out jacksboro.terrane\n"
        "  terrane bake --dem tools/data/jacksboro.tif --out jacksboro --sharded");
    bake->callback([&context, options, bake] {
        options->words = given_words(*bake, {"--slurm", "--plan", "--threads", "--json"});
        context.run = [options] { return run_bake(*options); };
    });
}

}  // namespace terrane::tools
