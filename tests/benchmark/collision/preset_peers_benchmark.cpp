// SPDX-License-Identifier: MIT
//
// The presets of the program in drops, and poured into a pit of 30 m, beside Bullet's world with its own defaults on
// the same heights: time of a simulated second against the deepest penetration. Sleeping off, one thread, medians of
// runs in turns.
//
//   preset_peers_benchmark [--quick] [--count N] [--seconds T]
//
// Penetration is the length of the shortest translation that separates the shape from the ground, of both engines by
// the same function over the same triangles, at the end of each step; of bodies that are not below the ground already.
// The runs that measure it are not timed.
//
// Exits with 1 if a body of ours fell through or was deeper than its tolerance, or if measuring depths changed states.
#include "benchmark/bench.h"
#include "benchmark/collision/contact_workload.h"
#include "program/options.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#ifdef TERRANE_BENCH_BULLET
#include "benchmark/collision/body_peers.h"
#endif

namespace terrane::bench {
namespace {

struct Options {
    std::size_t count = 300;
    double seconds = 4.0;
    std::size_t runs = 5;
};

/// What an engine did in one drop.
struct Outcome {
    std::vector<double> ms;  ///< of a simulated second, one for each run
    double deepest_m = 0.0;
    std::size_t fell = 0;               ///< bodies that ended below the ground
    std::size_t too_deep = 0;           ///< body steps beyond the tolerance, of ours
    std::vector<std::uint64_t> hashes;  ///< of the states after each run, of ours
};

/// The poses of all bodies after a step.
using Poses = std::vector<Pose>;

/// A world in the middle of a drop.
struct Simulation {
    std::function<std::size_t()> step;  ///< returns the bodies deeper than their tolerance
    std::function<Poses()> poses;
    std::function<std::uint64_t()> hash;  ///< of all states; empty: not compared
};

/// An engine with its settings.
struct Contestant {
    std::string name;
    double dt;
    std::function<Simulation(const BodyDrop&, bool measures_depth)> begin;
};

Contestant make_preset(const tools::Preset& preset, const ContactMap& map) {
    const double dt = tools::preset_value(preset, "--dt").value();
    const double substep = tools::preset_value(preset, "--substep").value();
    const auto begin = [&map, dt, substep](const BodyDrop& drop, bool measures_depth) {
        const auto world = std::make_shared<World>(value_or_exit(World::create(
            {.max_substep = substep, .allow_sleep = false, .measure_depth = measures_depth})));
        for (std::size_t i = 0; i < drop.states.size(); ++i) {
            value_or_exit(world->add(drop.settings[i], drop.states[i]));
        }
        return Simulation{[world, &map, dt] { return world->step(map.ground, dt).too_deep; },
                          [world] {
                              Poses poses;
                              for (const BodyState& state : world->states())
                                  poses.push_back(state.pose);
                              return poses;
                          },
                          [world] { return world->state_hash(); }};
    };
    return {std::string(preset.name), dt, begin};
}

#ifdef TERRANE_BENCH_BULLET
Contestant make_peer(const ContactMap& map) {
    constexpr double kPeerStep = 1.0 / 60.0;
    const auto begin = [&map](const BodyDrop& drop, bool) {
        const auto peer = std::make_shared<BodiesPeer>(map.table);
        for (std::size_t i = 0; i < drop.states.size(); ++i) {
            peer->add(drop.settings[i], drop.states[i]);
        }
        return Simulation{[peer] {
                              peer->step(kPeerStep);
                              return std::size_t{0};
                          },
                          [peer, count = drop.states.size()] {
                              Poses poses;
                              for (std::size_t i = 0; i < count; ++i)
                                  poses.push_back(peer->pose(i));
                              return poses;
                          },
                          {}};
    };
    return {BodiesPeer::name(), kPeerStep, begin};
}
#endif

int step_count(const Contestant& contestant, double seconds) {
    return static_cast<int>(std::lround(seconds / contestant.dt));
}

void time_run(const Contestant& contestant, const BodyDrop& drop, double seconds,
              Outcome& outcome) {
    const Simulation simulation = contestant.begin(drop, false);
    const Stopwatch stopwatch(Clock::thread);
    for (int i = 0; i < step_count(contestant, seconds); ++i) simulation.step();
    outcome.ms.push_back(stopwatch.ms() / seconds);
    if (simulation.hash) outcome.hashes.push_back(simulation.hash());
}

void judge_run(const Contestant& contestant, const ContactMap& map, const BodyDrop& drop,
               double seconds, Outcome& outcome) {
    const Simulation simulation = contestant.begin(drop, true);
    Poses poses;
    for (int step = 0; step < step_count(contestant, seconds); ++step) {
        outcome.too_deep += simulation.step();
        poses = simulation.poses();
        for (std::size_t i = 0; i < poses.size(); ++i) {
            if (map.is_below(poses[i].translation)) continue;
            const DistanceAnswer answer =
                signed_distance(drop.settings[i].shape, poses[i], map.ground, 0.0);
            outcome.deepest_m = std::max(outcome.deepest_m, -answer.distance);
        }
    }
    outcome.fell = static_cast<std::size_t>(std::ranges::count_if(
        poses, [&](const Pose& pose) { return map.is_below(pose.translation); }));
    if (simulation.hash) outcome.hashes.push_back(simulation.hash());
}

/// One line for each engine; the peer is the last one. Whether none of our bodies fell through or was too deep.
bool compare(const char* scene, const ContactMap& map, const BodyDrop& drop,
             const Options& options) {
    std::vector<Contestant> contestants;
    for (const tools::Preset& preset : tools::presets()) {
        contestants.push_back(make_preset(preset, map));
    }
    const std::size_t ours = contestants.size();
#ifdef TERRANE_BENCH_BULLET
    contestants.push_back(make_peer(map));
#endif
    std::vector<Outcome> outcomes(contestants.size());
    tools::take_turns(contestants.size(), {.most_turns = options.runs},
                      [&](std::size_t i, std::size_t) {
                          time_run(contestants[i], drop, options.seconds, outcomes[i]);
                          return true;
                      });
    bool is_fine = true;
    for (std::size_t i = 0; i < contestants.size(); ++i) {
        judge_run(contestants[i], map, drop, options.seconds, outcomes[i]);
        if (i < ours) is_fine = is_fine && outcomes[i].fell == 0 && outcomes[i].too_deep == 0;
        const std::vector<std::uint64_t>& hashes = outcomes[i].hashes;
        if (hashes.empty() || std::ranges::count(hashes, hashes[0]) == std::ssize(hashes)) continue;
        std::printf("%s, %s: states differ between runs\n", scene, contestants[i].name.c_str());
        is_fine = false;
    }
    const Outcome& peer = outcomes.back();
    for (std::size_t i = 0; i < contestants.size(); ++i) {
        const Outcome& each = outcomes[i];
        const bool beats = i < ours && outcomes.size() > ours &&
                           median(each.ms) < median(peer.ms) && each.deepest_m < peer.deepest_m;
        std::printf(
            "%-22s %-22s 1/%-4.0f %9.1f (%.1f to %.1f) ms  %10.6f m  %4zu fell  %5.2f x%s\n", scene,
            contestants[i].name.c_str(), 1.0 / contestants[i].dt, median(each.ms),
            quantile(each.ms, 0.0), quantile(each.ms, 1.0), each.deepest_m, each.fell,
            median(peer.ms) / median(each.ms), beats ? "  faster and less deep" : "");
    }
    std::fflush(stdout);
    return is_fine;
}

/// A cone of 45 degrees down to a floor, 30 m deep.
test::HeightTable make_pit(int side) {
    test::HeightTable table;
    table.columns = table.rows = side;
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const double r = std::hypot(column - 0.5 * (side - 1), row - 0.5 * (side - 1));
            table.heights.push_back(static_cast<float>(std::clamp(r - 40.0, -30.0, 0.0)));
        }
    }
    return table;
}

bool compare_all(const Options& options) {
    const ContactMap map = make_contact_map(513, 1.0);
    const double half_width = std::min(200.0, 3.0 * std::sqrt(double(options.count)));
    bool is_fine = true;
    for (const double speed : {0.0, 50.0}) {
        for (const DropKind& kind : drop_kinds()) {
            const BodyDrop drop =
                lay_out_drop(map, kind.shapes, options.count, half_width, 6.0, {0.0, 0.0, -speed});
            const std::string scene = kind.name + (speed > 0.0 ? ", down at 50 m/s" : ", dropped");
            is_fine = compare(scene.c_str(), map, drop, options) && is_fine;
        }
    }
    const ContactMap pit = make_map(make_pit(257));
    const BodyDrop heap = lay_out_drop(pit, drop_kinds().back().shapes, options.count, 14.0, 4.7);
    return compare("mixed, into a pit", pit, heap, options) && is_fine;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    Arguments arguments(argc, argv,
                        "preset_peers_benchmark [--quick] [--count 4-4000] [--seconds T]");
    Options options;
    if (arguments.has("--quick")) options = {.count = 20, .seconds = 1.0, .runs = 1};
    options.count = arguments.number("--count", 4.0, 4000.0, options.count);
    options.seconds = arguments.number("--seconds", 0.1, 1000.0, options.seconds);
    arguments.finish();
    std::printf("%s\n", describe_machine().c_str());
    std::printf(
        "%zu bodies, %g s; time of a simulated second, deepest penetration, x: its time over "
        "ours\n",
        options.count, options.seconds);
    return compare_all(options) ? 0 : 1;
}
