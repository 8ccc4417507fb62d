// SPDX-License-Identifier: MIT
//
// Sources: I. Rechenberg. Evolutionsstrategie. 1973 (a random walk that keeps improvements; its step grows with
//          each, and shrinks without).
#include "sampled_depth.h"

#include "brute_lift.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace terrane::test {
namespace {

struct Translation {
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
    double size = 0.0;
};

}  // namespace

double sampled_depth(const Soup& soup, const OracleShape& shape, const Pose& pose, double known,
                     const SampledDepthSettings& settings, Random& random,
                     Eigen::Vector3d* best_out) {
    constexpr double kSeparatedLift = 1e-10;  // lifts up to this count as separated
    // The shortest separating translation with a sideways offset, if it is shorter than `less_than`.
    const auto measure = [&](double x, double y, double less_than, Translation& out) {
        const double square = less_than * less_than - x * x - y * y;
        if (!(square > 0.0)) return false;
        const Eigen::Vector3d offset(x, y, 0.0);
        if (is_deeper<double>(soup, shape, pose, offset, std::sqrt(square))) return false;
        const double lift = brute_lift<double>(soup, shape, pose, offset, 0.0);
        out.d = {x, y, std::max(0.0, lift - kSeparatedLift)};
        out.size = out.d.norm();
        return out.size < less_than;
    };
    Translation best;
    best.size = known;
    const auto improve = [&](const Translation& found) {
        if (!(found.size < best.size)) return;
        best = found;
        if (best_out != nullptr) *best_out = found.d;
    };

    // Offsets whose translations are up to 1.2 times the known length are candidates for refinement.
    std::vector<Translation> starts;
    for (int i = 0; i < settings.samples; ++i) {
        const double angle = random.between(0.0, 6.283185307179586);
        const double r = known * std::sqrt(random.between(0.0, 1.0));
        Translation found;
        if (!measure(r * std::cos(angle), r * std::sin(angle), 1.2 * known, found)) continue;
        improve(found);
        starts.push_back(found);
    }
    std::sort(starts.begin(), starts.end(),
              [](const Translation& a, const Translation& b) { return a.size < b.size; });
    if (starts.size() > static_cast<std::size_t>(settings.starts)) {
        starts.resize(static_cast<std::size_t>(settings.starts));
    }
    for (Translation at : starts) {
        double step = 0.05 * known;
        for (int i = 0; i < settings.refinements && step > 1e-10 * known; ++i) {
            const double angle = random.between(0.0, 6.283185307179586);
            const double size = step * random.between(0.1, 1.0);
            Translation found;
            if (measure(at.d.x() + size * std::cos(angle), at.d.y() + size * std::sin(angle),
                        at.size, found)) {
                at = found;
                step *= 2.0;
            } else {
                step *= 0.84;
            }
        }
        improve(at);
    }
    return best.size;
}

}  // namespace terrane::test
