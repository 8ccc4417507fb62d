// SPDX-License-Identifier: MIT
//
// Time of an update of a GroundWindow of 255 x 255 cells that follows a box, beside a window that reads all of it:
// medians.
//
//   ground_window_benchmark [--quick]
#include "benchmark/collision/contact_workload.h"
#include "benchmark/machine.h"

#include <terrane/terrain/ground_window.h>

#include <cstdio>
#include <string_view>
#include <vector>

namespace terrane::bench {
namespace {

Aabb box_at(double x, double y) { return {{x, y, 0.0}, {x + 1.0, y + 1.0, 1.0}}; }

void measure(bool is_quick) {
    const ContactMap map = make_contact_map(is_quick ? 513 : 1025, 1.0);
    const int moves = is_quick ? 20 : 400;
    GroundWindow kept = GroundWindow::create({}).value();
    GroundWindow stale = GroundWindow::create({}).value();
    std::vector<double> one_column, nothing, everything;
    const double y = 0.5 * map.width();
    for (int i = 0; i < moves; ++i) {
        const double x = 150.5 + i;
        kept.update(map.ground, box_at(x, y));
        const Stopwatch move(Clock::thread);
        const WindowUpdate moved = kept.update(map.ground, box_at(x + 1.0, y));
        if (moved.has_moved) one_column.push_back(1e3 * move.ms());
        const Stopwatch same(Clock::thread);
        kept.update(map.ground, box_at(x + 1.0, y));
        nothing.push_back(1e3 * same.ms());
        if (i % 20 != 0) continue;
        stale.set_base(0.0);  // reads everything
        const Stopwatch all(Clock::thread);
        stale.update(map.ground, box_at(x, y));
        everything.push_back(1e3 * all.ms());
    }
    if (one_column.empty()) one_column.push_back(0.0);
    std::printf(
        "255 x 255 cells, us an update: moved by one column %.2f, not moved %.2f, all of it %.1f\n",
        median(one_column), median(nothing), median(everything));
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    terrane::bench::measure(argc > 1 && std::string_view(argv[1]) == "--quick");
    return 0;
}
