// SPDX-License-Identifier: MIT
#include "contact_comparison.h"

#include "benchmark/machine.h"
#include "contact_oracle.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace terrane::bench {
namespace {

// Metres: surfaces match the oracle's to this, and deeper contacts must be reported. Rounding is below 1e-9 m on these
// maps, and a micrometre is irrelevant to simulations.
constexpr double kTolerance = 1e-6;

bool is_hit(double fraction) { return fraction <= 1.0; }

}  // namespace

std::optional<double> measure_ns(std::size_t queries, bool is_quick,
                                 const std::function<bool()>& round) {
    constexpr std::size_t kRounds = 9;
    constexpr double kLong_ms = 2000.0;
    const Stopwatch first(Clock::thread);
    if (!round()) return std::nullopt;
    double spent = first.ms();
    std::vector<double> ms;
    if (is_quick || spent > kLong_ms) ms.push_back(spent);
    while (!is_quick && spent < kLong_ms && ms.size() < kRounds) {
        const Stopwatch watch(Clock::thread);
        round();
        ms.push_back(watch.ms());
        spent += ms.back();
    }
    std::sort(ms.begin(), ms.end());
    return 1e6 * ms[ms.size() / 2] / static_cast<double>(queries);
}

ContactComparison::ContactComparison(const ContactMap& map, const ComparisonSettings& settings)
    : map_(map), settings_(settings) {
    engines_.push_back(make_terrane_engine(map.ground));
#ifdef TERRANE_BENCH_BULLET
    if (!settings.is_alone) engines_.push_back(make_bullet_engine(map.table));
#endif
#ifdef TERRANE_BENCH_ODE
    if (!settings.is_alone) engines_.push_back(make_ode_engine(map.table));
#endif
}

bool ContactComparison::check_surfaces() const {
    const std::vector<Ray> rays = make_vertical_rays(map_, 2000, 11);
    std::vector<double> fractions(rays.size());
    bool is_same = true;
    for (const auto& engine : engines_) {
        const ContactOracle oracle(map_.table, engine->cut_of_rays());
        engine->rays(rays, fractions);
        double most = 0.0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const WorldPos& from = rays[i].from;
            const double z = from.z() + fractions[i] * (rays[i].to.z() - from.z());
            most = std::max(most, std::abs(z - oracle.height(from.x(), from.y())));
        }
        std::printf("  surface of %s: within %.1e m\n", engine->name().c_str(), most);
        is_same = is_same && most <= kTolerance;
    }
    return is_same;
}

void ContactComparison::heights(Row row, const std::vector<Ray>& places) {
    ask<double>(
        row, places.size(),
        [&](ContactEngine& engine, std::span<double> heights_out) {
            return engine.heights(places, heights_out);
        },
        [](double) { return true; });
}

void ContactComparison::rays(Row row, const std::vector<Ray>& rays) {
    ask<double>(
        row, rays.size(),
        [&](ContactEngine& engine, std::span<double> fractions_out) {
            return engine.rays(rays, fractions_out);
        },
        is_hit);
}

void ContactComparison::contacts(Row row, const Shape& shape, const std::vector<Pose>& poses) {
    ask<int>(
        row, poses.size(),
        [&](ContactEngine& engine, std::span<int> counts_out) {
            return engine.contacts(shape, poses, 0.0, counts_out);
        },
        [](int count) { return count > 0; },
        [&](const ContactEngine& engine, std::size_t i) {
            const ContactOracle oracle(map_.table, engine.cut_of_contacts());
            return oracle.deepest(shape, poses[i]) > kTolerance;
        });
}

void ContactComparison::shallow_contacts(Row row, const Shape& shape, std::size_t count,
                                         std::uint64_t seed) {
    if (!settings_.wants(row.question)) return;
    std::vector<std::pair<Cut, ShallowPoses>> of_surfaces;
    const auto poses_on = [&](Cut cut) -> const ShallowPoses& {
        for (const auto& [known, poses] : of_surfaces) {
            if (known == cut) return poses;
        }
        of_surfaces.emplace_back(cut, make_shallow_poses(map_, cut, shape, count, seed));
        return of_surfaces.back().second;
    };
    for (const auto& engine : engines_) poses_on(engine->cut_of_contacts());
    ask<int>(
        row, count,
        [&](ContactEngine& engine, std::span<int> counts_out) {
            const ShallowPoses& shallow = poses_on(engine.cut_of_contacts());
            return engine.contacts(shape, shallow.poses, shallow.margin, counts_out);
        },
        [](int contact_count) { return contact_count > 0; },
        [&](const ContactEngine& engine, std::size_t i) {
            const ShallowPoses& shallow = poses_on(engine.cut_of_contacts());
            if (engine.has_margin()) return shallow.vertical_gaps[i] < shallow.margin - kTolerance;
            const ContactOracle oracle(map_.table, engine.cut_of_contacts());
            return oracle.deepest(shape, shallow.poses[i]) > kTolerance;
        });
}

void ContactComparison::casts(Row row, const Shape& shape, const std::vector<Sweep>& sweeps) {
    ask<double>(
        row, sweeps.size(),
        [&](ContactEngine& engine, std::span<double> fractions_out) {
            return engine.casts(shape, sweeps, fractions_out);
        },
        is_hit,
        [&](const ContactEngine& engine, std::size_t i) {
            constexpr int kPlaces = 8;
            const ContactOracle oracle(map_.table, engine.cut_of_contacts());
            Pose pose = sweeps[i].start;
            for (int place = 0; place < kPlaces; ++place) {
                pose.translation += sweeps[i].translation / kPlaces;
                const WorldPos& centre = pose.translation;
                if (oracle.height(centre.x(), centre.y()) > centre.z()) return true;
                if (oracle.deepest(shape, pose) > kTolerance) return true;
            }
            return false;
        });
}

std::vector<std::string> ContactComparison::names() const {
    std::vector<std::string> names;
    for (const auto& engine : engines_) names.push_back(engine->name());
    return names;
}

template <class Answer>
void ContactComparison::ask(
    Row& row, std::size_t queries,
    const std::function<bool(ContactEngine&, std::span<Answer>)>& answer,
    const std::function<bool(Answer)>& is_found,
    const std::function<bool(const ContactEngine&, std::size_t)>& is_there) {
    if (!settings_.wants(row.question)) return;
    std::fprintf(stderr, "  %s\n", row.question.c_str());
    row.queries = queries;
    row.has_oracle = static_cast<bool>(is_there);
    std::vector<Answer> answers(queries);
    for (const auto& engine : engines_) {
        Score score;
        score.ns =
            measure_ns(queries, settings_.is_quick, [&] { return answer(*engine, answers); });
        for (std::size_t i = 0; i < queries && score.ns; ++i) {
            if (is_found(answers[i])) ++score.hits;
            if (!row.has_oracle || !is_there(*engine, i)) continue;
            if (!is_found(answers[i])) ++score.missed;
            if (engine == engines_.front()) ++row.touching;
        }
        row.scores.push_back(score);
    }
    rows_.push_back(row);
}

}  // namespace terrane::bench
