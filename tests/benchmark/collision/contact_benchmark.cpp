// SPDX-License-Identifier: MIT
#include "benchmark/collision/contact_workload.h"
#include "benchmark/machine.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::bench {

/// An engine's result of a query.
struct Score {
    std::optional<double> ns;  ///< median over the rounds, a query; none: no such query
    std::size_t hits = 0;      ///< queries with a contact or a hit
    std::size_t missed = 0;    ///< contacts of the oracle that it does not report
};

/// A query, Terrane's targets, and a score of each engine in the order of the columns.
struct Row {
    std::string question;
    double target_ns = 0.0;             ///< 0: none
    std::vector<double> wanted_ratios;  ///< target speed relative to each peer; 0: none
    std::size_t queries = 0;
    bool has_oracle = false;
    std::size_t touching = 0;        ///< of the queries, by the oracle of Terrane's surface
    std::vector<Score> scores = {};  ///< Terrane's first
};

/// Prints one table of times and one of what was found. `engines` names the columns.
void print_table(const std::vector<std::string>& engines, const std::vector<Row>& rows);

/// Extent of a comparison.
struct ComparisonSettings {
    bool is_quick = false;  ///< one round, cold
    bool is_alone = false;  ///< without the peers
    std::string_view only;  ///< queries whose name contains this
    bool wants(std::string_view question) const {
        return question.find(only) != std::string_view::npos;
    }
};

/// Median over up to nine rounds after a warm-up, nanoseconds a query of the calling thread's time. Rounds of seconds,
/// and quick runs, are timed in the first round. None where the round has no result.
std::optional<double> measure_ns(std::size_t queries, bool is_quick,
                                 const std::function<bool()>& round);

/// Runs queries about one map on all engines, and checks the results by an oracle. The map must outlive it.
class ContactComparison {
public:
    ContactComparison(const ContactMap& map, const ComparisonSettings& settings);

    /// Whether vertical rays hit the surface of every engine where the oracle has it; prints the errors.
    bool check_surfaces() const;

    /// Each runs a query on every engine and adds a row of scores. Skipped where the settings exclude it.
    void heights(Row row, const std::vector<Ray>& places);
    void rays(Row row, const std::vector<Ray>& rays);
    void contacts(Row row, const Shape& shape, const std::vector<Pose>& poses);
    /// Contacts of bodies that rest or land. Every engine has its poses on its own surface, at the same places with the
    /// same gaps. Missed: overlapping, or with a gap within the margin of an engine that has one, but no contact.
    void shallow_contacts(Row row, const Shape& shape, std::size_t count, std::uint64_t seed);
    /// Missed: in the ground at one of eight times of the sweep, but no hit.
    void casts(Row row, const Shape& shape, const std::vector<Sweep>& sweeps);

    const std::vector<Row>& rows() const { return rows_; }
    std::vector<std::string> names() const;

private:
    template <class Answer>
    void ask(Row& row, std::size_t queries,
             const std::function<bool(ContactEngine&, std::span<Answer>)>& answer,
             const std::function<bool(Answer)>& is_found,
             const std::function<bool(const ContactEngine&, std::size_t)>& is_there = {});

    const ContactMap& map_;
    ComparisonSettings settings_;
    std::vector<std::unique_ptr<ContactEngine>> engines_;  ///< Terrane's first
    std::vector<Row> rows_;
};

namespace {

std::string format(const char* pattern, double value) {
    char text[64];
    std::snprintf(text, sizeof text, pattern, value);
    return text;
}

std::string as_time(double ns) {
    if (ns < 1e3) return format("%.3g ns", ns);
    if (ns < 1e6) return format("%.3g us", 1e-3 * ns);
    return format("%.4g ms", 1e-6 * ns);
}

// "44 us, 5.2x (>= 5: met)": a peer's time, and the speed of Terrane relative to it.
std::string as_peer(const Score& ours, const Score& peer, double wanted) {
    if (!peer.ns) return "-";
    const double ratio = *peer.ns / *ours.ns;
    std::string text = as_time(*peer.ns) + ", " + format("%.3g", ratio) + "x";
    if (wanted > 0.0) {
        text += format(" (>= %g: ", wanted) +
                (ratio >= wanted ? "met)" : "missed by " + format("%.3g", wanted / ratio) + "x)");
    }
    return text;
}

}  // namespace

void print_table(const std::vector<std::string>& engines, const std::vector<Row>& rows) {
    std::printf("\n%-44s %10s %8s %-15s", "median of a query", engines[0].c_str(), "target", "");
    for (std::size_t peer = 1; peer < engines.size(); ++peer) {
        std::printf(" | %-38s", (engines[peer] + ", times as slow").c_str());
    }
    std::printf("\n");
    for (const Row& row : rows) {
        const double ours = *row.scores[0].ns;
        std::string verdict;
        if (row.target_ns > 0.0) {
            verdict = ours <= row.target_ns
                          ? "met"
                          : "missed by " + format("%.3g", ours / row.target_ns) + "x";
        }
        std::printf("%-44s %10s %8s %-15s", row.question.c_str(), as_time(ours).c_str(),
                    row.target_ns > 0.0 ? as_time(row.target_ns).c_str() : "", verdict.c_str());
        for (std::size_t peer = 1; peer < engines.size(); ++peer) {
            std::printf(
                " | %-38s",
                as_peer(row.scores[0], row.scores[peer], row.wanted_ratios[peer - 1]).c_str());
        }
        std::printf("\n");
    }

    std::printf("\n%-44s %8s %10s", "found, missed", "queries", "touching");
    for (const std::string& engine : engines) std::printf(" %20s", engine.c_str());
    std::printf("\n");
    for (const Row& row : rows) {
        std::printf("%-44s %8zu %10s", row.question.c_str(), row.queries,
                    row.has_oracle ? std::to_string(row.touching).c_str() : "");
        for (const Score& score : row.scores) {
            std::string text = "-";
            if (score.ns) {
                text = std::to_string(score.hits);
                if (row.has_oracle) text += ", " + std::to_string(score.missed);
            }
            std::printf(" %20s", text.c_str());
        }
        std::printf("\n");
    }
}

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

// Time of contact queries, beside Bullet and ODE where they are found: one thread, the same heights, the same poses in
// the same order. Every engine runs each query once before it is timed.
//
//   contact_benchmark [--quick] [--alone] [--only TEXT]
//
// --quick: one short round over small maps, as ctest runs it. --alone: without the peers. --only: the
// queries whose name contains this text.
//
// Exits with 1 if an engine's surface differs from the oracle's, or if Terrane misses a contact.

namespace {

// Time of a height read from an array: the machine's share.
double time_plain_lookup_ns(const ContactMap& map, const std::vector<Ray>& places) {
    const ContactOracle oracle(map.table, cut_as_terrane);
    std::vector<double> heights(places.size());
    const auto round = [&] {
        for (std::size_t i = 0; i < places.size(); ++i) {
            heights[i] = oracle.height(places[i].from.x(), places[i].from.y());
        }
        return true;
    };
    return measure_ns(places.size(), false, round).value();
}

int run(const ComparisonSettings& settings) {
    const bool is_quick = settings.is_quick;
    const std::size_t many = is_quick ? 200 : 10000;
    const std::size_t some = is_quick ? 20 : 1000;
    const std::size_t few = is_quick ? 2 : 40;
    const Sphere sphere{0.5};
    const Capsule capsule{0.4, 0.8};
    const Box box{{1.0, 2.0, 0.5}};
    // speed relative to Bullet, to ODE
    const std::vector<double> any{0.0, 0.0}, of_ray{10.0, 0.0}, of_contact{5.0, 1.0};
    const std::vector<double> of_step{0.0, 1.0};
    const std::vector<double> of_cast{20.0, 0.0};

    std::printf("%s\n", describe_machine().c_str());
#ifndef TERRANE_BENCH_BULLET
    std::printf("Bullet was not found when this was built: its column is left out\n");
#endif
#ifndef TERRANE_BENCH_ODE
    std::printf("ODE was not found when this was built: its column is left out\n");
#endif

    const ContactMap map = make_contact_map(is_quick ? 513 : 1025, 1.0);
    std::printf("contact map, %d x %d samples at 1 m\n", map.table.columns, map.table.rows);
    ContactComparison at_1m(map, settings);
    bool is_sound = at_1m.check_surfaces();
    const std::vector<Ray> vertical = make_vertical_rays(map, many, 1);
    std::printf("  a plain lookup in an array: %.1f ns\n", time_plain_lookup_ns(map, vertical));

    at_1m.heights({"height", 15.0, any}, vertical);
    at_1m.rays({"ray, vertical", 0.0, any}, vertical);
    at_1m.rays({"ray, 500 m, grazing", 280.0, of_ray}, make_grazing_rays(map, many, 500.0, 2));
    // heights above ground at which half of them touch
    at_1m.contacts({"contacts of the sphere", 100.0, of_contact}, sphere,
                   make_poses(map, many, 1.09, 5.0, 3));
    at_1m.contacts({"contacts of the capsule", 300.0, of_contact}, capsule,
                   make_poses(map, many, 1.71, 5.0, 4));
    at_1m.contacts({"contacts of the box", 900.0, of_contact}, box,
                   make_poses(map, many, 3.74, 5.0, 5));
    at_1m.shallow_contacts({"shallow contacts of the sphere", 0.0, of_step}, sphere, many, 12);
    at_1m.shallow_contacts({"shallow contacts of the capsule", 0.0, of_step}, capsule, many, 14);
    at_1m.shallow_contacts({"shallow contacts of the box", 0.0, of_step}, box, many, 16);
    at_1m.casts({"cast of the capsule, 5 m", 800.0, of_cast}, capsule,
                make_sweeps(map, many, capsule, 5.0, 3.0, false, 6));
    at_1m.casts({"cast of the box, 5 m", 1500.0, of_cast}, box,
                make_sweeps(map, many, box, 5.0, 3.0, false, 7));
    at_1m.casts({"cast of the box, 200 m", 4000.0, of_cast}, box,
                make_sweeps(map, some, box, 200.0, 60.0, true, 8));
    std::vector<Row> rows = at_1m.rows();

    // the same box, 2 x 4 x 1 m, over 10^5 cells
    constexpr const char* kTurned = "contacts of a car on 1 cm ground, turned";
    constexpr const char* kStanding = "contacts of a car on 1 cm ground, standing";
    if (settings.wants(kTurned) || settings.wants(kStanding)) {
        const ContactMap fine_map = make_contact_map(is_quick ? 1025 : 2049, 0.01);
        std::printf("contact map, %d x %d samples at 1 cm\n", fine_map.table.columns,
                    fine_map.table.rows);
        ContactComparison at_1cm(fine_map, settings);
        is_sound = at_1cm.check_surfaces() && is_sound;
        at_1cm.contacts({kTurned, 50e3, any}, box, make_poses(fine_map, few, 3.5, 2.5, 9));
        at_1cm.contacts({kStanding, 50e3, any}, box, make_standing_poses(fine_map, few, box, 10));
        rows.insert(rows.end(), at_1cm.rows().begin(), at_1cm.rows().end());
    }

    if (!rows.empty()) print_table(at_1m.names(), rows);
    for (const Row& row : rows) is_sound = is_sound && row.scores.front().missed == 0;
    return is_sound ? 0 : 1;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    terrane::bench::ComparisonSettings settings;
    for (int i = 1; i < argc; ++i) {
        const std::string_view flag = argv[i];
        if (flag == "--quick") {
            settings.is_quick = true;
        } else if (flag == "--alone") {
            settings.is_alone = true;
        } else if (flag == "--only" && i + 1 < argc) {
            settings.only = argv[++i];
        } else {
            std::fprintf(stderr, "contact_benchmark: %s is not understood\n", argv[i]);
            return 2;
        }
    }
    return terrane::bench::run(settings);
}
