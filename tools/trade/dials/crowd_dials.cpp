// SPDX-License-Identifier: MIT
#include "crowd/schemes/crowd_run.h"
#include "trade/dials/dial_list.h"
#include "trade/trials/contact_ground.h"
#include "trade/trials/drop_trial.h"

#include <terrane/terrain/ground_batch.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <thread>

namespace terrane::tools {
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

/// Places whose heights are asked all at once.
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
