// SPDX-License-Identifier: MIT
#pragma once

#include "benchmark/bench.h"
#include "benchmark/collision/contact_workload.h"
#include "support/random.h"

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

namespace terrane::bench {

/// What an adapter benchmark drops.
struct AdapterDrop {
    std::vector<Shape> shapes;
    std::vector<WorldPos> places;
    std::vector<Eigen::Vector3d> spins;  ///< rad/s
};

/// Bodies 8 m apart in the middle of a map, 1 to 3 m above the ground.
inline AdapterDrop lay_out_adapter_drop(const ContactMap& map, const DropKind& kind,
                                        std::size_t count) {
    test::Random random(3);
    AdapterDrop drop;
    const int row = 32;
    const double middle = 0.5 * map.width();
    for (std::size_t i = 0; i < count; ++i) {
        drop.shapes.push_back(kind.shapes[i % kind.shapes.size()]);
        const double x = middle + 8.0 * (static_cast<int>(i) % row - row / 2);
        const double y = middle + 8.0 * (static_cast<int>(i) / row - row / 2);
        drop.places.emplace_back(x, y, map.ground.height(x, y).height + random.between(1.0, 3.0));
        drop.spins.push_back(2.0 * random.direction());
    }
    return drop;
}

/// Steps two simulations in turns and prints their medians and the ratio ours / theirs; 1/60 s a step. The first
/// second, of falling, is left out.
template <class Ours, class Theirs>
void compare_steps(const char* engine, const std::string& kind, std::size_t count, int steps,
                   Ours& ours, Theirs& theirs) {
    std::vector<double> our_ms, their_ms;
    for (int step = 0; step < steps; ++step) {
        const Stopwatch first(Clock::thread);
        ours.step();
        const double our_time = first.ms();
        const Stopwatch second(Clock::thread);
        theirs.step();
        if (step < std::min(60, steps / 2)) continue;
        their_ms.push_back(second.ms());
        our_ms.push_back(our_time);
    }
    const double mine = median(our_ms), other = median(their_ms);
    std::printf(
        "%s %5zu %-8s Terrane's shape %8.3f ms a step, %zu below; its height field %8.3f, %zu "
        "below; %.2f\n",
        engine, count, kind.c_str(), mine, ours.below(), other, theirs.below(), mine / other);
}

}  // namespace terrane::bench
