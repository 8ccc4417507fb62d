// SPDX-License-Identifier: MIT
#include "lab/crowd.h"
#include "lab/dial.h"
#include "lab/ground_trials.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/ground_batch.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <thread>

namespace terrane::tools {
namespace {

constexpr double kProbeRadius = 0.5;  // metres

std::string metres_label(double value) { return fmt::format("{:.6g} m", value); }
std::string rate_label(double value) { return fmt::format("1/{:.0f} s", std::round(1.0 / value)); }

/// Quantities that depend only on the spacing: the same in every repetition.
struct SpacingTruth {
    double depth_error_m = 0.0;  ///< largest vertical distance between contact and true surface
    double error_m = 0.0;        ///< largest certified bound of this distance
    double missed_share = 0.0;   ///< share of the true contacts that are not found
};

SpacingTruth compare_with_truth(const Terrain& terrain, const Ground& ground,
                                const std::vector<ProbePose>& probes) {
    SpacingTruth truth;
    std::size_t contacts = 0, missed = 0;
    for (const ProbePose& probe : probes) {
        const WorldPos& p = probe.pose.translation;
        const HeightAnswer answer = ground.height(p.x(), p.y());
        if (answer.status != QueryStatus::ok) continue;
        const double off = std::abs(answer.height - terrain.source->height(p.x(), p.y()));
        truth.depth_error_m = std::max(truth.depth_error_m, off);
        truth.error_m = std::max(truth.error_m, answer.error_m);
        if (!probe.touches) continue;
        ++contacts;
        const TestAnswer test = test_contact(Sphere{kProbeRadius}, probe.pose, ground);
        if (!test.is_touching) ++missed;
    }
    truth.missed_share = ratio_or_zero(missed, contacts);
    return truth;
}

Dial spacing_dial() {
    const auto prepare = [](const TradePlace& place) -> TradeTrials {
        const auto probes = std::make_shared<const std::vector<ProbePose>>(
            probe_poses(*place.terrain, Sphere{kProbeRadius}, place.is_quick ? 150 : 1000));
        if (probes->empty()) return failure("no ground at the terrain's centre");
        std::vector<Ground> grounds;
        for (int i = 0; i < (place.is_quick ? 4 : 6); ++i) {
            const double wanted = grounds.empty() ? 0.0 : 2.0 * grounds.back().spacing();
            TERRANE_TRY(const Ground ground, load_contact_ground(*place.terrain, wanted));
            if (!grounds.empty() && ground.spacing() == grounds.back().spacing())
                break;  // the last ground has the coarsest spacing
            grounds.push_back(ground);
        }
        const std::size_t bodies = place.is_quick ? 30 : 100;
        return make_trials(grounds, [&](const Ground& ground) {
            const auto measure = [ground, probes, bodies,
                                  truth = compare_with_truth(*place.terrain, ground, *probes)] {
                const double height_ns = time_call_ns(probes->size(), [&](std::size_t i) {
                    const WorldPos& p = (*probes)[i].pose.translation;
                    return ground.height(p.x(), p.y()).height;
                });
                const double contact_ns = time_call_ns(probes->size(), [&](std::size_t i) {
                    std::array<Contact, 16> contacts;
                    return find_contacts(Sphere{kProbeRadius}, (*probes)[i].pose, ground, 0.0,
                                         contacts)
                        .count;
                });
                return run_drop_trial({.count = bodies, .seconds = 0.5}, ground)
                    .map([&](const DropFigures& drop) {
                        return TradeSample{height_ns,     contact_ns,         truth.depth_error_m,
                                           truth.error_m, truth.missed_share, drop.ms,
                                           drop.drift};
                    });
            };
            return TradeTrial{metres_label(ground.spacing()), measure, ground.spacing()};
        });
    };
    return {.key = "contact-spacing",
            .title = "Spacing of the contact surface",
            .axis = "m",
            .text =
                "Spheres of radius 0.5 m near the ground, compared with the true surface by "
                "sampling; drop of such spheres, milliseconds a simulated second.",
            .columns = {{"height_ns", "a height", "ns"},
                        {"contact_ns", "contacts of a sphere", "ns"},
                        {"depth_error_m", "distance from the true surface", "m"},
                        {"error_m", "certified bound of it", "m"},
                        {"missed_share", "missed contacts", "share"},
                        {"drop_ms", "drop, a simulated second", "ms"},
                        {"drift", "energy gained over lost", "share"}},
            .cost = "contact_ns",
            .loss = "depth_error_m",
            .prepare = prepare};
}

Dial drop_dial(Dial dial, std::size_t quick_count, std::string (*label_of)(double),
               const FieldValues<DropTrial>& values) {
    dial.columns = {{"drop_ms", "drop, a simulated second", "ms"},
                    {"max_depth_m", "penetration", "m"},
                    {"drift", "energy gained over lost", "share"},
                    {"fell_through", "body steps beyond the tolerance"}};
    dial.cost = "drop_ms";
    dial.loss = "max_depth_m";
    dial.prepare = [=](const TradePlace& place) -> TradeTrials {
        TERRANE_TRY(const Ground ground, load_contact_ground(*place.terrain, 0.0));
        const DropTrial fixed{.count = place.is_quick ? quick_count : std::size_t{200},
                              .seconds = place.is_quick ? 1.5 : 3.0};
        return make_trials(
            values, fixed, place.is_quick, [&](double value, const DropTrial& trial) {
                const auto measure = [trial, ground] {
                    return run_drop_trial(trial, ground).map([](const DropFigures& drop) {
                        return TradeSample{drop.ms, drop.max_depth_m, drop.drift,
                                           drop.fell_through};
                    });
                };
                return TradeTrial{label_of(value), measure, value};
            });
    };
    return dial;
}

// The lengths of steps with these rates, 1/s.
std::vector<double> lengths_of(std::vector<double> rates) {
    for (double& rate : rates) rate = 1.0 / rate;
    return rates;
}

}  // namespace

std::vector<Dial> contact_dials() {
    return {spacing_dial(),
            drop_dial({.key = "contact-tolerance",
                       .title = "Contact tolerance",
                       .axis = "m",
                       .text = "Drop of spheres of radius 0.5 m at 10 m/s onto the finest contact "
                               "surface, steps of 1/60 s."},
                      50, metres_label,
                      {.all = {1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.2},
                       .quick = {0.0001, 0.001, 0.01, 0.05},
                       .set = [](double v, DropTrial& drop) { drop.contact_tolerance = v; }}),
            drop_dial({.key = "dt",
                       .title = "Length of a step",
                       .axis = "s",
                       .text = "Drop of spheres of radius 0.5 m at 10 m/s onto the finest contact "
                               "surface; substeps of at most 1/120 s.",
                       .preset_flag = "--dt"},
                      40, rate_label,
                      {.all = lengths_of({10, 20, 30, 60, 120, 240, 300, 480}),
                       .quick = lengths_of({15, 30, 60, 120, 300}),
                       .set = [](double v, DropTrial& drop) { drop.dt = v; }}),
            drop_dial({.key = "substep",
                       .title = "Length of a substep",
                       .axis = "s",
                       .text = "The same drop; steps of 1/30 s.",
                       .preset_flag = "--substep"},
                      40, rate_label,
                      {.all = lengths_of({30, 60, 120, 240, 480, 960}),
                       .quick = lengths_of({30, 60, 120, 240}),
                       .set = [](double v, DropTrial& drop) {
                           drop.dt = 1.0 / 30.0;
                           drop.world.max_substep = v;
                       }})};
}

namespace {

Dial broadphase_dial() {
    const auto prepare = [](const TradePlace& place) -> TradeTrials {
        const std::size_t queries = place.is_quick ? 3 : 10;
        std::vector<CrowdLayout> layouts;
        for (const double spread : {1.0, 30.0}) {
            for (const CrowdScheme scheme : kCrowdSchemes) {
                CrowdLayout& layout = layouts.emplace_back();
                layout.count = place.is_quick ? 300 : 2000;
                layout.size_spread = spread;
                layout.scheme = scheme;
            }
        }
        return make_trials(layouts, [&](const CrowdLayout& layout) {
            const std::string_view scheme = to_string(layout.scheme);
            const auto measure = [crowd = std::make_shared<Crowd>(layout),
                                  queries]() -> CommandResult<TradeSample> {
                const CrowdTotals totals =
                    run_crowd(*crowd, 1.0 / 60.0,
                              [&](const CrowdTotals& so_far) { return so_far.queries < queries; });
                return TradeSample{totals.mean_step_ms(), totals.mean_update_ms(),
                                   totals.mean_query_ms(), totals.mean(totals.candidates),
                                   totals.mean(totals.pairs)};
            };
            return TradeTrial{
                .label = fmt::format("{}, {}", scheme,
                                     layout.size_spread > 1.0 ? "sizes 1:30" : "one size"),
                .measure = measure,
                .command = fmt::format(
                    "terrane bodies --count {} --size-spread {} --broadphase {} --queries {}",
                    layout.count, layout.size_spread, scheme, queries)};
        });
    };
    return {.key = "broadphase",
            .title = "Broadphase",
            .text =
                "Moving polyhedra in a cube, of one size and of sizes up to 30 times as large. "
                "All schemes find the same pairs.",
            .needs_terrain = false,
            .columns = {{"step_ms", "update and query", "ms"},
                        {"update_ms", "update", "ms"},
                        {"query_ms", "query", "ms"},
                        {"candidates", "compared pairs"},
                        {"pairs", "pairs found"}},
            .cost = "step_ms",
            .loss = "candidates",
            .prepare = prepare};
}

/// Positions of a batch query of heights.
struct BatchPlaces {
    std::vector<double> x, y, heights;
};

CommandResult<TradeTrial> thread_trial(const TradePlace& place, const Ground& ground, int threads) {
    TERRANE_TRY(GroundBatch batch, GroundBatch::create({.worker_count = threads}));
    const auto shared = std::make_shared<GroundBatch>(std::move(batch));
    const auto places = std::make_shared<BatchPlaces>();
    const std::vector<ProbePose> probes = probe_poses(*place.terrain, Sphere{0.01}, 500);
    if (probes.empty()) return failure("no ground at the terrain's centre");
    const std::size_t count =
        std::max(probes.size(), place.is_quick ? std::size_t{20'000} : std::size_t{200'000});
    for (std::size_t i = 0; i < count; ++i) {
        const WorldPos& p = probes[i % probes.size()].pose.translation;
        places->x.push_back(p.x());
        places->y.push_back(p.y());
    }
    places->heights.resize(count);
    DropTrial drop{.count = place.is_quick ? std::size_t{100} : std::size_t{1000}, .seconds = 3.0};
    drop.world.worker_count = threads;
    drop.world.collide_bodies = true;
    const auto measure = [=]() -> CommandResult<TradeSample> {
        TERRANE_TRY(const DropFigures figures, run_drop_trial(drop, ground));
        const Stopwatch watch(Clock::wall);
        TERRANE_TRY(shared->heights(ground, PointArray::separate(places->x, places->y),
                                    {.heights = places->heights}));
        return TradeSample{static_cast<double>(threads), figures.wall_ms,
                           1e6 * watch.ms() / static_cast<double>(count)};
    };
    return TradeTrial{fmt::format("{}", threads), measure, static_cast<double>(threads)};
}

Dial thread_dial() {
    const auto prepare = [](const TradePlace& place) -> TradeTrials {
        TERRANE_TRY(const Ground ground, load_contact_ground(*place.terrain, 0.0));
        const int most = static_cast<int>(std::min(16U, std::thread::hardware_concurrency()));
        std::vector<int> counts;
        for (int threads = 1; threads <= std::max(2, most); threads *= 2) counts.push_back(threads);
        return make_trials(counts,
                           [&](int threads) { return thread_trial(place, ground, threads); });
    };
    return {.key = "threads",
            .title = "Threads",
            .axis = "threads",
            .text =
                "Drop of spheres, milliseconds a simulated second, and a batch of heights. Any "
                "number of threads gives the same bits.",
            .columns = {{"threads", "threads"},
                        {"drop_ms", "drop, a simulated second", "ms"},
                        {"batch_ns", "a height of a batch", "ns"}},
            .cost = "threads",
            .loss = "drop_ms",
            .prepare = prepare};
}

}  // namespace

std::vector<Dial> crowd_dials() { return {broadphase_dial(), thread_dial()}; }

}  // namespace terrane::tools
