// SPDX-License-Identifier: MIT
//
// The support vertex of a convex hull: time of a scan and of a climb against the number of vertices, and where they
// cross. kClimbFrom of collision/shapes/polyhedron.h comes from here.
#include "benchmark/bench.h"
#include "collision/shapes/point_clouds.h"
#include "shapes/query_shapes.h"

#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

namespace terrane {
namespace {

using Directions = std::vector<Eigen::Vector3d>;

/// A hull with the climb table that the library makes for large hulls only.
struct TestHull {
    ConvexHull hull;
    internal::ClimbTable table;
    std::vector<double> scans_ns, climbs_ns;  ///< [turns] means over all directions

    explicit TestHull(ConvexHull made) : hull(std::move(made)) {
        const internal::Polyhedron& shape = internal::polyhedron(hull);
        table.first_neighbour.assign(shape.first_neighbour.begin(), shape.first_neighbour.end());
        table.neighbours.assign(shape.neighbours.begin(), shape.neighbours.end());
        table.slack = 1e-14;
        internal::fill_climb_starts(shape.vertices, table);
    }

    void measure(const Directions& directions) {
        const internal::Polyhedron& shape = internal::polyhedron(hull);
        scans_ns.push_back(tools::time_call_ns(directions.size(), [&](std::size_t i) {
            return internal::find_extreme_by_scan(shape.vertices, directions[i]);
        }));
        climbs_ns.push_back(tools::time_call_ns(directions.size(), [&](std::size_t i) {
            return internal::find_extreme_by_climb(shape.vertices, table, directions[i]);
        }));
    }
};

// Every second number of vertices around the break-even, and steps of about a half far from it.
std::vector<int> vertex_counts() {
    std::vector<int> counts{8, 12, 16, 20, 24};
    for (int n = 26; n <= 72; n += 2) counts.push_back(n);
    for (const int n : {96, 128, 200, 300, 500, 800, 1200, 2000, 3000, 5000, 8000, 10'000}) {
        counts.push_back(n);
    }
    return counts;
}

int run(bool quick) {
    const std::size_t turns = quick ? 1 : 9, hulls = quick ? 1 : 5;  // of each number of vertices
    test::Random random(5);
    Directions directions;
    for (int i = 0; i < 1024; ++i) directions.push_back(random.direction());
    const std::vector<int> counts = vertex_counts();
    std::vector<TestHull> cases;
    for (const int n : counts) {
        for (std::size_t i = 0; i < hulls; ++i) {
            Result<ConvexHull> hull = ConvexHull::create(test::sphere(random, n));
            if (!hull) return 1;
            cases.emplace_back(*std::move(hull));
        }
    }
    tools::take_turns(cases.size(), {.most_turns = turns}, [&](std::size_t i, std::size_t) {
        cases[i].measure(directions);
        return true;
    });
    std::printf(
        "%zu hulls of random points on a sphere for each number of vertices, random "
        "directions; ns a question, the mean of the hulls' medians of %zu turns\n",
        hulls, turns);
    std::printf("%8s %10s %10s\n", "vertices", "scan", "climb");
    std::vector<double> vertices, gains;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        double scan = 0.0, climb = 0.0;
        for (std::size_t k = i * hulls; k < (i + 1) * hulls; ++k) {
            scan += tools::median(cases[k].scans_ns) / static_cast<double>(hulls);
            climb += tools::median(cases[k].climbs_ns) / static_cast<double>(hulls);
        }
        std::printf("%8d %10.1f %10.1f\n", counts[i], scan, climb);
        vertices.push_back(counts[i]);
        gains.push_back(scan - climb);
    }
    const std::optional<tools::SignChange> change = tools::find_sign_change(vertices, gains);
    if (!change) return 1;
    std::printf("a scan is faster below %.0f vertices, a climb above %.0f (kClimbFrom = %zu)\n",
                change->from, change->to, internal::kClimbFrom);
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
