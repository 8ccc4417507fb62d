// SPDX-License-Identifier: MIT
#include "lab/study.h"
#include "program/command.h"
#include "program/options.h"
#include "program/output_file.h"
#include "program/progress.h"
#include "program/summary.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>

namespace terrane::tools {
namespace {

constexpr std::size_t kMostBodies = 10'000'000;
constexpr const char* kMarkdownName = "study.md";
constexpr std::size_t kMostQueries = 100'000'000;

struct BodiesOptions {
    CrowdLayout layout;
    std::size_t queries = 600;
    double dt = 1.0 / 60.0;
    std::size_t seed = 1;
    bool is_study = false;
    StudySettings study;
    std::string out;
    bool json = false;
};

CommandResult<void> run_study_command(const BodiesOptions& options) {
    if (options.out.empty())
        return usage_error("--study needs --out DIR for its report.html and study.md");
    TERRANE_TRY(const auto folder, OutputFolder::open(options.out, {kReportName, kMarkdownName}));
    watch_for_interrupts();
    StudySettings settings = options.study;
    settings.seed = options.seed;
    Progress progress("studying");
    const std::vector<StudyTable> tables = measure_tables(
        make_study_tables(settings), settings, [&](double share) { progress.show(share); });
    if (is_interrupted()) return failure("interrupted before the study's tables were whole");
    nlohmann::ordered_json summary, findings;  // the report shows findings beside their tables
    for (const StudyTable& table : tables) {
        const nlohmann::ordered_json json = to_json(table);
        summary[table.key + "_slopes"] = json["slopes"];
        findings[table.key + "_findings"] = json["findings"];
        const std::optional<double> speedup = least_speedup(table);
        if (speedup) summary[table.key + "_least_speedup"] = *speedup;
    }
    TERRANE_TRY(folder->clear());
    TERRANE_TRY(write_study_report(OutputPlace(folder, kReportName),
                                   {.title = "Many bodies", .summary = summary}, tables));
    TERRANE_TRY(write_file(OutputPlace(folder, kMarkdownName), study_markdown(tables)));
    summary.update(findings);
    print_summary(summary, options.json);
    return {};
}

CommandResult<void> run_bodies(const BodiesOptions& options, const CLI::App& command) {
    TERRANE_TRY(refuse_idle_flags(
        command,
        {{{"--count", "--detail", "--detail-deviation", "--radius", "--size-spread", "--aspect",
           "--size-power", "--dented", "--room", "--share", "--speed", "--spin", "--dt",
           "--queries", "--broadphase"},
          !options.is_study,
          "goes without --study, whose tables say what they change"},
         {{"--size-power"}, options.layout.size_spread > 1.0, "goes with --size-spread above 1"},
         {{"--share"}, options.layout.room == 0.0, "goes without --room, which sets the width"},
         {{"--most-bodies", "--seconds-a-point", "--most-seconds-a-point", "--out"},
          options.is_study,
          "goes with --study"}}));
    if (options.is_study) return run_study_command(options);
    CrowdLayout layout = options.layout;
    layout.seed = options.seed;
    Crowd crowd(layout);
    Progress progress("querying");
    const CrowdTotals totals = run_crowd(crowd, options.dt, [&](const CrowdTotals& so_far) {
        progress.show(static_cast<double>(so_far.queries) / static_cast<double>(options.queries));
        return so_far.queries < options.queries;
    });
    const nlohmann::ordered_json summary{{"bodies", layout.count},
                                         {"broadphase", to_string(layout.scheme)},
                                         {"corners", crowd.corner_count()},
                                         {"queries", options.queries},
                                         {"query_ms", totals.mean_query_ms()},
                                         {"positive_queries", totals.positive_queries},
                                         {"positive_ms", totals.mean_positive_ms()},
                                         {"update_ms", totals.mean_update_ms()},
                                         {"boxes_ms", totals.mean_boxes_ms()},
                                         {"boxes", totals.boxes},
                                         {"pairs", totals.pairs},
                                         {"touching", totals.touching},
                                         {"candidates", totals.candidates}};
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_bodies_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<BodiesOptions>();
    CLI::App* bodies = app.add_subcommand(
        "bodies", "Times how long it takes to find which of many moving bodies touch");
    CrowdLayout& layout = options->layout;
    add_count(*bodies, "--count", layout.count, 1, "Bodies", kMostBodies);
    add_in_range(
        *bodies, "--detail", layout.detail, 2.0, 100.0,
        "Rings of corners between the poles of a body, mean; a ring has twice as many corners");
    add_in_range(*bodies, "--detail-deviation", layout.detail_deviation, 0.0, 30.0,
                 "Standard deviation of --detail, uniform over the bodies");
    add_in_range(*bodies, "--radius", layout.radius, 1e-3, 1e6,
                 "Of the sphere through a body's corners, metres");
    add_in_range(*bodies, "--size-spread", layout.size_spread, 1.0, 1e3,
                 "Largest over smallest of 100 radii in equal ratios around --radius");
    add_in_range(
        *bodies, "--size-power", layout.size_power, 0.0, 10.0,
        "Bodies of at least a radius are as many as its power of minus this: 0 for as many "
        "small as large ones, 2.5 for fragments");
    add_in_range(*bodies, "--aspect", layout.aspect, 1.0, 1e3, "Length over width of a body");
    bodies->add_flag("--dented", layout.is_dented,
                     "Bodies that are not convex: every second segment has 0.7 of the radius");
    add_in_range(*bodies, "--room", layout.room, 1e-3, 1e9,
                 "Width of the cubic room, metres; without it --share says how wide it is");
    add_in_range(*bodies, "--share", layout.share, 1e-9, 0.5,
                 "Share of the room's volume that the bodies' spheres take");
    add_not_negative(*bodies, "--speed", layout.speed, "Of a body, m/s");
    add_not_negative(*bodies, "--spin", layout.spin, "Of a body, rad/s");
    add_in_range(*bodies, "--dt", options->dt, 1e-6, 1e3, "Time between two queries, seconds");
    add_count(*bodies, "--queries", options->queries, 1, "Queries of all bodies", kMostQueries);
    add_count(*bodies, "--seed", options->seed, 0, "Of positions, velocities and details");
    std::vector<std::string> names;
    for (const CrowdScheme each : kCrowdSchemes) names.emplace_back(to_string(each));
    add_choice(
        *bodies, "--broadphase", names, 0,
        [&layout](std::size_t number) { layout.scheme = kCrowdSchemes[number]; },
        "sap (sweep-and-prune), grid (sparse, for bodies of like size), two-scene (cubes that "
        "ignore rotation first), brute (every pair), hashed (hashed cells as wide as the mean "
        "distance of bodies), dense (40^3 cells, cleared in each update) or centroid (dense, a "
        "body "
        "in one cell, cells as wide as the largest body; compares spheres)");
    bodies->add_flag("--study", options->is_study,
                     "Tables against count, detail, radius, size and aspect, beside published "
                     "ones: report.html and study.md in --out");
    add_count(*bodies, "--most-bodies", options->study.most_bodies, 50,
              "Of the study's tables, at most");
    add_positive(*bodies, "--seconds-a-point", options->study.seconds_a_point,
                 "Time that the study measures each point and broadphase for, seconds");
    add_positive(*bodies, "--most-seconds-a-point", options->study.most_seconds_a_point,
                 "The study leaves out a broadphase at a point of more than 1000 bodies where five "
                 "queries are estimated to take longer, seconds");
    bodies->add_option("--out", options->out, "Folder of the study's report")->type_name("DIR");
    bodies->add_flag("--json", options->json, "Print one JSON object");
    bodies->footer(
        "Bodies move and turn at constant velocities, pass through each other and bounce off the "
        "walls of a cube.\n"
        "Example: terrane bodies --count 50 --detail 3 --broadphase sap");
    bodies->callback([&context, options, bodies] {
        context.run = [options, bodies] { return run_bodies(*options, *bodies); };
    });
}

}  // namespace terrane::tools
