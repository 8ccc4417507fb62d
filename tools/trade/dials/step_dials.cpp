// SPDX-License-Identifier: MIT
#include "trade/dials/dial_list.h"
#include "trade/trials/contact_ground.h"
#include "trade/trials/drop_trial.h"

#include <fmt/format.h>

#include <cmath>

namespace terrane::tools {
namespace {

TradeTrial step_trial(double length, const DropTrial& trial, const Ground& ground) {
    return {.label = fmt::format("1/{:.0f} s", std::round(1.0 / length)),
            .value = length,
            .command = "",
            .measure = [trial, ground]() -> CommandResult<TradeSample> {
                const CommandResult<DropFigures> drop = run_drop_trial(trial, ground);
                if (!drop) return pass_on(drop.error());
                return TradeSample{drop->ms, drop->max_depth_m, drop->drift, drop->fell_through};
            }};
}

/// A dial of a length of time in a drop.
///
/// @param set changes one field of the drop
Dial step_dial(std::vector<double> rates, std::vector<double> quick_rates,
               const std::function<void(double, DropTrial&)>& set) {
    Dial dial;
    dial.axis = "s";
    dial.columns = {{"drop_ms", "drop, a simulated second", TradeUnit::ms},
                    {"max_depth_m", "penetration", TradeUnit::m},
                    {"drift", "energy gained over lost", TradeUnit::share},
                    {"fell_through", "body steps beyond the tolerance", TradeUnit::none}};
    dial.cost = "drop_ms";
    dial.loss = "max_depth_m";
    dial.prepare = [rates = std::move(rates), quick_rates = std::move(quick_rates),
                    set](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const CommandResult<Ground> ground = load_contact_ground(*place.terrain, 0.0);
        if (!ground) return pass_on(ground.error());
        std::vector<TradeTrial> trials;
        for (const double rate : place.is_quick ? quick_rates : rates) {
            DropTrial trial{.count = place.is_quick ? std::size_t{40} : std::size_t{200},
                            .seconds = place.is_quick ? 1.5 : 3.0};
            set(1.0 / rate, trial);
            trials.push_back(step_trial(1.0 / rate, trial, *ground));
        }
        return trials;
    };
    return dial;
}

}  // namespace

std::vector<Dial> step_dials() {
    Dial step = step_dial({10, 20, 30, 60, 120, 240, 300, 480}, {15, 30, 60, 120, 300},
                          [](double dt, DropTrial& trial) { trial.dt = dt; });
    step.key = "dt";
    step.title = "Length of a step";
    step.text =
        "Drop of spheres of radius 0.5 m at 10 m/s onto the finest contact surface; substeps of "
        "at most 1/120 s.";
    step.preset_flag = "--dt";
    Dial substep = step_dial({30, 60, 120, 240, 480, 960}, {30, 60, 120, 240},
                             [](double length, DropTrial& trial) {
                                 trial.dt = 1.0 / 30.0;
                                 trial.world.max_substep = length;
                             });
    substep.key = "substep";
    substep.title = "Length of a substep";
    substep.text = "The same drop; steps of 1/30 s.";
    substep.preset_flag = "--substep";
    return {step, substep};
}

}  // namespace terrane::tools
