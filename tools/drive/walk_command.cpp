// SPDX-License-Identifier: MIT
#include "drive/character_traveller.h"
#include "drive/journey.h"
#include "options/command.h"
#include "output/summary.h"

#include <CLI/CLI.hpp>

#include <memory>

namespace terrane::tools {
namespace {

constexpr double kUsualWalk = 1.5;                         // m/s
constexpr double kLeastWalk = 0.1, kGreatestWalk = 100.0;  // m/s

struct WalkOptions : FlightOptions {
    std::size_t crates = 0;
};

CommandResult<void> run_walk(const WalkOptions& options) {
    if (const CommandResult<void> good = check(options); !good) return good;
    if (const CommandResult<void> good = check_drivable(options.path); !good) return good;
    const CommandResult<Terrain> terrain = open_terrain(options.terrain);
    if (!terrain) return pass_on(terrain.error());
    if (const CommandResult<void> fit = check_limits(options, *terrain); !fit) return fit;
    const CommandResult<DrivePlan> plan = make_drive_plan(options, *terrain, kUsualWalk);
    if (!plan) return pass_on(plan.error());
    CharacterTraveller character({}, plan->path, plan->speed, *terrain->source);
    CommandResult<Journey> walk =
        Journey::create(options, *terrain, *plan, options.crates,
                        {.behind = 6.0, .above = 1.8, .target_above = 0.5}, character);
    if (!walk) return pass_on(walk.error());
    Result<FrameMaker> maker = FrameMaker::create(terrain->source, frame_maker_settings(options));
    if (!maker) return pass_on(maker.error());
    Result<FlightOutput> output =
        FlightOutput::create(options, *terrain, Journey::columns(character));
    if (!output) return pass_on(output.error());
    if (const Result<void> added = output->add_objects(*terrain, *maker); !added)
        return pass_on(added.error());

    if (const CommandResult<void> played = walk->play(*maker, *output); !played) return played;
    nlohmann::ordered_json summary = summarize(walk->totals());
    summary["arrived"] = character.has_arrived();
    summary.update(summarize(output->frames(), options.memory_bytes(), options.fps));
    summary["seconds"] = static_cast<double>(output->frames().size()) / options.fps;
    summary["path"] = options.path;
    summary["terrain"] = terrain->name;
    const Result<void> ended = output->finish("Walk over " + terrain->name, summary);
    if (!ended) return pass_on(ended.error());
    print_summary(summary, options.json);
    return output->verdict(plan->frame_count);
}

}  // namespace

void add_walk_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<WalkOptions>();
    options->path = "straight";
    CLI::App* walk = app.add_subcommand(
        "walk", "Walks a character along a path on the contact surface, with a camera behind it");
    walk->add_option(
            "--path", options->path,
            drivable_paths() + ", or a track: .csv, .gpx, .igc, .tum; its heights are not used")
        ->type_name("PATH")
        ->capture_default_str();
    add_in_range(*walk, "--speed", options->speed, kLeastWalk, kGreatestWalk,
                 "Metres a second; 1.5 without it, or the mean of a track");
    add_positive(*walk, "--seconds", options->seconds,
                 "How long at most; 20 without it, or as long as the track");
    add_crates_option(*walk, options->crates);
    add_flight_options(*walk, *options);
    walk->footer(
        "The character pushes crates that it can move, climbs steps, and walks around what stops\n"
        "it. The bodies of a --scene are in its way too.\n"
        "Example: terrane walk --dem tools/data/jacksboro.tif --seed 7 --crates 40 --video --out "
        "out/walk");
    walk->callback([&context, options] { context.run = [options] { return run_walk(*options); }; });
}

}  // namespace terrane::tools
