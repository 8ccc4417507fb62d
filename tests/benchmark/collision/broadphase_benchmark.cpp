// SPDX-License-Identifier: MIT
//
// Time to find the touching pairs of many moving spheres: 2 % of the volume, 1 m across, moving 1/60 m a step.
// One thread, after a few steps that are not measured; beside Bullet's collision world where it is found. The first
// columns are medians: most steps reuse what a few compute, and the means and the longest steps show those too.
//
//   broadphase_benchmark [--quick] [--alone] [--most COUNT] [--only KIND]
//
// --quick: few bodies and steps, as ctest runs it. --alone: without Bullet. --most: largest number of bodies.
// --only: one kind, without Bullet.
//
// Exits with 1 if two of them find different numbers of touching pairs, or if the grid's operations a body differ by
// over 2 % between counts.
#include "benchmark/bench.h"
#include "benchmark/collision/body_peers.h"
#include "support/random.h"

#include <terrane/collision/broadphase.h>
#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace terrane::bench {
namespace {

constexpr double kRadius = 0.5;
constexpr double kShare = 0.02;       // of the volume
constexpr double kStep = 1.0 / 60.0;  // metres
constexpr int kUnmeasured = 5;        // first steps, in which everything is new

struct Spheres {
    std::vector<Eigen::Vector3d> centres;
    std::vector<Eigen::Vector3d> velocities;

    explicit Spheres(std::size_t count) {
        test::Random random(9);
        const double volume = static_cast<double>(count) * 4.18879 * kRadius * kRadius * kRadius;
        const double width = std::cbrt(volume / kShare);
        for (std::size_t i = 0; i < count; ++i) {
            const double x = random.between(0.0, width);
            const double y = random.between(0.0, width);
            centres.emplace_back(x, y, random.between(0.0, width));
            velocities.push_back(kStep * random.direction());
        }
    }
    void move() {
        for (std::size_t i = 0; i < centres.size(); ++i) centres[i] += velocities[i];
    }
};

struct Costs {
    double update_ms = 0.0;
    double pairs_ms = 0.0;   ///< from boxes to pairs
    double narrow_ms = 0.0;  ///< from pairs to contacts
    double step_ms = 0.0;    ///< all of it, and the boxes
    double mean_ms = 0.0;    ///< of a step: most steps reuse what a few compute
    double worst_ms = 0.0;   ///< of the steps
    std::size_t pairs = 0;
    std::size_t touching = 0;
    std::uint64_t candidates = 0;
    double operations_a_body = 0.0;  ///< of the update that had most
};

double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
}

Costs measure(BroadphaseKind kind, std::size_t count, int steps) {
    Spheres spheres(count);
    const auto broadphase = make_broadphase(kind, 0.0);
    const Shape shape = Sphere{kRadius};
    std::vector<Aabb> bounds(count);
    std::vector<double> update, pairs, narrow, step;
    Costs costs;
    std::uint64_t operations = 0;
    for (int i = 0; i < kUnmeasured + steps; ++i) {
        if (i == kUnmeasured) {
            for (std::vector<double>* times : {&update, &pairs, &narrow, &step}) times->clear();
        }
        spheres.move();
        const Stopwatch whole(Clock::wall);
        for (std::size_t k = 0; k < count; ++k) {
            const Eigen::Vector3d around = Eigen::Vector3d::Constant(kRadius);
            bounds[k] = {spheres.centres[k] - around, spheres.centres[k] + around};
        }
        const Stopwatch updating(Clock::wall);
        broadphase->update(bounds);
        update.push_back(updating.ms());
        operations = std::max(operations, broadphase->update_operations());
        const Stopwatch finding(Clock::wall);
        const std::span<const BodyPair> found = broadphase->find_pairs();
        pairs.push_back(finding.ms());
        const Stopwatch looking(Clock::wall);
        costs.touching = 0;
        PairContact contact;
        for (const BodyPair& pair : found) {
            Pose a, b;
            a.translation = spheres.centres[pair.a];
            b.translation = spheres.centres[pair.b];
            costs.touching += find_contacts(shape, a, shape, b, 0.0, {&contact, 1}).count;
        }
        narrow.push_back(looking.ms());
        step.push_back(whole.ms());
        costs.pairs = found.size();
    }
    costs.update_ms = median(update);
    costs.pairs_ms = median(pairs);
    costs.narrow_ms = median(narrow);
    costs.step_ms = median(step);
    costs.mean_ms = mean(step);
    costs.worst_ms = quantile(step, 1.0);
    costs.candidates = broadphase->candidate_count();
    costs.operations_a_body = static_cast<double>(operations) / static_cast<double>(count);
    return costs;
}

#ifdef TERRANE_BENCH_BULLET
void measure_peer(PeerBroadphase kind, const char* name, std::size_t count, int steps,
                  std::size_t& touching_out) {
    Spheres spheres(count);
    BroadphasePeer peer(kind, kRadius, spheres.centres);
    std::vector<double> step;
    for (int i = 0; i < kUnmeasured + steps; ++i) {
        if (i == kUnmeasured) step.clear();
        spheres.move();
        const Stopwatch whole(Clock::wall);
        touching_out = peer.step(spheres.centres);
        step.push_back(whole.ms());
    }
    std::printf("%9zu  %-14s %9s %9s %9s %9.3f %9.3f %9.3f %10s %9zu\n", count, name, "", "", "",
                median(step), mean(step), quantile(step, 1.0), "", touching_out);
}
#endif

struct Settings {
    bool is_quick = false;
    bool is_alone = false;
    std::size_t most = 1'000'000;
    Choice only{"", Choice::Match::whole};  ///< of the kinds
};

int run(Settings& settings) {
    const bool is_quick = settings.is_quick;
    std::printf("%s\n", describe_machine().c_str());
    std::printf("spheres of 1 m, 2 %% of the volume, 1/60 m a step; medians, ms\n");
    std::printf("%9s  %-14s %9s %9s %9s %9s %9s %9s %10s %9s %12s %8s\n", "bodies", "kind",
                "update", "pairs", "contacts", "step", "mean", "worst", "compared", "touching",
                "steps a body", "ns a body");
    bool is_sound = true;
    double least = 1e300, largest = 0.0;
    for (const std::size_t count :
         {std::size_t{1000}, std::size_t{10'000}, std::size_t{100'000}, std::size_t{1'000'000}}) {
        if (count > settings.most) break;
        const int steps = is_quick ? 5 : count > 200'000 ? 11 : 61;
        std::size_t touching = 0;
        for (const BroadphaseKind kind : {BroadphaseKind::grid, BroadphaseKind::sap}) {
            if (!settings.only.has(std::string(to_string(kind)))) continue;
            // Runs of minutes add no information.
            if (kind != BroadphaseKind::grid && count > 100'000) continue;
            const Costs costs = measure(kind, count, steps);
            std::printf(
                "%9zu  %-14s %9.3f %9.3f %9.3f %9.3f %9.3f %9.3f %10llu %9zu %12.3f %8.1f\n", count,
                std::string(to_string(kind)).c_str(), costs.update_ms, costs.pairs_ms,
                costs.narrow_ms, costs.step_ms, costs.mean_ms, costs.worst_ms,
                static_cast<unsigned long long>(costs.candidates), costs.touching,
                costs.operations_a_body, 1e6 * costs.update_ms / static_cast<double>(count));
            if (touching == 0) touching = costs.touching;
            if (kind == BroadphaseKind::grid) {
                least = std::min(least, costs.operations_a_body);
                largest = std::max(largest, costs.operations_a_body);
            }
            is_sound = is_sound && costs.touching == touching;
        }
#ifdef TERRANE_BENCH_BULLET
        if (!settings.is_alone && settings.only.is_all() && count <= 100'000) {
            std::size_t of_peer = 0;
            measure_peer(PeerBroadphase::tree, "Bullet dbvt", count, steps, of_peer);
            is_sound = is_sound && of_peer == touching;
            // its insertion alone takes over a minute for more
            if (count <= 10'000) {
                measure_peer(PeerBroadphase::axis_sweep, "Bullet sweep3", count, steps, of_peer);
                is_sound = is_sound && of_peer == touching;
            }
        }
#endif
        std::fflush(stdout);
    }
    if (!is_sound) std::printf("not all of them find the same touching pairs\n");
    if (largest > 1.02 * least) {
        std::printf("steps a body differ: %.3f to %.3f\n", least, largest);
        is_sound = false;
    }
    return is_sound ? 0 : 1;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    Arguments arguments(argc, argv,
                        "broadphase_benchmark [--quick] [--alone] [--most COUNT] [--only KIND]");
    Settings settings{.is_quick = arguments.has("--quick"), .is_alone = arguments.has("--alone")};
    if (settings.is_quick) settings.most = 10'000;
    settings.most = arguments.number("--most", 1.0, 1e8, settings.most);
    settings.only = {arguments.text("--only", ""), Choice::Match::whole};
    arguments.finish();
    const int code = run(settings);
    settings.only.finish(arguments);
    return code;
}
