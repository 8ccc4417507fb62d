// SPDX-License-Identifier: MIT
#include "options/preset.h"
#include "trade/dials/dial_list.h"
#include "trade/trials/contact_ground.h"
#include "trade/trials/drop_trial.h"
#include "trade/trials/flight_ground.h"

#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>
#include <utility>

namespace terrane::tools {
namespace {

/// The flights over each terrain, which all dials of pixels share.
using FlightGrounds = std::map<const Terrain*, std::shared_ptr<FlightGround>>;

CommandResult<std::shared_ptr<FlightGround>> find_flight_ground(FlightGrounds& grounds,
                                                                const TradePlace& place) {
    std::shared_ptr<FlightGround>& known = grounds[place.terrain];
    if (known != nullptr) return known;
    CommandResult<std::shared_ptr<FlightGround>> made = FlightGround::create(place);
    if (made) known = *made;
    return made;
}

const std::vector<TradeColumn>& pixel_columns() {
    static const std::vector<TradeColumn> columns{
        {"update_ms", "update of the mesh", TradeUnit::ms},
        {"draw_ms", "drawing until the picture can be read", TradeUnit::ms},
        {"error_px", "certified screen error", TradeUnit::px},
        {"measured_error_px", "screen error by brute force", TradeUnit::px},
        {"max_pop_px", "movement between frames", TradeUnit::px},
        {"triangles", "triangles", TradeUnit::none}};
    return columns;
}

TradeTrial flight_trial(std::string label, double value, const TriangulatorSettings& settings,
                        const std::shared_ptr<FlightGround>& ground) {
    const auto truth = std::make_shared<std::optional<FlightTruth>>();  // the same in every run
    return {.label = std::move(label),
            .value = value,
            .command = "",
            .measure = [settings, ground, truth]() -> CommandResult<TradeSample> {
                const Result<FlightFigures> figures = ground->fly(settings);
                if (!figures) return pass_on(figures.error());
                if (!*truth) {
                    const Result<FlightTruth> verified = ground->verify(settings);
                    if (!verified) return pass_on(verified.error());
                    *truth = *verified;
                }
                return TradeSample{figures->update_ms, figures->draw_ms,     figures->error_px,
                                   (*truth)->error_px, (*truth)->max_pop_px, figures->triangles};
            }};
}

/// A dial of one field of the triangulator's settings.
Dial pixel_dial(const std::shared_ptr<FlightGrounds>& grounds, std::vector<double> values,
                std::vector<double> quick_values,
                const std::function<TriangulatorSettings(double)>& settings) {
    Dial dial;
    dial.columns = pixel_columns();
    dial.cost = "update_ms";
    dial.loss = "error_px";
    dial.prepare = [grounds, values = std::move(values), quick_values = std::move(quick_values),
                    settings](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const auto ground = find_flight_ground(*grounds, place);
        if (!ground) return pass_on(ground.error());
        std::vector<TradeTrial> trials;
        for (const double value : place.is_quick ? quick_values : values) {
            trials.push_back(
                flight_trial(fmt::format("{:.6g}", value), value, settings(value), *ground));
        }
        return trials;
    };
    return dial;
}

/// What the flags of a preset set in a flight, and in a drop.
TriangulatorSettings triangulator_of(const Preset& preset) {
    const auto value = [&preset](const char* flag) { return preset_value(preset, flag).value(); };
    return {.triangle_budget = static_cast<std::size_t>(value("--budget")),
            .max_error_px = value("--max-error-px")};
}

CommandResult<std::vector<TradeTrial>> prepare_presets(FlightGrounds& grounds,
                                                       const TradePlace& place) {
    const auto flight = find_flight_ground(grounds, place);
    if (!flight) return pass_on(flight.error());
    std::vector<TradeTrial> trials;
    const CommandResult<Ground> ground = load_contact_ground(*place.terrain, 0.0);
    if (!ground) return pass_on(ground.error());
    for (const Preset& preset : presets()) {
        const DropTrial drop{.count = place.is_quick ? std::size_t{40} : std::size_t{200},
                             .seconds = 1.0,
                             .dt = preset_value(preset, "--dt").value(),
                             .world = {.max_substep = preset_value(preset, "--substep").value(),
                                       .collide_bodies = false}};
        TradeTrial trial =
            flight_trial(std::string(preset.name), static_cast<double>(trials.size()),
                         triangulator_of(preset), *flight);
        trial.measure = [fly = trial.measure, drop,
                         ground = *ground]() -> CommandResult<TradeSample> {
            CommandResult<TradeSample> sample = fly();
            if (!sample) return sample;
            const CommandResult<DropFigures> dropped = run_drop_trial(drop, ground);
            if (!dropped) return pass_on(dropped.error());
            sample->insert(sample->end(), {dropped->ms, dropped->max_depth_m, dropped->drift});
            return sample;
        };
        trials.push_back(std::move(trial));
    }
    return trials;
}

std::vector<std::string> compare_presets(const TradeTable& table) {
    const auto times = [&table](const char* key) {
        const std::size_t column = column_index(table, key);
        const double fast = table.rows.front().figures[column].median;
        return fast > 0.0 ? table.rows.back().figures[column].median / fast : 0.0;
    };
    return {
        fmt::format("accurate takes {:.3g} times the time of fast in the flight's updates, and "
                    "{:.3g} times in the drop.",
                    times("update_ms"), times("drop_ms"))};
}

Dial preset_dial(const std::shared_ptr<FlightGrounds>& grounds) {
    Dial dial;
    dial.key = "preset";
    dial.title = "Presets";
    dial.text = "The flight, and a drop of spheres of radius 0.5 m, with the flags of each preset.";
    dial.columns = pixel_columns();
    dial.columns.push_back({"drop_ms", "drop, a simulated second", TradeUnit::ms});
    dial.columns.push_back({"max_depth_m", "penetration", TradeUnit::m});
    dial.columns.push_back({"drift", "energy gained over lost", TradeUnit::share});
    dial.cost = "update_ms";
    dial.loss = "error_px";
    dial.prepare = [grounds](const TradePlace& place) { return prepare_presets(*grounds, place); };
    dial.find = compare_presets;
    return dial;
}

}  // namespace

std::vector<Dial> pixel_dials() {
    const auto grounds = std::make_shared<FlightGrounds>();
    Dial budget = pixel_dial(
        grounds, {3000, 10'000, 30'000, 100'000, 200'000, 300'000, 500'000, 1'000'000},
        {10'000, 30'000, 100'000, 300'000}, [](double value) {
            return TriangulatorSettings{.triangle_budget = static_cast<std::size_t>(value),
                                        .max_error_px = 0.01};
        });
    budget.key = "budget";
    budget.title = "Triangle budget";
    budget.axis = "triangles";
    budget.text =
        "Flight at 100 m/s, 150 m or 40 spacings of the data above the ground, whichever is more; "
        "1280 x 720; no target but 0.01 px.";
    budget.preset_flag = "--budget";
    Dial target = pixel_dial(grounds, {16, 8, 4, 2, 1, 0.7, 0.5}, {8, 4, 2, 1}, [](double value) {
        return TriangulatorSettings{.triangle_budget = 1'000'000, .max_error_px = value};
    });
    target.key = "target";
    target.title = "Target of the screen error";
    target.axis = "px";
    target.text = "The same flight; at most 1,000,000 triangles.";
    target.preset_flag = "--max-error-px";
    Dial morph =
        pixel_dial(grounds, {1, 1.1, 1.2, 1.3, 1.5, 2, 3, 4}, {1, 1.1, 1.3, 2}, [](double value) {
            return TriangulatorSettings{
                .triangle_budget = 1'000'000, .max_error_px = 2.0, .morph_ratio = value};
        });
    morph.key = "morph-ratio";
    morph.title = "Morph ratio";
    morph.axis = "morph_ratio";
    morph.text =
        "The same flight; target 2 px. Vertices move between frames instead of jumping, for more "
        "triangles.";
    morph.loss = "max_pop_px";
    return {budget, target, morph, preset_dial(grounds)};
}

}  // namespace terrane::tools
