// SPDX-License-Identifier: MIT
//
// Nanoseconds a query, for every pair of shapes and kind of query; about half of the poses overlap.
//
//   shape_pairs_benchmark [rounds]
#include "lab/measure.h"
#include "support/random.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

using namespace terrane;

struct Named {
    const char* name;
    Shape shape;
};

Eigen::Vector3d direction(test::Random& random) {
    for (;;) {
        const Eigen::Vector3d v(random.between(-1, 1), random.between(-1, 1),
                                random.between(-1, 1));
        if (v.norm() > 0.1 && v.norm() < 1.0) return v.normalized();
    }
}

ConvexHull ball_of(int count) {
    test::Random random(static_cast<std::uint64_t>(count));
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < count; ++i) points.push_back(0.8 * direction(random));
    return ConvexHull::create(points).value();
}

struct MotionPair {
    Motion a, b;
};

template <typename Question>
double time_ns(const std::vector<MotionPair>& poses, int rounds, const Question& query) {
    double best = 1e300;
    for (int round = 0; round < rounds; ++round) {
        best = std::min(best, tools::time_call_ns(poses.size(),
                                                  [&](std::size_t i) { return query(poses[i]); }));
    }
    return best;
}

}  // namespace

int main(int argc, char** argv) {
    const int rounds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 7;
    const std::vector<Named> shapes = {{"sphere", Sphere{0.5}},
                                       {"capsule", Capsule{0.4, 0.8}},
                                       {"box", Box{Eigen::Vector3d(1.0, 0.6, 0.4)}},
                                       {"hull 20", ball_of(20)},
                                       {"hull 1000", ball_of(1000)}};
    std::printf("%-22s %8s %8s %8s %8s %8s %8s  touching\n", "ns a query", "test", "find",
                "distance", "pseudo", "cast 5m", "turning");
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        for (std::size_t j = i; j < shapes.size(); ++j) {
            const Shape& a = shapes[i].shape;
            const Shape& b = shapes[j].shape;
            test::Random random(9);
            const bool is_large = j == 4;
            std::vector<MotionPair> poses, casts;
            int touching = 0;
            for (int k = 0; k < (is_large ? 200 : 2000); ++k) {
                MotionPair pair;
                pair.a.start.rotation =
                    Motion{{}, {0, 0, 0}, 3.0 * direction(random)}.at(1.0).rotation;
                pair.b.start.rotation =
                    Motion{{}, {0, 0, 0}, 3.0 * direction(random)}.at(1.0).rotation;
                pair.b.start.translation = random.between(0.4, 2.0) * direction(random);
                touching += test_contact(a, pair.a.start, b, pair.b.start).is_touching;
                poses.push_back(pair);
                pair.a.translation = 5.0 * direction(random);
                pair.b.start.translation =
                    (0.6 * pair.a.translation + 0.7 * direction(random)).eval();
                pair.a.rotation_vector = direction(random);
                casts.push_back(pair);
            }
            std::array<PairContact, 4> contacts;
            const double test_ns = time_ns(poses, rounds, [&](const MotionPair& p) {
                return test_contact(a, p.a.start, b, p.b.start).is_touching ? 1.0 : 0.0;
            });
            const double find_ns = time_ns(poses, rounds, [&](const MotionPair& p) {
                return static_cast<double>(
                    find_contacts(a, p.a.start, b, p.b.start, 0.01, contacts).count);
            });
            const double distance_ns = time_ns(poses, rounds, [&](const MotionPair& p) {
                return signed_distance(a, p.a.start, b, p.b.start).distance;
            });
            const double pseudo_ns = time_ns(poses, rounds, [&](const MotionPair& p) {
                return pseudodistance(a, p.a.start, b, p.b.start).pseudodistance;
            });
            const double turning_ns = time_ns(
                casts, rounds, [&](const MotionPair& p) { return cast(a, p.a, b, p.b).fraction; });
            for (MotionPair& motion : casts) motion.a.rotation_vector.setZero();
            const double cast_ns = time_ns(
                casts, rounds, [&](const MotionPair& p) { return cast(a, p.a, b, p.b).fraction; });
            char name[64];
            std::snprintf(name, sizeof name, "%s, %s", shapes[i].name, shapes[j].name);
            std::printf("%-22s %8.0f %8.0f %8.0f %8.0f %8.0f %8.0f  %.0f %%\n", name, test_ns,
                        find_ns, distance_ns, pseudo_ns, cast_ns, turning_ns,
                        100.0 * touching / static_cast<double>(poses.size()));
            std::fflush(stdout);
        }
    }
}
