// SPDX-License-Identifier: MIT
#include "lab/dial.h"
#include "lab/trade_document.h"
#include "program/command.h"
#include "program/options.h"
#include "program/output_file.h"
#include "program/progress.h"
#include "program/summary.h"
#include "scene/terrain_options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTradeName = "trade.json";
// Target duration of a run, seconds: two thirds of the documented duration, as a margin for slow machines.
constexpr double kQuickSeconds = 40.0, kFullSeconds = 600.0;
constexpr double kMostSecondsOfDial = 20.0;

struct TradeOptions {
    std::size_t seed = 7;
    std::string dem;
    std::vector<std::size_t> dials;    ///< indices in all_dials(); empty: all
    std::vector<std::string> compare;  ///< two files; empty: none
    bool is_quick = false;
    std::string out;
    bool json = false;
};

/// A terrain to measure, with the flags that choose it.
struct TradeTerrain {
    Terrain terrain;
    std::string flags;
};

CommandResult<std::vector<TradeTerrain>> open_trade_terrains(const TradeOptions& options) {
    std::vector<TradeTerrain> terrains;
    TerrainOptions wanted;
    wanted.seed = options.seed;
    TERRANE_TRY(Terrain fractal, open_terrain(wanted));
    terrains.push_back({std::move(fractal), fmt::format("--seed {}", options.seed)});
    if (options.dem.empty()) return terrains;
    TerrainOptions wanted_raster;
    wanted_raster.dem = options.dem;
    TERRANE_TRY(Terrain raster, open_terrain(wanted_raster));
    raster.name = std::filesystem::path(options.dem).filename().string();
    terrains.push_back({std::move(raster), "--dem " + options.dem});
    return terrains;
}

std::vector<Dial> chosen_dials(const TradeOptions& options) {
    std::vector<Dial> all = all_dials(), chosen;
    for (std::size_t i = 0; i < all.size(); ++i) {
        const bool is_chosen = std::ranges::find(options.dials, i) != options.dials.end();
        if (options.dials.empty() || is_chosen) chosen.push_back(std::move(all[i]));
    }
    return chosen;
}

/// Measures the chosen dials over the terrains. Each measurement gets its share of the time that is left.
CommandResult<Json> measure_all_dials(const TradeOptions& options,
                                      const std::vector<TradeTerrain>& terrains) {
    const Stopwatch watch(Clock::wall);
    const std::vector<Dial> dials = chosen_dials(options);
    std::size_t left = 0;
    for (const Dial& dial : dials) left += dial.needs_terrain ? terrains.size() : 1;
    const auto all = static_cast<double>(left);
    Json document = start_trade_document(options.is_quick);
    std::vector<double> reference_ms;
    Progress progress("measuring");
    for (const Dial& dial : dials) {
        for (const TradeTerrain& each : terrains) {
            progress.show(1.0 - static_cast<double>(left) / all);
            const double aim = options.is_quick ? kQuickSeconds : kFullSeconds;
            const double share = (aim - 1e-3 * watch.ms()) / static_cast<double>(left--);
            const TradePlace place{
                .terrain = &each.terrain, .flags = each.flags, .is_quick = options.is_quick};
            if (const auto reason = dial.idle_reason ? dial.idle_reason(place) : std::nullopt) {
                document["idle_dials"].push_back(
                    {{"key", dial.key}, {"terrain", each.terrain.name}, {"reason", *reason}});
                continue;
            }
            const Patience patience{
                .seconds = std::clamp(share, 0.0, kMostSecondsOfDial),
                .most_turns = options.is_quick ? std::size_t{4} : std::size_t{10}};
            TERRANE_TRY(const TradeTable table, measure_dial(dial, place, patience));
            document["tables"].push_back(to_json(table));
            for (int i = 0; i < 9; ++i) reference_ms.push_back(1e3 * time_reference_loop());
            if (!dial.needs_terrain) break;
        }
    }
    document["reference_loop_ms"] = to_json(summarize_figure(reference_ms, {}), "");
    document["seconds"] = 1e-3 * watch.ms();
    return document;
}

/// One line per table: its front.
Json summarize_fronts(const Json& document) {
    Json summary{{"tables", document["tables"].size()},
                 {"quick", document["quick"]},
                 {"seconds", document["seconds"]},
                 {"reference_loop_ms", document["reference_loop_ms"]["median"]}};
    const auto name_of = [](const Json& dial) {
        const auto key = dial["key"].get<std::string>(), place = dial["terrain"].get<std::string>();
        return place.empty() ? key : fmt::format("{} ({})", key, place);
    };
    for (const Json& table : document["tables"]) {
        std::vector<std::string> labels;
        for (const Json& row : table["rows"]) {
            if (row["on_front"]) labels.push_back(row["label"]);
        }
        std::vector<std::string> sentences = table["findings"];
        if (!labels.empty()) {
            sentences.insert(sentences.begin(), fmt::format("{}.", fmt::join(labels, "; ")));
        }
        summary[name_of(table)] = fmt::format("{}", fmt::join(sentences, " "));
    }
    for (const Json& dial : document["idle_dials"]) {
        summary[name_of(dial)] = "not measured: " + dial["reason"].get<std::string>();
    }
    return summary;
}

CommandResult<void> run_trade(const TradeOptions& options, const CLI::App& command) {
    const bool compares = is_given(command, "--compare");
    TERRANE_TRY(refuse_idle_flags(
        command,
        {{{"--seed", "--dem", "--dial", "--quick"}, !compares, "goes without --compare"}}));
    if (compares) {
        if (options.compare.size() == 2) {
            return run_comparison(options.compare, options.out, options.json);
        }
        return usage_error(
            fmt::format("--compare needs two files, got {}", options.compare.size()));
    }
    TERRANE_TRY(const std::vector<TradeTerrain> terrains, open_trade_terrains(options));
    TERRANE_TRY(const auto folder, OutputFolder::open(options.out, {kTradeName, kReportName}));
    watch_for_interrupts();
    TERRANE_TRY(const Json document, measure_all_dials(options, terrains));
    const Json summary = summarize_fronts(document);
    if (folder != nullptr) {
        TERRANE_TRY(folder->clear());
        TERRANE_TRY(write_file(OutputPlace(folder, kTradeName), to_line(document)));
        TERRANE_TRY(write_trade_report(OutputPlace(folder, kReportName),
                                       {.title = "Trade-offs", .summary = summary}, {document}));
    }
    print_summary(options.json ? document : summary, options.json);
    return {};
}

}  // namespace

void add_trade_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<TradeOptions>();
    CLI::App* trade = app.add_subcommand(
        "trade", "Sweeps each dial with everything else fixed: what each value costs and gives");
    add_count(*trade, "--seed", options->seed, 0, "Of the fractal terrain");
    trade->add_option("--dem", options->dem, "A raster to measure on as well")->type_name("FILE");
    add_choice_list(
        *trade, "--dial", dial_names(),
        [to = options.get()](const std::vector<std::size_t>& numbers) { to->dials = numbers; },
        fmt::format("Only these dials: {}", fmt::join(dial_names(), ", ")))
        ->type_name("A,B,C");
    trade->add_flag("--quick", options->is_quick,
                    "Fewer values and repetitions, shorter flights: within a minute instead of a "
                    "quarter of an hour");
    trade
        ->add_option("--compare", options->compare,
                     "Lay the trade.json of two runs, A and B, side by side; --out then gets their "
                     "report")
        ->type_name("A B")
        ->expected(1, 64);
    trade->add_option("--out", options->out, "Folder for trade.json and report.html")
        ->type_name("DIR");
    trade->add_flag("--json", options->json, "Print what trade.json holds, one JSON object");
    trade->footer(
        "Times are medians of repetitions in turns; ratios are to a reference loop in the same "
        "turn, for comparisons between machines.\n"
        "Example: terrane trade --dem tools/data/jacksboro.tif --quick --out out/trade");
    trade->callback([&context, options, trade] {
        context.run = [options, trade] { return run_trade(*options, *trade); };
    });
}

}  // namespace terrane::tools
