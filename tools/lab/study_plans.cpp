// SPDX-License-Identifier: MIT
//
// Sources:
//   S. Ehmann, M. Lin. Accurate and fast proximity queries between polyhedra using convex surface
//   decomposition. Eurographics 2001 (SWIFT++, which the published study measured).
#include "lab/study_plans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <utility>

namespace terrane::tools {
namespace {

// A published query time, ms, and its parameter.
struct Published {
    double x;
    double ms;
};

constexpr Published kOfCount[] = {{1, 0.167},  {5, 0.734},  {10, 1.611}, {15, 2.131},
                                  {20, 3.234}, {25, 3.894}, {30, 5.01},  {35, 5.783},
                                  {40, 6.812}, {45, 7.558}, {50, 8.915}};
constexpr Published kOfDetail[] = {{2, 2.932},  {5, 3.699},  {10, 4.375}, {15, 5.002},
                                   {20, 5.067}, {25, 5.475}, {35, 7.121}};
constexpr Published kOfRadius[] = {{0.5, 3.012}, {1, 3.164}, {2, 3.19}, {3, 3.215}, {5, 3.324}};
constexpr double kLargerRadii[] = {8, 12, 16, 20, 24, 28, 32};
constexpr std::size_t kConclusionCounts[] = {1000, 100'000, 1'000'000};
constexpr double kMore[] = {100, 300, 1000, 3000, 10'000, 30'000, 100'000, 300'000, 1'000'000};

constexpr CrowdScheme kLibrary[] = {CrowdScheme::sap, CrowdScheme::grid, CrowdScheme::two_scene,
                                    CrowdScheme::hashed};
constexpr CrowdScheme kAll[] = {CrowdScheme::sap,    CrowdScheme::grid,  CrowdScheme::two_scene,
                                CrowdScheme::hashed, CrowdScheme::dense, CrowdScheme::brute};
constexpr CrowdScheme kWithDense[] = {CrowdScheme::sap, CrowdScheme::grid, CrowdScheme::two_scene,
                                      CrowdScheme::hashed, CrowdScheme::dense};

StudyPlan make_plan(std::string key, std::string title, std::string x_name, std::string text) {
    StudyPlan plan;
    plan.table.key = std::move(key);
    plan.table.title = std::move(title);
    plan.table.x_name = std::move(x_name);
    plan.table.text = std::move(text);
    return plan;
}

void add_schemes(StudyPlan& plan, std::span<const CrowdScheme> schemes) {
    for (const CrowdScheme scheme : schemes) {
        plan.table.series.emplace_back(to_string(scheme));
        plan.series.push_back({.scheme = scheme});
    }
}

void add_point(StudyPlan& plan, double x, std::optional<double> published_ms,
               const CrowdLayout& layout) {
    StudyPoint point;
    point.x = x;
    point.published_query_ms = published_ms;
    plan.table.points.push_back(std::move(point));
    plan.layouts.push_back(layout);
}

CrowdLayout published_layout(const StudySettings& settings) {
    CrowdLayout layout;
    layout.count = kPublishedCount;
    layout.room = kPublishedRoom;
    layout.seed = settings.seed;
    return layout;
}

StudyPlan plan_of_count(const StudySettings& settings) {
    StudyPlan plan = make_plan(
        "count", "Bodies in the published room", "bodies",
        "A cube of 80 m with walls that bodies bounce from; radius 1 m, detail uniform with mean "
        "3 and deviation 1. Boxes are part of an update. Two scenes compute exact boxes for pairs "
        "of overlapping cubes only.");
    add_schemes(plan, kWithDense);
    CrowdLayout layout = published_layout(settings);
    for (const Published& each : kOfCount) {
        layout.count = static_cast<std::size_t>(each.x);
        add_point(plan, each.x, each.ms, layout);
    }
    plan.table.points.front().published_update_ms = kFirstUpdateMs;
    plan.table.points.back().published_update_ms = kLastUpdateMs;
    return plan;
}

StudyPlan plan_of_many(const StudySettings& settings) {
    StudyPlan plan = make_plan("many", "Many bodies", "bodies",
                               "The room grows with the bodies, whose spheres always take 2 % of "
                               "it: each has the same few neighbours.");
    add_schemes(plan, kAll);
    CrowdLayout layout = published_layout(settings);
    layout.room = 0.0;
    for (const double more : kMore) {
        if (more > static_cast<double>(settings.most_bodies)) break;
        layout.count = static_cast<std::size_t>(more);
        add_point(plan, more, std::nullopt, layout);
    }
    return plan;
}

StudyPlan plan_of_detail(const StudySettings& settings) {
    StudyPlan plan = make_plan(
        "detail", "Detail of 20 bodies", "rings of corners",
        "A body of detail d has d rings of 2 d corners, and deviation 1 in d, at least 2 rings. "
        "Convex and dented bodies move in the published room of 80 m, where they seldom meet; "
        "crowded ones fill a fifth of a room of their own, so that many pairs reach the corners. "
        "Dented bodies are closed meshes that are not convex: 2 d convex segments, every second "
        "one of 0.7 of the radius.");
    constexpr double kCrowded = 0.2;
    plan.table.series = {"convex", "dented", "convex, crowded", "dented, crowded"};
    plan.series = {{.scheme = CrowdScheme::sap},
                   {.scheme = CrowdScheme::sap, .is_dented = true},
                   {.scheme = CrowdScheme::sap, .own_room_share = kCrowded},
                   {.scheme = CrowdScheme::sap, .is_dented = true, .own_room_share = kCrowded}};
    CrowdLayout layout = published_layout(settings);
    for (const Published& each : kOfDetail) {
        layout.detail = each.x;
        add_point(plan, each.x, each.ms, layout);
    }
    return plan;
}

StudyPlan plan_of_radius(const StudySettings& settings) {
    StudyPlan plan =
        make_plan("radius", "Radius of 20 bodies in one room", "metres",
                  "The room stays 80 m wide while the bodies grow until they fill it and most of "
                  "them overlap.");
    add_schemes(plan, kLibrary);
    CrowdLayout layout = published_layout(settings);
    for (const Published& each : kOfRadius) {
        layout.radius = each.x;
        add_point(plan, each.x, each.ms, layout);
    }
    for (const double larger : kLargerRadii) {
        layout.radius = larger;
        add_point(plan, larger, std::nullopt, layout);
    }
    return plan;
}

StudyPlan plan_of_equal(const StudySettings& settings) {
    StudyPlan plan =
        make_plan("equal", "Bodies of equal size in the published room", "bodies",
                  "All bodies have the same mesh. Published for 20 bodies: 3.164 ms a query with "
                  "0.099 ms an update by sweep-and-prune, 0.527 ms with 65 ms an update by a dense "
                  "grid of 40^3 cells, each of which had to be cleared.");
    add_schemes(plan, kWithDense);
    CrowdLayout layout = published_layout(settings);
    layout.detail_deviation = 0.0;
    for (const double bodies : {1.0, 20.0, 100.0, 1000.0}) {
        if (bodies > static_cast<double>(settings.most_bodies)) break;
        layout.count = static_cast<std::size_t>(bodies);
        add_point(plan, bodies, std::nullopt, layout);
        if (layout.count != kPublishedCount) continue;
        plan.table.points.back().published_query_ms = kSweepQueryMs;
        plan.table.points.back().published_update_ms = kSweepUpdateMs;
    }
    return plan;
}

// Five steps of a ratio from 1 to 100; three where a step takes long.
std::vector<double> ratios(std::size_t count) {
    if (count > 100'000) return {1.0, 10.0, 100.0};
    return {1.0, 3.0, 10.0, 30.0, 100.0};
}

// Adds a point for each ratio of a property of the bodies (`changed`); the room grows with the bodies.
StudyPlan over_ratios(StudyPlan plan, CrowdLayout layout, std::size_t count,
                      double CrowdLayout::*changed) {
    add_schemes(plan, kAll);
    layout.room = 0.0;
    layout.count = count;
    for (const double ratio : ratios(count)) {
        layout.*changed = ratio;
        add_point(plan, ratio, std::nullopt, layout);
    }
    return plan;
}

// The published conclusion is of bodies of similar size and aspect: three tables with sizes and aspects that differ.
StudyPlan plan_of_fragments(const StudySettings& settings, std::size_t count) {
    StudyPlan plan = make_plan("fragments_" + std::to_string(count),
                               "Few large bodies among many small ones: " + std::to_string(count),
                               "largest over smallest radius",
                               "Bodies of at least a radius are as many as its power of -2.5, as "
                               "fragments are; spheres take 2 % of the room.");
    CrowdLayout layout = published_layout(settings);
    layout.size_power = 2.5;
    return over_ratios(std::move(plan), layout, count, &CrowdLayout::size_spread);
}

StudyPlan plan_of_spread(const StudySettings& settings, std::size_t count) {
    StudyPlan plan = make_plan(
        "spread_" + std::to_string(count),
        "Sizes that differ: " + std::to_string(count) + " bodies", "largest over smallest radius",
        "100 radii in equal ratios around 1 m; spheres take 2 % of the room.");
    return over_ratios(std::move(plan), published_layout(settings), count,
                       &CrowdLayout::size_spread);
}

StudyPlan plan_of_aspect(const StudySettings& settings, std::size_t count) {
    StudyPlan plan =
        make_plan("aspect_" + std::to_string(count),
                  "Long bodies: " + std::to_string(count) + " bodies", "length over width",
                  "Spheres of radius 1 m around the bodies take 2 % of the room: long bodies fill "
                  "less and less of their spheres.");
    return over_ratios(std::move(plan), published_layout(settings), count, &CrowdLayout::aspect);
}

}  // namespace

std::vector<StudyPlan> make_study_plans(const StudySettings& settings) {
    std::vector<StudyPlan> plans;
    plans.push_back(plan_of_count(settings));
    plans.push_back(plan_of_many(settings));
    plans.push_back(plan_of_detail(settings));
    plans.push_back(plan_of_radius(settings));
    plans.push_back(plan_of_equal(settings));
    for (const std::size_t count : kConclusionCounts) {
        if (count > settings.most_bodies) break;
        plans.push_back(plan_of_spread(settings, count));
        plans.push_back(plan_of_fragments(settings, count));
        plans.push_back(plan_of_aspect(settings, count));
    }
    std::erase_if(plans, [](const StudyPlan& plan) { return plan.layouts.empty(); });
    return plans;
}

namespace {

// A scheme is slow if it takes this many times as long as the fastest one.
constexpr double kSlow = 2.0;

std::size_t fastest_at(const StudyPoint& point) {
    std::size_t fastest = point.measured.size();
    for (std::size_t i = 0; i < point.measured.size(); ++i) {
        if (point.measured[i].queries == 0) continue;
        if (fastest == point.measured.size() ||
            point.measured[i].mean_step_ms() < point.measured[fastest].mean_step_ms()) {
            fastest = i;
        }
    }
    return fastest;
}

// Time of a step relative to the fastest scheme; absent if the series was left out.
std::optional<double> slowness(const StudyPoint& point, std::size_t series) {
    const std::size_t fastest = fastest_at(point);
    if (fastest == point.measured.size() || point.measured[series].queries == 0) {
        return std::nullopt;
    }
    return point.measured[series].mean_step_ms() / point.measured[fastest].mean_step_ms();
}

void add_item(std::string& list, const std::string& item) {
    list += (list.empty() ? "" : ", ") + item;
}

// Ratio of the last measured step to the first of each series.
void add_growth(const StudyTable& table, std::vector<std::string>& findings) {
    std::string text;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const StudyPoint* last = nullptr;
        for (const StudyPoint& point : table.points) {
            if (point.measured[i].queries > 0) last = &point;
        }
        const CrowdTotals& first = table.points.front().measured[i];
        if (last == nullptr || first.queries == 0) continue;
        std::string item =
            fmt::format("{} {}", table.series[i],
                        short_text(last->measured[i].mean_step_ms() / first.mean_step_ms()));
        if (last != &table.points.back()) item += fmt::format(" (to {})", last->x);
        add_item(text, item);
    }
    if (text.empty()) return;
    findings.push_back(fmt::format(
        "From {} to {} {} an update and a query together take this many times as long: {}.",
        table.points.front().x, table.points.back().x, table.x_name, text));
}

void add_fastest(const StudyTable& table, std::vector<std::string>& findings) {
    std::string text;
    for (const StudyPoint& point : table.points) {
        const std::size_t fastest = fastest_at(point);
        if (fastest == point.measured.size()) continue;
        add_item(text, fmt::format("{} at {} ({} ms)", table.series[fastest], point.x,
                                   short_text(point.measured[fastest].mean_step_ms())));
    }
    if (!text.empty()) findings.push_back("The fastest scheme: " + text + ".");
}

// A scheme needs similar bodies if it falls behind the fastest one as they differ more.
void judge_similarity(const StudyTable& table, std::vector<std::string>& findings) {
    std::string need, need_not;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<double> alike = slowness(table.points.front(), i);
        if (!alike) continue;
        std::optional<double> from, last;
        for (const StudyPoint& point : table.points) {
            const std::optional<double> now = slowness(point, i);
            if (!now || &point == &table.points.front()) continue;
            last = *now / *alike;
            if (*last <= kSlow) {
                from.reset();
            } else if (!from) {
                from = point.x;
            }
        }
        if (from) {
            add_item(need,
                     fmt::format("{} {} (from {} on)", table.series[i], short_text(*last), *from));
        } else if (last) {
            add_item(need_not, fmt::format("{} {}", table.series[i], short_text(*last)));
        }
    }
    if (need.empty() && need_not.empty()) return;
    findings.push_back(fmt::format(
        "\"Bodies of similar size and aspect\", as the study concludes: how far each scheme falls "
        "behind the fastest one, over the same for similar bodies. More than {} times, so that it "
        "needs similar bodies: {}. Not so: {}.",
        kSlow, need.empty() ? "none" : need, need_not.empty() ? "none" : need_not));
}

// Axis-aligned boxes fit long bodies badly: pairs of boxes without contact dominate the cost of every scheme.
void add_pairs(const StudyTable& table, std::vector<std::string>& findings) {
    const auto of = [](const StudyPoint& point) -> const CrowdTotals* {
        for (const CrowdTotals& totals : point.measured) {
            if (totals.queries > 0) return &totals;
        }
        return nullptr;
    };
    const CrowdTotals* const first = of(table.points.front());
    const CrowdTotals* const last = of(table.points.back());
    if (first == nullptr || last == nullptr) return;
    const auto text = [](const CrowdTotals& totals) {
        return fmt::format(
            "{} pairs of overlapping boxes a query, {} % of them in contact",
            short_text(totals.mean_pairs()),
            short_text(totals.pairs == 0 ? 0.0
                                         : 100.0 * static_cast<double>(totals.touching) /
                                               static_cast<double>(totals.pairs)));
    };
    findings.push_back(fmt::format("What every scheme has to find: at {} {}; at {} {}.",
                                   table.points.front().x, text(*first), table.points.back().x,
                                   text(*last)));
}

void add_left_out(const StudyTable& table, std::vector<std::string>& findings) {
    if (table.left_out.empty()) return;
    std::string text;
    for (const LeftOut& left : table.left_out) {
        add_item(text,
                 fmt::format("{} at {} ({} s)", left.series, left.x, short_text(left.seconds)));
    }
    findings.push_back(fmt::format(
        "Left out, because {} queries would take longer than {} s by the growth from fewer "
        "bodies: {}.",
        kFewestQueries, short_text(table.most_seconds), text));
}

void add_powers(const StudyTable& table, std::vector<std::string>& findings) {
    std::string text;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = time_law(table, i, &CrowdTotals::mean_step_ms);
        if (law) add_item(text, fmt::format("{} {:.2f}", table.series[i], law->power));
    }
    if (text.empty()) return;
    findings.push_back(fmt::format(
        "An update and a query together grow with this power of the {}, the fixed cost apart: {}.",
        table.x_name, text));
}

}  // namespace

void StepTimes::add(const std::string& kind, std::size_t bodies, double seconds) {
    if (seconds > 0.0) seconds_[kind][bodies] = seconds;
}

std::optional<double> StepTimes::power_at(const std::string& kind, std::size_t bodies) const {
    const auto known = seconds_.find(kind);
    if (known == seconds_.end()) return std::nullopt;
    auto larger = known->second.lower_bound(bodies);
    if (std::distance(known->second.begin(), larger) < 2) return std::nullopt;
    const auto [count, seconds] = *--larger;
    const auto [fewer, sooner] = *--larger;
    return std::log(seconds / sooner) /
           std::log(static_cast<double>(count) / static_cast<double>(fewer));
}

std::optional<double> StepTimes::seconds_at(const std::string& kind, const std::string& similar,
                                            std::size_t bodies) const {
    constexpr double kLeastPower = 1.0, kMostPower = 2.0;
    const auto known = seconds_.find(kind);
    if (known == seconds_.end()) return std::nullopt;
    auto nearest = known->second.lower_bound(bodies);
    if (nearest == known->second.begin()) return std::nullopt;
    const auto [count, seconds] = *--nearest;
    std::optional<double> power = power_at(kind, bodies);
    if (!power) power = power_at(similar, bodies);
    return seconds * std::pow(static_cast<double>(bodies) / static_cast<double>(count),
                              std::clamp(power.value_or(kMostPower), kLeastPower, kMostPower));
}

void judge_limits(const StudyTable& table, std::vector<std::string>& findings) {
    if (table.key == "many") {
        add_powers(table, findings);
    } else {
        judge_similarity(table, findings);
    }
    add_growth(table, findings);
    add_fastest(table, findings);
    add_pairs(table, findings);
    add_left_out(table, findings);
}

}  // namespace terrane::tools
