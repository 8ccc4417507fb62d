// SPDX-License-Identifier: MIT
//
// The presets of the program in drops beside Bullet's world with its own defaults on the same heights: time of a
// simulated second against the deepest penetration. Sleeping off, one thread, medians of runs in turns.
//
//   preset_peers_benchmark [--quick] [--count N] [--seconds T]
//
// Penetration is the length of the shortest translation that separates the shape from the ground, of both engines by
// the same function over the same triangles, at the end of each step; of bodies that are not below the ground already.
// The runs that measure it are not timed.
//
// Exits with 1 if a body of ours fell through or was deeper than its tolerance.
#include "benchmark/collision/contact_workload.h"
#include "benchmark/machine.h"
#include "program/options.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#ifdef TERRANE_BENCH_BULLET
#include "benchmark/collision/body_peers.h"
#endif

namespace terrane::bench {
namespace {

struct Options {
    std::size_t count = 300;
    double seconds = 4.0;
    int runs = 5;
};

/// What an engine did in one drop.
struct Outcome {
    std::vector<double> ms;  ///< of a simulated second, one for each run
    double deepest_m = 0.0;
    std::size_t fell = 0;      ///< bodies that ended below the ground
    std::size_t too_deep = 0;  ///< body steps beyond the tolerance, of ours
};

/// The poses of all bodies after a step.
using Poses = std::vector<Pose>;

/// A world in the middle of a drop.
struct Simulation {
    std::function<std::size_t()> step;  ///< returns the bodies deeper than their tolerance
    std::function<Poses()> poses;
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
        Result<World> made = World::create(
            {.max_substep = substep, .allow_sleep = false, .measure_depth = measures_depth});
        for (std::size_t i = 0; i < drop.states.size(); ++i) {
            if (!made || !made->add(drop.settings[i], drop.states[i])) std::abort();
        }
        const auto world = std::make_shared<World>(std::move(*made));
        return Simulation{[world, &map, dt] { return world->step(map.ground, dt).too_deep; },
                          [world] {
                              Poses poses;
                              for (const BodyState& state : world->states())
                                  poses.push_back(state.pose);
                              return poses;
                          }};
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
                          }};
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
}

bool is_below(const ContactMap& map, const Pose& pose) {
    const WorldPos& p = pose.translation;
    const HeightAnswer ground = map.ground.height(p.x(), p.y());
    return ground.status != QueryStatus::ok || p.z() < ground.height;
}

void judge_run(const Contestant& contestant, const ContactMap& map, const BodyDrop& drop,
               double seconds, Outcome& outcome) {
    const Simulation simulation = contestant.begin(drop, true);
    Poses poses;
    for (int step = 0; step < step_count(contestant, seconds); ++step) {
        outcome.too_deep += simulation.step();
        poses = simulation.poses();
        for (std::size_t i = 0; i < poses.size(); ++i) {
            if (is_below(map, poses[i])) continue;
            const DistanceAnswer answer =
                signed_distance(drop.settings[i].shape, poses[i], map.ground, 0.0);
            outcome.deepest_m = std::max(outcome.deepest_m, -answer.distance);
        }
    }
    outcome.fell = static_cast<std::size_t>(std::count_if(
        poses.begin(), poses.end(), [&](const Pose& pose) { return is_below(map, pose); }));
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
    for (int run = 0; run < options.runs; ++run) {
        for (std::size_t i = 0; i < contestants.size(); ++i) {
            time_run(contestants[i], drop, options.seconds, outcomes[i]);
        }
    }
    bool is_fine = true;
    for (std::size_t i = 0; i < contestants.size(); ++i) {
        judge_run(contestants[i], map, drop, options.seconds, outcomes[i]);
        if (i < ours) is_fine = is_fine && outcomes[i].fell == 0 && outcomes[i].too_deep == 0;
    }
    const Outcome& peer = outcomes.back();
    for (std::size_t i = 0; i < contestants.size(); ++i) {
        const Outcome& each = outcomes[i];
        const bool beats = i < ours && outcomes.size() > ours &&
                           median(each.ms) < median(peer.ms) && each.deepest_m < peer.deepest_m;
        std::printf(
            "%-22s %-22s 1/%-4.0f %9.1f (%.1f to %.1f) ms  %10.6f m  %4zu fell  %5.2f x%s\n", scene,
            contestants[i].name.c_str(), 1.0 / contestants[i].dt, median(each.ms),
            *std::min_element(each.ms.begin(), each.ms.end()),
            *std::max_element(each.ms.begin(), each.ms.end()), each.deepest_m, each.fell,
            median(peer.ms) / median(each.ms), beats ? "  faster and less deep" : "");
    }
    std::fflush(stdout);
    return is_fine;
}

bool compare_all(const Options& options) {
    const ContactMap map = make_contact_map(513, 1.0);
    const double half_width = std::min(200.0, 3.0 * std::sqrt(double(options.count)));
    const Shape sphere = Sphere{0.5}, capsule = Capsule{0.4, 0.8}, box = Box{{1.0, 2.0, 0.5}};
    bool is_fine = true;
    for (const double speed : {0.0, 50.0}) {
        for (const auto& [name, shapes] :
             {std::pair("spheres", std::vector{sphere}),
              std::pair("capsules", std::vector{capsule}), std::pair("boxes", std::vector{box}),
              std::pair("mixed", std::vector{sphere, capsule, box})}) {
            const BodyDrop drop =
                lay_out_drop(map, shapes, options.count, half_width, 6.0, {0.0, 0.0, -speed});
            const std::string scene =
                std::string(name) + (speed > 0.0 ? ", down at 50 m/s" : ", dropped");
            is_fine = compare(scene.c_str(), map, drop, options) && is_fine;
        }
    }
    return is_fine;
}

std::optional<Options> parse(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string_view argument = argv[i];
        const char* const value = i + 1 < argc ? argv[i + 1] : nullptr;
        if (argument == "--quick") {
            options = {.count = 20, .seconds = 1.0, .runs = 1};
        } else if (value != nullptr && argument == "--count") {
            options.count = std::strtoul(value, nullptr, 10);
            ++i;
        } else if (value != nullptr && argument == "--seconds") {
            options.seconds = std::atof(value);
            ++i;
        } else {
            return std::nullopt;
        }
    }
    const bool is_fine = options.count >= 4 && options.count <= 4000 && options.seconds >= 0.1 &&
                         options.seconds <= 1000.0;
    return is_fine ? std::optional(options) : std::nullopt;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    const std::optional<Options> options = parse(argc, argv);
    if (!options) {
        std::fprintf(stderr, "preset_peers_benchmark [--quick] [--count 4-4000] [--seconds T]\n");
        return 2;
    }
    std::printf("%s\n", describe_machine().c_str());
    std::printf(
        "%zu bodies, %g s; time of a simulated second, deepest penetration, x: its time over "
        "ours\n",
        options->count, options->seconds);
    return compare_all(*options) ? 0 : 1;
}
