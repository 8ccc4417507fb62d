// SPDX-License-Identifier: MIT
#include "lab/crowd.h"
#include "lab/dial.h"
#include "lab/ground_trials.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/ground_batch.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <thread>

namespace terrane::tools {
namespace {

constexpr double kProbeRadius = 0.5;  // metres

/// Quantities that depend only on the spacing: the same in every repetition.
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

namespace {

constexpr std::array kTradeSchemes{CrowdScheme::sap,   CrowdScheme::grid,   CrowdScheme::two_scene,
                                   CrowdScheme::brute, CrowdScheme::hashed, CrowdScheme::dense};

CommandResult<TradeSample> query_crowd(Crowd& crowd, std::size_t queries) {
    const CrowdTotals totals = run_crowd(
        crowd, 1.0 / 60.0, [&](const CrowdTotals& so_far) { return so_far.queries < queries; });
    const auto count = static_cast<double>(totals.queries);
    return TradeSample{totals.mean_step_ms(), totals.mean_update_ms(), totals.mean_query_ms(),
                       static_cast<double>(totals.candidates) / count,
                       static_cast<double>(totals.pairs) / count};
}

Dial broadphase_dial() {
    Dial dial;
    dial.key = "broadphase";
    dial.title = "Broadphase";
    dial.text =
        "Moving polyhedra in a cube, of one size and of sizes up to 30 times as large. All "
        "schemes find the same pairs.";
    dial.needs_terrain = false;
    dial.columns = {{"step_ms", "update and query", TradeUnit::ms},
                    {"update_ms", "update", TradeUnit::ms},
                    {"query_ms", "query", TradeUnit::ms},
                    {"candidates", "compared pairs", TradeUnit::none},
                    {"pairs", "pairs found", TradeUnit::none}};
    dial.cost = "step_ms";
    dial.loss = "candidates";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const std::size_t bodies = place.is_quick ? 300 : 2000;
        const std::size_t queries = place.is_quick ? 3 : 10;
        std::vector<TradeTrial> trials;
        for (const double spread : {1.0, 30.0}) {
            for (const CrowdScheme scheme : kTradeSchemes) {
                CrowdLayout layout;
                layout.count = bodies;
                layout.size_spread = spread;
                layout.scheme = scheme;
                const auto crowd = std::make_shared<Crowd>(layout);
                trials.push_back(
                    {.label = fmt::format("{}, {}", to_string(scheme),
                                          spread > 1.0 ? "sizes 1:30" : "one size"),
                     .value = static_cast<double>(trials.size()),
                     .command = fmt::format(
                         "terrane bodies --count {} --size-spread {} --broadphase {} --queries {}",
                         bodies, spread, to_string(scheme), queries),
                     .measure = [crowd, queries] { return query_crowd(*crowd, queries); }});
            }
        }
        return trials;
    };
    return dial;
}

/// Positions of a batch query of heights.
struct BatchPlaces {
    std::vector<double> x, y, heights;
};

CommandResult<TradeTrial> thread_trial(const TradePlace& place, const Ground& ground, int threads) {
    Result<GroundBatch> batch = GroundBatch::create({.worker_count = threads});
    if (!batch) return pass_on(batch.error());
    const auto shared = std::make_shared<GroundBatch>(std::move(*batch));
    const auto places = std::make_shared<BatchPlaces>();
    const std::size_t count = place.is_quick ? 20'000 : 200'000;
    for (const ProbePose& probe : probe_poses(*place.terrain, Sphere{0.01}, 500)) {
        places->x.push_back(probe.pose.translation.x());
        places->y.push_back(probe.pose.translation.y());
    }
    if (places->x.empty()) return failure("no ground at the terrain's centre");
    const std::size_t different = places->x.size();
    for (std::size_t i = different; i < count; ++i) {
        places->x.push_back(places->x[i % different]);
        places->y.push_back(places->y[i % different]);
    }
    places->heights.resize(places->x.size());
    DropTrial drop{.count = place.is_quick ? std::size_t{100} : std::size_t{1000}, .seconds = 3.0};
    drop.world.worker_count = threads;
    drop.world.collide_bodies = true;
    return TradeTrial{.label = fmt::format("{}", threads),
                      .value = static_cast<double>(threads),
                      .command = "",
                      .measure = [=]() -> CommandResult<TradeSample> {
                          const CommandResult<DropFigures> figures = run_drop_trial(drop, ground);
                          if (!figures) return pass_on(figures.error());
                          const auto start = std::chrono::steady_clock::now();
                          const Result<void> answered =
                              shared->heights(ground, PointArray::separate(places->x, places->y),
                                              {.heights = places->heights});
                          if (!answered) return pass_on(answered.error());
                          const std::chrono::duration<double, std::nano> taken =
                              std::chrono::steady_clock::now() - start;
                          return TradeSample{static_cast<double>(threads), figures->wall_ms,
                                             taken.count() / static_cast<double>(places->x.size())};
                      }};
}

Dial thread_dial() {
    Dial dial;
    dial.key = "threads";
    dial.title = "Threads";
    dial.axis = "threads";
    dial.text =
        "Drop of spheres, milliseconds a simulated second, and a batch of heights. Any number of "
        "threads gives the same bits.";
    dial.columns = {{"threads", "threads", TradeUnit::none},
                    {"drop_ms", "drop, a simulated second", TradeUnit::ms},
                    {"batch_ns", "a height of a batch", TradeUnit::ns}};
    dial.cost = "threads";
    dial.loss = "drop_ms";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const CommandResult<Ground> ground = load_contact_ground(*place.terrain, 0.0);
        if (!ground) return pass_on(ground.error());
        const int most = static_cast<int>(std::min(16U, std::thread::hardware_concurrency()));
        std::vector<TradeTrial> trials;
        for (int threads = 1; threads <= std::max(2, most); threads *= 2) {
            CommandResult<TradeTrial> trial = thread_trial(place, *ground, threads);
            if (!trial) return pass_on(trial.error());
            trials.push_back(std::move(*trial));
        }
        return trials;
    };
    return dial;
}

}  // namespace

std::vector<Dial> crowd_dials() { return {broadphase_dial(), thread_dial()}; }

}  // namespace terrane::tools
