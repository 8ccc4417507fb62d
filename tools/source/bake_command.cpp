// SPDX-License-Identifier: MIT
#include "options/command.h"
#include "options/option_values.h"
#include "output/interrupt.h"
#include "output/progress.h"
#include "output/summary.h"
#include "source/baked_terrain.h"
#include "source/terrain_options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <vector>

namespace terrane::tools {
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
    const CommandResult<Terrain> terrain = open_terrain(wanted);
    if (!terrain) return pass_on(terrain.error());
    BakeSettings settings;
    const int levels = terrain->source->lattice().finest_level + 1;
    if (options.levels > static_cast<std::size_t>(levels)) {
        return usage_error(fmt::format("--levels must be 1 to {} over this terrain, got {}", levels,
                                       options.levels));
    }
    settings.level_count = static_cast<int>(options.levels);
    settings.worker_count = static_cast<int>(options.threads);
    settings.note = note_of(*terrain);
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
    // a store has heights alone: a scene adds its volumes to a baked terrain as to any other
    const Result<StoreInfo> baked =
        ChunkStore::bake(*heightfield_of(*terrain), options.out, settings);
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
    if (terrain->volumes != nullptr) {
        summary["volumes_left_out"] = describe_volumes(*terrain->volumes).size();
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
    add_terrain_options(*bake, options->terrain);
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
