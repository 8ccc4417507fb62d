// SPDX-License-Identifier: MIT
#include "crowd/study/study.h"

#include "crowd/study/power_law.h"
#include "crowd/study/study_findings.h"
#include "crowd/study/study_plans.h"
#include "output/interrupt.h"

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace {

// Sweep-and-prune along one axis is superlinear: larger counts would take minutes and are left out.
constexpr std::size_t kMostSwept = 100'000;

bool is_swept(CrowdScheme scheme) {
    return scheme == CrowdScheme::sap || scheme == CrowdScheme::two_scene;
}

// Queries one crowd for that many seconds of query and update time.
CrowdTotals measure(Crowd& crowd, double seconds) {
    constexpr std::size_t kFewest = 5;  // queries
    constexpr double kStep = 1.0 / 60.0;
    return run_crowd(crowd, kStep, [&](const CrowdTotals& totals) {
        return totals.queries < kFewest ||
               totals.query_ms + totals.boxes_ms + totals.update_ms < 1e3 * seconds;
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

// Measures every point with each of the plan's series. Points of few bodies are measured in rounds over all of
// them, so that a temporary slowdown of the machine does not distort the table.
void measure_all(StudyPlan& plan, double seconds, const std::function<void()>& show_point) {
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
        measured.resize(plan.series.size());
        for (std::size_t series = 0; series < plan.series.size(); ++series) {
            CrowdLayout layout = plan.layouts[i];
            layout.scheme = plan.series[series].scheme;
            layout.is_dented = plan.series[series].is_dented;
            if (is_swept(layout.scheme) && layout.count > kMostSwept) continue;
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

nlohmann::ordered_json to_json(const CrowdTotals& totals) {
    return {{"query_ms", totals.mean_query_ms()},
            {"positive_ms", totals.mean_positive_ms()},
            {"update_ms", totals.mean_update_ms()},
            {"boxes_ms", totals.mean_boxes_ms()},
            {"queries", totals.queries},
            {"positive_queries", totals.positive_queries}};
}

}  // namespace

std::vector<StudyTable> run_study(const StudySettings& settings,
                                  const std::function<void(double)>& show) {
    std::vector<StudyPlan> plans = make_study_plans(settings);
    double all = 0.0;
    for (const StudyPlan& plan : plans) all += static_cast<double>(plan.layouts.size());
    double done = 0.0;
    std::vector<StudyTable> tables;
    for (StudyPlan& plan : plans) {
        if (is_interrupted()) break;
        measure_all(plan, settings.seconds_a_point, [&] {
            show(done / all);
            done += 1.0;
        });
        tables.push_back(std::move(plan.table));
    }
    return tables;
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
    json["findings"] = study_findings(table);
    json["points"] = nlohmann::ordered_json::array();
    for (const StudyPoint& point : table.points) {
        nlohmann::ordered_json row;
        row["x"] = point.x;
        if (point.published_query_ms) row["published_query_ms"] = *point.published_query_ms;
        for (std::size_t i = 0; i < table.series.size(); ++i) {
            if (point.measured[i].queries > 0) row[table.series[i]] = to_json(point.measured[i]);
        }
        json["points"].push_back(std::move(row));
    }
    json["slopes"] = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = query_law(table, i), step = step_law(table, i);
        json["slopes"][table.series[i]] = {
            {"published_places", number_or_null(query_slope(table, i, true))},
            {"all", number_or_null(query_slope(table, i, false))},
            {"without_fixed_cost", law ? nlohmann::ordered_json(law->power) : nullptr},
            {"step_without_fixed_cost", step ? nlohmann::ordered_json(step->power) : nullptr}};
    }
    return json;
}

}  // namespace terrane::tools
