// SPDX-License-Identifier: MIT
//
// Time of contact queries, beside Bullet and ODE where they are found: one thread, the same heights, the same poses in
// the same order. Every engine runs each query once before it is timed.
//
//   contact_benchmark [--quick] [--alone] [--only TEXT]
//
// --quick: one short round over small maps, as ctest runs it. --alone: without the peers. --only: the
// queries whose name contains this text.
//
// Exits with 1 if an engine's surface differs from the oracle's, or if Terrane misses a contact.
#include "benchmark/bench.h"
#include "benchmark/collision/contact_engine.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::bench {
namespace {

// Metres: surfaces match the oracle's to this, and deeper contacts must be reported. Rounding is below 1e-9 m on these
// maps, and a micrometre is irrelevant to simulations.
constexpr double kTolerance = 1e-6;

class TerraneEngine final : public ContactEngine {
public:
    explicit TerraneEngine(const Ground& ground) : ground_(ground) {}

    std::string name() const override { return "Terrane"; }
    Cut cut_of_rays() const override { return cut_as_terrane; }
    Cut cut_of_contacts() const override { return cut_as_terrane; }

    double height(double x, double y) override {
        const RayAnswer answer = ground_.ray({x, y, kRayTop}, {x, y, kRayBottom});
        return kRayTop + answer.fraction * (kRayBottom - kRayTop);
    }

    bool has_margin() const override { return true; }
    bool contacts(const Shape& shape, std::span<const Pose> poses, double margin,
                  std::span<int> counts_out) override {
        std::array<Contact, 16> contacts;
        for (std::size_t i = 0; i < poses.size(); ++i) {
            const ContactAnswer answer = find_contacts(shape, poses[i], ground_, margin, contacts);
            counts_out[i] = static_cast<int>(answer.count);
        }
        return true;
    }

    bool casts(const Shape& shape, std::span<const Sweep> sweeps,
               std::span<double> fractions_out) override {
        Motion motion;
        for (std::size_t i = 0; i < sweeps.size(); ++i) {
            motion.start = sweeps[i].start;
            motion.translation = sweeps[i].translation;
            const CastAnswer answer = cast(shape, motion, ground_);
            fractions_out[i] = answer.hit ? answer.fraction : kNoHit;
        }
        return true;
    }

private:
    Ground ground_;
};

/// An engine's result of a query.
struct Score {
    std::optional<double> ns;  ///< median over the rounds, a query; none: no such query
    std::size_t hits = 0;      ///< queries with a contact or a hit
    std::size_t missed = 0;    ///< contacts of the oracle that it does not report
};

/// A query, and a score of each engine in the order of the columns.
struct Row {
    std::string question;
    std::size_t queries = 0;
    std::size_t touching = 0;        ///< of the queries, by the oracle of Terrane's surface
    std::vector<Score> scores = {};  ///< Terrane's first
};

/// Extent of a comparison.
struct ComparisonSettings {
    bool is_quick = false;   ///< one round, cold
    bool is_alone = false;   ///< without the peers
    Choice* only = nullptr;  ///< of queries; not null
};

/// Median over up to nine rounds after a warm-up, nanoseconds a query of the calling thread's time. Rounds of seconds,
/// and quick runs, are timed in the first round. None where the round has no result.
std::optional<double> measure_ns(std::size_t queries, bool is_quick,
                                 const std::function<bool()>& round) {
    std::vector<double> ms;
    bool has_result = true;
    tools::take_turns(1, {.seconds = is_quick ? 0.0 : 2.0, .most_turns = 10},
                      [&](std::size_t, std::size_t) {
                          const Stopwatch watch(Clock::thread);
                          has_result = round();
                          ms.push_back(watch.ms());
                          return has_result && ms.back() < 2000.0;
                      });
    if (!has_result) return std::nullopt;
    if (ms.size() > 1) ms.erase(ms.begin());
    return 1e6 * median(ms) / static_cast<double>(queries);
}

/// Runs queries about one map on all engines, and checks the results by an oracle. The map must outlive it.
class ContactComparison {
public:
    ContactComparison(const ContactMap& map, const ComparisonSettings& settings)
        : map_(map), settings_(settings) {
        engines_.push_back(std::make_unique<TerraneEngine>(map.ground));
#ifdef TERRANE_BENCH_BULLET
        if (!settings.is_alone) engines_.push_back(make_bullet_engine(map.table));
#endif
#ifdef TERRANE_BENCH_ODE
        if (!settings.is_alone) engines_.push_back(make_ode_engine(map.table));
#endif
    }

    /// Whether vertical rays hit the surface of every engine where the oracle has it; prints the errors.
    bool check_surfaces() const {
        bool is_same = true;
        for (const auto& engine : engines_) {
            const ContactOracle oracle(map_.table, engine->cut_of_rays());
            test::Random random(11);
            double most = 0.0;
            for (int i = 0; i < 2000; ++i) {
                const double border = map_.table.spacing;
                const double x = random.between(border, map_.width() - border);
                const double y = random.between(border, map_.width() - border);
                most = std::max(most, std::abs(engine->height(x, y) - oracle.height(x, y)));
            }
            std::printf("  surface of %s: within %.1e m\n", engine->name().c_str(), most);
            is_same = is_same && most <= kTolerance;
        }
        return is_same;
    }

    /// Each runs a query on every engine and adds a row of scores. Skipped where the settings exclude it.
    void contacts(const char* question, const Shape& shape, const std::vector<Pose>& poses) {
        ask<int>(
            question, poses.size(),
            [&](ContactEngine& engine, std::span<int> counts_out) {
                return engine.contacts(shape, poses, 0.0, counts_out);
            },
            has_contact,
            [&](const ContactEngine& engine, std::size_t i) {
                const ContactOracle oracle(map_.table, engine.cut_of_contacts());
                return oracle.deepest(shape, poses[i]) > kTolerance;
            });
    }

    /// Contacts of bodies that rest or land. Every engine has its poses on its own surface, at the same places with the
    /// same gaps. Missed: overlapping, or with a gap within the margin of an engine that has one, but no contact.
    void shallow_contacts(const char* question, const Shape& shape, std::size_t count,
                          std::uint64_t seed) {
        if (!settings_.only->has(question)) return;
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
            question, count,
            [&](ContactEngine& engine, std::span<int> counts_out) {
                const ShallowPoses& shallow = poses_on(engine.cut_of_contacts());
                return engine.contacts(shape, shallow.poses, shallow.margin, counts_out);
            },
            has_contact,
            [&](const ContactEngine& engine, std::size_t i) {
                const ShallowPoses& shallow = poses_on(engine.cut_of_contacts());
                if (engine.has_margin())
                    return shallow.vertical_gaps[i] < shallow.margin - kTolerance;
                const ContactOracle oracle(map_.table, engine.cut_of_contacts());
                return oracle.deepest(shape, shallow.poses[i]) > kTolerance;
            });
    }

    /// Missed: in the ground at one of eight times of the sweep, but no hit.
    void casts(const char* question, const Shape& shape, const std::vector<Sweep>& sweeps) {
        ask<double>(
            question, sweeps.size(),
            [&](ContactEngine& engine, std::span<double> fractions_out) {
                return engine.casts(shape, sweeps, fractions_out);
            },
            [](double fraction) { return fraction <= 1.0; },
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

    /// Prints the rows; whether Terrane missed nothing.
    bool print() const {
        if (rows_.empty()) return true;
        std::printf("\n%-44s %8s %9s", "median of a query; hits, missed", "queries", "touching");
        for (const auto& engine : engines_)
            std::printf(" | %-36s", (engine->name() + ", times as slow").c_str());
        std::printf("\n");
        bool is_sound = true;
        for (const Row& row : rows_) {
            std::printf("%-44s %8zu %9zu", row.question.c_str(), row.queries, row.touching);
            for (const Score& score : row.scores) {
                if (!score.ns) {
                    std::printf(" | %-36s", "-");
                    continue;
                }
                std::printf(" | %9.3f us %6.2fx %7zu %8zu", 1e-3 * *score.ns,
                            *score.ns / *row.scores[0].ns, score.hits, score.missed);
            }
            std::printf("\n");
            is_sound = is_sound && row.scores.front().missed == 0;
        }
        return is_sound;
    }

private:
    static bool has_contact(int count) { return count > 0; }

    template <class Answer>
    void ask(const char* question, std::size_t queries,
             const std::function<bool(ContactEngine&, std::span<Answer>)>& answer,
             const std::function<bool(Answer)>& is_found,
             const std::function<bool(const ContactEngine&, std::size_t)>& is_there) {
        if (!settings_.only->has(question)) return;
        std::fprintf(stderr, "  %s\n", question);
        Row row{.question = question, .queries = queries};
        std::vector<Answer> answers(queries);
        for (const auto& engine : engines_) {
            Score score;
            score.ns =
                measure_ns(queries, settings_.is_quick, [&] { return answer(*engine, answers); });
            for (std::size_t i = 0; i < queries && score.ns; ++i) {
                if (is_found(answers[i])) ++score.hits;
                if (!is_there(*engine, i)) continue;
                if (!is_found(answers[i])) ++score.missed;
                if (engine == engines_.front()) ++row.touching;
            }
            row.scores.push_back(score);
        }
        rows_.push_back(row);
    }

    const ContactMap& map_;
    ComparisonSettings settings_;
    std::vector<std::unique_ptr<ContactEngine>> engines_;  ///< Terrane's first
    std::vector<Row> rows_;
};

bool run(const ComparisonSettings& settings) {
    const bool is_quick = settings.is_quick;
    const std::size_t many = is_quick ? 200 : 10000;
    const std::size_t some = is_quick ? 20 : 1000;
    const std::size_t few = is_quick ? 2 : 40;
    const Sphere sphere{0.5};
    const Capsule capsule{0.4, 0.8};
    const Box box{{1.0, 2.0, 0.5}};

    std::printf("%s\n", describe_machine().c_str());
    const ContactMap map = make_contact_map(is_quick ? 513 : 1025, 1.0);
    std::printf("contact map, %d x %d samples at 1 m\n", map.table.columns, map.table.rows);
    ContactComparison at_1m(map, settings);
    bool is_sound = at_1m.check_surfaces();
    // heights above ground at which half of them touch
    at_1m.contacts("contacts of the sphere", sphere, make_poses(map, many, 1.09, 5.0, 3));
    at_1m.contacts("contacts of the capsule", capsule, make_poses(map, many, 1.71, 5.0, 4));
    at_1m.contacts("contacts of the box", box, make_poses(map, many, 3.74, 5.0, 5));
    at_1m.shallow_contacts("shallow contacts of the sphere", sphere, many, 12);
    at_1m.shallow_contacts("shallow contacts of the capsule", capsule, many, 14);
    at_1m.shallow_contacts("shallow contacts of the box", box, many, 16);
    at_1m.casts("cast of the capsule, 5 m", capsule,
                make_sweeps(map, many, capsule, 5.0, 3.0, false, 6));
    at_1m.casts("cast of the box, 5 m", box, make_sweeps(map, many, box, 5.0, 3.0, false, 7));
    at_1m.casts("cast of the box, 200 m", box, make_sweeps(map, some, box, 200.0, 60.0, true, 8));
    is_sound = at_1m.print() && is_sound;

    // the same box, 2 x 4 x 1 m, over 10^5 cells
    constexpr const char* kTurned = "contacts of a car on 1 cm ground, turned";
    constexpr const char* kStanding = "contacts of a car on 1 cm ground, standing";
    const bool has_turned = settings.only->has(kTurned);
    if (!settings.only->has(kStanding) && !has_turned) return is_sound;
    const ContactMap fine_map = make_contact_map(is_quick ? 1025 : 2049, 0.01);
    std::printf("contact map, %d x %d samples at 1 cm\n", fine_map.table.columns,
                fine_map.table.rows);
    ContactComparison at_1cm(fine_map, settings);
    is_sound = at_1cm.check_surfaces() && is_sound;
    at_1cm.contacts(kTurned, box, make_poses(fine_map, few, 3.5, 2.5, 9));
    at_1cm.contacts(kStanding, box, make_standing_poses(fine_map, few, box, 10));
    return at_1cm.print() && is_sound;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    Arguments arguments(argc, argv, "contact_benchmark [--quick] [--alone] [--only TEXT]");
    Choice only(arguments.text("--only", ""), Choice::Match::part);
    const ComparisonSettings settings{
        .is_quick = arguments.has("--quick"), .is_alone = arguments.has("--alone"), .only = &only};
    arguments.finish();
    const bool is_sound = run(settings);
    only.finish(arguments);
    return is_sound ? 0 : 1;
}
