// SPDX-License-Identifier: MIT
//
// Sources:
//   S. Ehmann, M. Lin. Accurate and fast proximity queries between polyhedra using convex surface
//   decomposition. Eurographics 2001 (SWIFT++, which the published study measured).
#include "crowd/study.h"

#include "output/interrupt.h"

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace {

// A published time of a query, ms, and the parameter that it was measured for.
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
constexpr double kMore[] = {100, 300, 1000, 3000, 10'000, 30'000, 100'000, 300'000, 1'000'000};
constexpr std::size_t kUsualCount = 20;  // where a table does not vary it
// Sweep-and-prune along one axis is superlinear: larger counts would take minutes and are left out.
constexpr double kMostSwept = 100'000;

const std::vector<BroadphaseKind> kAll{BroadphaseKind::sap, BroadphaseKind::grid,
                                       BroadphaseKind::two_scene};

struct Plan {
    StudyTable table;
    std::vector<BroadphaseKind> kinds;
    std::vector<CrowdLayout> layouts;  ///< by point
};

Plan make_plan(std::string key, std::string title, std::string x_name, std::string text,
               std::vector<BroadphaseKind> kinds) {
    Plan plan;
    plan.table.key = std::move(key);
    plan.table.title = std::move(title);
    plan.table.x_name = std::move(x_name);
    plan.table.text = std::move(text);
    for (const BroadphaseKind kind : kinds) plan.table.series.emplace_back(to_string(kind));
    plan.kinds = std::move(kinds);
    return plan;
}

void add_point(Plan& plan, double x, std::optional<double> published_ms,
               const CrowdLayout& layout) {
    StudyPoint point;
    point.x = x;
    point.published_query_ms = published_ms;
    plan.table.points.push_back(std::move(point));
    plan.layouts.push_back(layout);
}

// Adds a point for each published value of one member of the usual layout.
void add_published(Plan& plan, std::span<const Published> places, const CrowdLayout& usual,
                   double CrowdLayout::*changed) {
    for (const Published& each : places) {
        CrowdLayout layout = usual;
        layout.*changed = each.x;
        add_point(plan, each.x, each.ms, layout);
    }
}

std::vector<Plan> make_plans(const StudySettings& settings) {
    CrowdLayout usual;
    usual.count = kUsualCount;
    usual.seed = settings.seed;

    std::vector<Plan> plans;
    Plan count = make_plan("count", "Bodies", "bodies",
                           "The room grows with the bodies, which always take 2 % of it: each has "
                           "the same few neighbours, and a "
                           "query is linear in the bodies wherever the broadphase is. The "
                           "published queries were linear too. Sweeping "
                           "along one axis sees a slab of the room for each body, which grows with "
                           "the two thirds power of the count: "
                           "for many thousands the grid is the better one. Boxes separate most "
                           "pairs, and one separating plane most of the rest; "
                           " what the published queries computed beyond that "
                           "is not known, and their machine was "
                           "one of its time.",
                           kAll);
    for (const Published& each : kOfCount) {
        CrowdLayout layout = usual;
        layout.count = static_cast<std::size_t>(each.x);
        add_point(count, each.x, each.ms, layout);
    }
    for (const double more : kMore) {
        if (more > static_cast<double>(settings.most_bodies)) break;
        CrowdLayout layout = usual;
        layout.count = static_cast<std::size_t>(more);
        add_point(count, more, std::nullopt, layout);
    }
    plans.push_back(std::move(count));

    Plan detail = make_plan(
        "detail", "Detail of 20 bodies", "rings of corners",
        "A body of detail d has d rings of 2 d corners. Only pairs whose boxes overlap see the "
        "corners, and they "
        "climb from corner to corner instead of looking at all of them; what grows is the boxes, "
        "whose six ends "
        "are looked up by the same climb. The published times grew by 2.4 from detail 2 to 35.",
        {BroadphaseKind::sap});
    add_published(detail, kOfDetail, usual, &CrowdLayout::detail);
    plans.push_back(std::move(detail));

    Plan radius = make_plan("radius", "Radius of 20 bodies", "metres",
                            "The room grows with the bodies, so that only the unit of length "
                            "changes: a query takes the same time at "
                            "any radius. The published times grew by a tenth from 0.5 to 5 m.",
                            {BroadphaseKind::sap});
    add_published(radius, kOfRadius, usual, &CrowdLayout::radius);
    plans.push_back(std::move(radius));

    Plan equal = make_plan("equal", "Bodies of equal size", "bodies",
                           "All bodies have the same mesh. Published for 20 bodies: 3.164 ms a "
                           "query with 0.099 ms an update by "
                           "sweep-and-prune, 0.527 ms with 65 ms an update by a dense grid of 40^3 "
                           "cells, each of which had to be "
                           "cleared. A grid that stores only the cells that bodies lie in updates "
                           "in time linear in the bodies, "
                           "wherever they are.",
                           {BroadphaseKind::sap, BroadphaseKind::grid});
    for (const double bodies : {20.0, 100.0, 1000.0, 10'000.0, 100'000.0, 1'000'000.0}) {
        if (bodies > static_cast<double>(settings.most_bodies) && bodies > kUsualCount) break;
        CrowdLayout layout = usual;
        layout.detail_deviation = 0.0;
        layout.count = static_cast<std::size_t>(bodies);
        add_point(equal, bodies,
                  bodies == kUsualCount ? std::optional<double>(3.164) : std::nullopt, layout);
    }
    plans.push_back(std::move(equal));
    return plans;
}

nlohmann::ordered_json slope_of(const StudyTable& table, std::size_t series,
                                bool is_published_only) {
    std::vector<double> x, y;
    for (const StudyPoint& point : table.points) {
        // Without candidate pairs, as for one body, the time is overhead only.
        if (point.measured[series].candidates == 0) continue;
        if (is_published_only && !point.published_query_ms) continue;
        x.push_back(point.x);
        y.push_back(point.measured[series].mean_query_ms());
    }
    const std::optional<double> slope = log_log_slope(x, y);
    return slope ? nlohmann::ordered_json(*slope) : nlohmann::ordered_json();
}

// Queries one crowd for that many seconds of query and update time.
CrowdTotals measure(Crowd& crowd, double seconds) {
    constexpr std::size_t kFewest = 5;  // queries
    constexpr double kStep = 1.0 / 60.0;
    return run_crowd(crowd, kStep, [&](const CrowdTotals& totals) {
        return totals.queries < kFewest || totals.query_ms + totals.update_ms < 1e3 * seconds;
    });
}

// The round with the median query time.
CrowdTotals median_of(std::span<CrowdTotals> rounds) {
    const auto middle = rounds.begin() + static_cast<std::ptrdiff_t>(rounds.size() / 2);
    std::nth_element(rounds.begin(), middle, rounds.end(),
                     [](const CrowdTotals& a, const CrowdTotals& b) {
                         return a.mean_query_ms() < b.mean_query_ms();
                     });
    return *middle;
}

// Measures every point with each of the plan's broadphases. Points of few bodies are measured in rounds over all of
// them, so that a temporary slowdown of the machine does not distort the table.
void measure_all(Plan& plan, double seconds, const std::function<void()>& show_point) {
    constexpr int kRounds = 5;
    constexpr std::size_t kFewBodies = 1000;
    struct TimedCrowd {
        Crowd crowd;
        CrowdTotals* result;
        std::vector<CrowdTotals> rounds;
    };
    std::vector<TimedCrowd> timed_crowds;
    for (std::size_t i = 0; i < plan.layouts.size() && !is_interrupted(); ++i) {
        std::vector<CrowdTotals>& measured = plan.table.points[i].measured;
        measured.resize(plan.kinds.size());
        for (std::size_t series = 0; series < plan.kinds.size(); ++series) {
            CrowdLayout layout = plan.layouts[i];
            layout.broadphase = plan.kinds[series];
            if (layout.broadphase != BroadphaseKind::grid &&
                static_cast<double>(layout.count) > kMostSwept) {
                continue;
            }
            if (layout.count <= kFewBodies) {
                timed_crowds.push_back({Crowd(layout), &measured[series], {}});
            } else {
                Crowd crowd(layout);
                measured[series] = measure(crowd, seconds);
            }
        }
        show_point();
    }
    for (int round = 0; round < kRounds; ++round) {
        for (TimedCrowd& timed : timed_crowds) {
            timed.rounds.push_back(measure(timed.crowd, seconds / kRounds));
        }
    }
    for (TimedCrowd& timed : timed_crowds) *timed.result = median_of(timed.rounds);
}

}  // namespace

std::vector<StudyTable> run_study(const StudySettings& settings,
                                  const std::function<void(double)>& show) {
    std::vector<Plan> plans = make_plans(settings);
    double all = 0.0;
    for (const Plan& plan : plans) all += static_cast<double>(plan.layouts.size());
    double done = 0.0;
    std::vector<StudyTable> tables;
    for (Plan& plan : plans) {
        if (is_interrupted()) break;
        measure_all(plan, settings.seconds_a_point, [&] {
            show(done / all);
            done += 1.0;
        });
        tables.push_back(std::move(plan.table));
    }
    return tables;
}

std::optional<double> log_log_slope(std::span<const double> x, std::span<const double> y) {
    const auto count = static_cast<double>(x.size());
    double sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double u = std::log(x[i]), v = std::log(y[i]);
        sum_x += u;
        sum_y += v;
        sum_xx += u * u;
        sum_xy += u * v;
    }
    const double spread = count * sum_xx - sum_x * sum_x;
    if (!(spread > 1e-12 * count * sum_xx)) return std::nullopt;
    return (count * sum_xy - sum_x * sum_y) / spread;
}

std::optional<double> least_speedup(const StudyTable& table) {
    std::optional<double> least;
    for (const StudyPoint& point : table.points) {
        if (!point.published_query_ms) continue;
        double best = 0.0;
        for (const CrowdTotals& totals : point.measured) {
            if (totals.queries == 0) continue;
            best = std::max(best, *point.published_query_ms / totals.mean_query_ms());
        }
        least = std::min(least.value_or(best), best);
    }
    return least;
}

nlohmann::ordered_json to_json(const StudyTable& table) {
    nlohmann::ordered_json json;
    json["key"] = table.key;
    json["title"] = table.title;
    json["x_name"] = table.x_name;
    json["text"] = table.text;
    json["points"] = nlohmann::ordered_json::array();
    for (const StudyPoint& point : table.points) {
        nlohmann::ordered_json row;
        row["x"] = point.x;
        if (point.published_query_ms) row["published_query_ms"] = *point.published_query_ms;
        for (std::size_t i = 0; i < table.series.size(); ++i) {
            const CrowdTotals& totals = point.measured[i];
            if (totals.queries == 0) continue;
            row[table.series[i]] = {{"query_ms", totals.mean_query_ms()},
                                    {"positive_ms", totals.mean_positive_ms()},
                                    {"update_ms", totals.mean_update_ms()},
                                    {"queries", totals.queries},
                                    {"positive_queries", totals.positive_queries}};
        }
        json["points"].push_back(std::move(row));
    }
    json["slopes"] = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        json["slopes"][table.series[i]] = {{"published_places", slope_of(table, i, true)},
                                           {"all", slope_of(table, i, false)}};
    }
    return json;
}

}  // namespace terrane::tools
