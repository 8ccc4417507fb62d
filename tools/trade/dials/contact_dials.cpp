// SPDX-License-Identifier: MIT
#include "trade/dials/dial_list.h"
#include "trade/trials/contact_ground.h"
#include "trade/trials/drop_trial.h"
#include "trade/trials/time_call.h"

#include <terrane/collision/ground_contact.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

namespace terrane::tools {
namespace {

constexpr double kProbeRadius = 0.5;  // metres

/// What depends on the spacing alone: the same in every repetition.
struct SpacingTruth {
    double depth_error_m = 0.0;  ///< largest distance of contact surface and true surface, vertical
    double error_m = 0.0;        ///< largest certified bound of it
    double missed_share = 0.0;   ///< of the true contacts
};

SpacingTruth compare_with_truth(const Terrain& terrain, const Ground& ground,
                                const std::vector<ProbePose>& probes) {
    SpacingTruth truth;
    std::size_t contacts = 0, missed = 0;
    for (const ProbePose& probe : probes) {
        const WorldPos& p = probe.pose.translation;
        const HeightAnswer answer = ground.height(p.x(), p.y());
        if (answer.status != GroundStatus::ok) continue;
        const double off = std::abs(answer.height - terrain.source->height(p.x(), p.y()));
        truth.depth_error_m = std::max(truth.depth_error_m, off);
        truth.error_m = std::max(truth.error_m, answer.error_m);
        if (!probe.touches) continue;
        ++contacts;
        const TestAnswer test = test_contact(Sphere{kProbeRadius}, probe.pose, ground);
        if (!test.is_touching) ++missed;
    }
    if (contacts > 0) {
        truth.missed_share = static_cast<double>(missed) / static_cast<double>(contacts);
    }
    return truth;
}

TradeTrial spacing_trial(const TradePlace& place, const Ground& ground,
                         const std::shared_ptr<const std::vector<ProbePose>>& probes) {
    const SpacingTruth truth = compare_with_truth(*place.terrain, ground, *probes);
    const std::size_t bodies = place.is_quick ? 30 : 100;
    return {
        .label = fmt::format("{:.6g} m", ground.spacing()),
        .value = ground.spacing(),
        .command = "",
        .measure = [ground, probes, truth, bodies]() -> CommandResult<TradeSample> {
            const double height_ns = time_call_ns(probes->size(), [&](std::size_t i) {
                const WorldPos& p = (*probes)[i].pose.translation;
                return ground.height(p.x(), p.y()).height;
            });
            const double contact_ns = time_call_ns(probes->size(), [&](std::size_t i) {
                std::array<Contact, 16> contacts;
                return find_contacts(Sphere{kProbeRadius}, (*probes)[i].pose, ground, 0.0, contacts)
                    .count;
            });
            const CommandResult<DropFigures> drop =
                run_drop_trial({.count = bodies, .seconds = 0.5}, ground);
            if (!drop) return pass_on(drop.error());
            return TradeSample{height_ns,          contact_ns, truth.depth_error_m, truth.error_m,
                               truth.missed_share, drop->ms,   drop->drift};
        }};
}

Dial spacing_dial() {
    Dial dial;
    dial.key = "contact-spacing";
    dial.title = "Spacing of the contact surface";
    dial.axis = "m";
    dial.text =
        "Spheres of radius 0.5 m near the ground, compared with the true surface by sampling; "
        "drop of such spheres, milliseconds a simulated second.";
    dial.columns = {{"height_ns", "a height", TradeUnit::ns},
                    {"contact_ns", "contacts of a sphere", TradeUnit::ns},
                    {"depth_error_m", "distance from the true surface", TradeUnit::m},
                    {"error_m", "certified bound of it", TradeUnit::m},
                    {"missed_share", "missed contacts", TradeUnit::share},
                    {"drop_ms", "drop, a simulated second", TradeUnit::ms},
                    {"drift", "energy gained over lost", TradeUnit::share}};
    dial.cost = "contact_ns";
    dial.loss = "depth_error_m";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const auto probes = std::make_shared<const std::vector<ProbePose>>(
            probe_poses(*place.terrain, Sphere{kProbeRadius}, place.is_quick ? 150 : 1000));
        if (probes->empty()) return failure("no ground at the terrain's centre");
        std::vector<TradeTrial> trials;
        double spacing = 0.0;  // the finest
        for (int i = 0; i < (place.is_quick ? 4 : 6); ++i) {
            const CommandResult<Ground> ground = load_contact_ground(*place.terrain, spacing);
            if (!ground) return pass_on(ground.error());
            if (i > 0 && ground->spacing() == trials.back().value) break;  // the coarsest
            trials.push_back(spacing_trial(place, *ground, probes));
            spacing = 2.0 * ground->spacing();
        }
        return trials;
    };
    return dial;
}

Dial tolerance_dial() {
    Dial dial;
    dial.key = "contact-tolerance";
    dial.title = "Contact tolerance";
    dial.axis = "m";
    dial.text =
        "Drop of spheres of radius 0.5 m at 10 m/s onto the finest contact surface, steps of "
        "1/60 s.";
    dial.columns = {{"drop_ms", "drop, a simulated second", TradeUnit::ms},
                    {"max_depth_m", "penetration", TradeUnit::m},
                    {"drift", "energy gained over lost", TradeUnit::share},
                    {"fell_through", "body steps beyond the tolerance", TradeUnit::none}};
    dial.cost = "drop_ms";
    dial.loss = "max_depth_m";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const CommandResult<Ground> ground = load_contact_ground(*place.terrain, 0.0);
        if (!ground) return pass_on(ground.error());
        const std::vector<double> values = place.is_quick
                                               ? std::vector{0.0001, 0.001, 0.01, 0.05}
                                               : std::vector{1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.2};
        std::vector<TradeTrial> trials;
        for (const double value : values) {
            const DropTrial trial{.count = place.is_quick ? std::size_t{50} : std::size_t{200},
                                  .seconds = place.is_quick ? 1.5 : 3.0,
                                  .contact_tolerance = value};
            trials.push_back({.label = fmt::format("{:.6g} m", value),
                              .value = value,
                              .command = "",
                              .measure = [trial, ground = *ground]() -> CommandResult<TradeSample> {
                                  const auto drop = run_drop_trial(trial, ground);
                                  if (!drop) return pass_on(drop.error());
                                  return TradeSample{drop->ms, drop->max_depth_m, drop->drift,
                                                     drop->fell_through};
                              }});
        }
        return trials;
    };
    return dial;
}

}  // namespace

std::vector<Dial> contact_dials() { return {spacing_dial(), tolerance_dial()}; }

}  // namespace terrane::tools
