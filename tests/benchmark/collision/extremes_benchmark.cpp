// SPDX-License-Identifier: MIT
//
// The support vertex of a convex hull: time of a scan and of a climb against the number of vertices, and where they
// cross. kClimbFrom of collision/shapes/polyhedron.h comes from here.
#include "benchmark/bench.h"
#include "collision/shapes/point_clouds.h"
#include "shapes/query_shapes.h"

#include <cstdio>
#include <vector>

namespace terrane {
namespace {

using Directions = std::vector<Eigen::Vector3d>;

// Median of several runs over all directions, nanoseconds a query.
template <class Find>
double measure_ns(const Directions& directions, int runs, Find find) {
    std::vector<double> times;
    for (int run = 0; run < runs; ++run) {
        times.push_back(tools::time_call_ns(directions.size(),
                                            [&](std::size_t i) { return find(directions[i]); }));
    }
    return tools::median(times);
}

struct Times {
    double scan_ns = 0.0;
    double climb_ns = 0.0;
};

Times measure(const internal::Polyhedron& hull, const Directions& directions, int runs) {
    // Small hulls have no climb table.
    internal::ClimbTable table;
    table.first_neighbour.assign(hull.first_neighbour.begin(), hull.first_neighbour.end());
    table.neighbours.assign(hull.neighbours.begin(), hull.neighbours.end());
    table.slack = 1e-14;
    internal::fill_climb_starts(hull.vertices, table);
    Times times;
    times.scan_ns = measure_ns(directions, runs, [&](const Eigen::Vector3d& direction) {
        return internal::find_extreme_by_scan(hull.vertices, direction);
    });
    times.climb_ns = measure_ns(directions, runs, [&](const Eigen::Vector3d& direction) {
        return internal::find_extreme_by_climb(hull.vertices, table, direction);
    });
    return times;
}

int run(bool quick) {
    const int runs = quick ? 1 : 9;
    test::Random random(5);
    Directions directions;
    for (int i = 0; i < 1024; ++i) directions.push_back(random.direction());
    std::printf("hulls of random points on a sphere, random directions; ns a question\n");
    std::printf("%8s %10s %10s\n", "vertices", "scan", "climb");
    double last_n = 0.0;
    double last_gain = 0.0;
    double break_even = 0.0;
    for (const int n : {8,   12,  16,  20,  24,   32,   40,   48,   64,   96,    128,
                        200, 300, 500, 800, 1200, 2000, 3000, 5000, 8000, 10'000}) {
        const Result<ConvexHull> hull = ConvexHull::create(test::sphere(random, n));
        if (!hull) return 1;
        const Times times = measure(internal::polyhedron(*hull), directions, runs);
        std::printf("%8d %10.1f %10.1f\n", n, times.scan_ns, times.climb_ns);
        const double gain = times.scan_ns - times.climb_ns;
        if (last_gain < 0.0 && gain >= 0.0) {
            break_even = last_n + (n - last_n) * last_gain / (last_gain - gain);
        }
        last_n = n;
        last_gain = gain;
    }
    std::printf("break-even: %.0f vertices (kClimbFrom = %zu)\n", break_even, internal::kClimbFrom);
    return 0;
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
    terrane::bench::Arguments arguments(argc, argv, "extremes_benchmark [--quick]");
    const bool is_quick = arguments.has("--quick");
    arguments.finish();
    return terrane::run(is_quick);
}
