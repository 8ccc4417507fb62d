// SPDX-License-Identifier: MIT
#include "command.h"
#include "crowd/crowd.h"
#include "options/option_values.h"
#include "output/progress.h"
#include "output/summary.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace terrane::tools {
namespace {

constexpr std::size_t kMostBodies = 10'000'000;
constexpr std::size_t kMostQueries = 100'000'000;

struct BodiesOptions {
    CrowdLayout layout;
    std::size_t queries = 600;
    double dt = 1.0 / 60.0;
    std::size_t seed = 1;
    bool json = false;
};

CommandResult<void> run_bodies(const BodiesOptions& options) {
    if (options.layout.count > kMostBodies) {
        return usage_error(
            fmt::format("--count must be at most {}, got {}", kMostBodies, options.layout.count));
    }
    if (options.queries > kMostQueries) {
        return usage_error(
            fmt::format("--queries must be at most {}, got {}", kMostQueries, options.queries));
    }
    CrowdLayout layout = options.layout;
    layout.seed = options.seed;
    Crowd crowd(layout);
    Progress progress("looking");
    CrowdQuery total;
    std::size_t positive_queries = 0;
    double positive_ms = 0.0;
    for (std::size_t i = 0; i < options.queries; ++i) {
        progress.show(static_cast<double>(i) / static_cast<double>(options.queries));
        const CrowdQuery query = crowd.look();
        total.update_ms += query.update_ms;
        total.query_ms += query.query_ms;
        total.pairs += query.pairs;
        total.touching += query.touching;
        total.candidates += query.candidates;
        if (query.touching > 0) {
            ++positive_queries;
            positive_ms += query.query_ms;
        }
        crowd.move(options.dt);
    }
    const auto count = static_cast<double>(options.queries);
    nlohmann::ordered_json summary;
    summary["bodies"] = layout.count;
    summary["broadphase"] = to_string(layout.broadphase);
    summary["corners"] = crowd.corner_count();
    summary["queries"] = options.queries;
    summary["query_ms"] = total.query_ms / count;
    summary["positive_queries"] = positive_queries;
    summary["positive_ms"] =
        positive_queries > 0 ? positive_ms / static_cast<double>(positive_queries) : 0.0;
    summary["update_ms"] = total.update_ms / count;
    summary["pairs"] = total.pairs;
    summary["touching"] = total.touching;
    summary["candidates"] = total.candidates;
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_bodies_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<BodiesOptions>();
    CLI::App* bodies = app.add_subcommand(
        "bodies", "Times how long it takes to find which of many moving bodies touch");
    CrowdLayout& layout = options->layout;
    add_count(*bodies, "--count", layout.count, 1, "Bodies");
    add_in_range(
        *bodies, "--detail", layout.detail, 2.0, 100.0,
        "Rings of corners between the poles of a body, mean; a ring has twice as many corners");
    add_in_range(*bodies, "--detail-deviation", layout.detail_deviation, 0.0, 30.0,
                 "Standard deviation of the same over the bodies");
    add_in_range(*bodies, "--radius", layout.radius, 1e-3, 1e6, "Of a body's corners, metres");
    add_in_range(*bodies, "--share", layout.share, 1e-9, 0.5,
                 "Share of the room that the bodies' balls take");
    add_not_negative(*bodies, "--speed", layout.speed, "Of a body, m/s");
    add_not_negative(*bodies, "--spin", layout.spin, "Of a body, rad/s");
    add_in_range(*bodies, "--dt", options->dt, 1e-6, 1e3, "Time between two queries, seconds");
    add_count(*bodies, "--queries", options->queries, 1, "Looks at all bodies");
    add_count(*bodies, "--seed", options->seed, 0, "Of places, ways and details");
    BroadphaseKind* const kind = &layout.broadphase;
    bodies
        ->add_option_function<std::string>(
            "--broadphase",
            [kind](const std::string& name) {
                for (const BroadphaseKind each :
                     {BroadphaseKind::sap, BroadphaseKind::grid, BroadphaseKind::two_scene,
                      BroadphaseKind::brute}) {
                    if (name != to_string(each)) continue;
                    *kind = each;
                    return;
                }
                throw CLI::ValidationError(
                    "--broadphase",
                    fmt::format("must be sap, grid, two-scene or brute, got '{}'", name));
            },
            "sap (sweep-and-prune), grid (sparse, for bodies of like size), two-scene (cubes that "
            "ignore "
            "rotation first) or brute (every pair)")
        ->type_name("NAME")
        ->default_str("sap");
    bodies->add_flag("--json", options->json, "Print one JSON object");
    bodies->footer(
        "Bodies fly straight, turn evenly, pass through each other and are thrown back by the "
        "walls of a cube.\n"
        "Example: terrane bodies --count 50 --detail 3 --broadphase sap");
    bodies->callback(
        [&context, options] { context.run = [options] { return run_bodies(*options); }; });
}

}  // namespace terrane::tools
