// SPDX-License-Identifier: MIT
#include "lab/study.h"

#include "lab/measure.h"
#include "program/progress.h"
#include "program/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

namespace terrane::tools {
namespace {

// The least-squares fit of y = fixed + factor * u with weights 1 / y^2, and its weighted sum of squared errors.
struct RelativeFit {
    double fixed = 0.0, factor = 0.0, error = std::numeric_limits<double>::infinity();
};

RelativeFit fit_line(std::span<const double> x, std::span<const double> y, double power) {
    double w1 = 0.0, wu = 0.0, wuu = 0.0, wy = 0.0, wuy = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double u = std::pow(x[i], power), weight = 1.0 / (y[i] * y[i]);
        w1 += weight;
        wu += weight * u;
        wuu += weight * u * u;
        wy += weight * y[i];
        wuy += weight * u * y[i];
    }
    RelativeFit fit;
    const double determinant = w1 * wuu - wu * wu;
    if (determinant > 1e-12 * w1 * wuu) {
        fit.fixed = (wuu * wy - wu * wuy) / determinant;
        fit.factor = (w1 * wuy - wu * wy) / determinant;
    }
    if (!(determinant > 1e-12 * w1 * wuu) || fit.fixed < 0.0) {
        fit.fixed = 0.0;
        fit.factor = wuy / wuu;
    }
    fit.error = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double relative = (fit.fixed + fit.factor * std::pow(x[i], power)) / y[i] - 1.0;
        fit.error += relative * relative;
    }
    return fit;
}

}  // namespace

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

std::optional<PowerLaw> fit_power_law(std::span<const double> x, std::span<const double> y) {
    constexpr int kPowers = 600;
    constexpr double kMostPower = 3.0;
    if (x.size() < 4 || std::any_of(y.begin(), y.end(), [](double v) { return !(v > 0.0); })) {
        return std::nullopt;
    }
    PowerLaw law;
    double least = std::numeric_limits<double>::infinity();
    for (int step = 1; step <= kPowers; ++step) {
        const double power = kMostPower * step / kPowers;
        const RelativeFit fit = fit_line(x, y, power);
        if (fit.error >= least) continue;
        least = fit.error;
        law = {fit.fixed, fit.factor, power, fit.fixed / y.back()};
    }
    return law;
}

namespace {

constexpr std::size_t kFewBodies = 1000;  ///< most bodies of points that are measured in rounds

// Advances small crowds between measurements, so that a short run sees many independent placements.
void stir(Crowd& crowd) {
    for (int half_second = 0; half_second < 40; ++half_second) crowd.move(0.5);
}

// Queries one crowd until queries and updates have taken `seconds`, and at least kFewestQueries times.
CrowdTotals measure(Crowd& crowd, double seconds, bool is_stirred) {
    constexpr double kStep = 1.0 / 60.0;
    constexpr std::size_t kCoherent = 60;  // queries in a row: one second of motion
    return run_crowd(crowd, kStep, [&](const CrowdTotals& totals) {
        if (is_interrupted()) return false;
        if (is_stirred && totals.queries % kCoherent == 0) stir(crowd);
        return totals.queries < kFewestQueries ||
               totals.query_ms + totals.boxes_ms + totals.update_ms < 1e3 * seconds;
    });
}

double median_of(std::span<const CrowdTotals> rounds, double (CrowdTotals::*time)() const) {
    std::vector<double> times;
    for (const CrowdTotals& round : rounds) times.push_back((round.*time)());
    return median(std::move(times));
}

// Counts of all rounds, with the medians of their mean times. Positive queries may be rare: their time is taken over
// all rounds.
CrowdTotals joined(std::span<const CrowdTotals> rounds) {
    CrowdTotals all;
    for (const CrowdTotals& round : rounds) all.add(round);
    const auto queries = static_cast<double>(all.queries);
    all.query_ms = queries * median_of(rounds, &CrowdTotals::mean_query_ms);
    all.boxes_ms = queries * median_of(rounds, &CrowdTotals::mean_boxes_ms);
    all.update_ms = queries * median_of(rounds, &CrowdTotals::mean_broadphase_ms);
    return all;
}

CrowdLayout layout_of(const StudyPoint& point, const StudySeries& series) {
    CrowdLayout layout = point.layout;
    layout.scheme = series.scheme;
    layout.is_dented = series.is_dented;
    if (series.own_room_share > 0.0) {
        layout.room = 0.0;
        layout.share = series.own_room_share;
    }
    return layout;
}

// Everything that determines the time of a step, except the number of bodies.
std::string kind_of(const CrowdLayout& layout) {
    return fmt::format("{} {} {} {} {} {} {} {} {}", to_string(layout.scheme), layout.is_dented,
                       layout.room, layout.share, layout.radius, layout.detail, layout.size_spread,
                       layout.size_power, layout.aspect);
}

// The kind of bodies of similar size and aspect, which is measured at more counts.
std::string similar_kind_of(CrowdLayout layout) {
    layout.size_spread = layout.aspect = 1.0;
    layout.size_power = 0.0;
    return kind_of(layout);
}

// Measures points of few bodies in turns, so that a temporary slowdown of the machine does not distort the table.
void measure_few(StudyTable& table, const StudySettings& settings, StepTimes& times) {
    constexpr std::size_t kRounds = 5;
    struct TimedCrowd {
        Crowd crowd;
        CrowdLayout layout;
        CrowdTotals* result;
        std::vector<CrowdTotals> rounds;
    };
    std::vector<TimedCrowd> timed_crowds;
    for (StudyPoint& point : table.points) {
        if (point.layout.count > kFewBodies) continue;
        for (std::size_t series = 0; series < table.series.size(); ++series) {
            const CrowdLayout layout = layout_of(point, table.series[series]);
            timed_crowds.push_back({Crowd(layout), layout, &point.measured[series], {}});
        }
    }
    take_turns(timed_crowds.size(), {.most_turns = kRounds}, [&](std::size_t i, std::size_t) {
        TimedCrowd& timed = timed_crowds[i];
        stir(timed.crowd);
        timed.rounds.push_back(measure(timed.crowd, settings.seconds_a_point / kRounds, true));
        return !is_interrupted();
    });
    for (TimedCrowd& timed : timed_crowds) {
        if (timed.rounds.empty()) continue;
        *timed.result = joined(timed.rounds);
        times.add(kind_of(timed.layout), timed.layout.count, 1e-3 * timed.result->mean_step_ms());
    }
}

// Measures one point of many bodies, without the series that would take too long.
void measure_many(StudyTable& table, StudyPoint& point, const StudySettings& settings,
                  StepTimes& times) {
    for (std::size_t series = 0; series < table.series.size() && !is_interrupted(); ++series) {
        const CrowdLayout layout = layout_of(point, table.series[series]);
        const std::string kind = kind_of(layout);
        const std::optional<double> step =
            times.seconds_at(kind, similar_kind_of(layout), layout.count);
        const double seconds = static_cast<double>(kFewestQueries) * step.value_or(0.0);
        if (seconds > settings.most_seconds_a_point) {
            table.left_out.push_back({point.x, table.series[series].name, seconds});
            continue;
        }
        Crowd crowd(layout);
        point.measured[series] = measure(crowd, settings.seconds_a_point, false);
        times.add(kind, layout.count, 1e-3 * point.measured[series].mean_step_ms());
    }
}

}  // namespace

const CrowdTotals* StudyTable::totals_at(double x, std::string_view series_name) const {
    const auto point = std::ranges::find(points, x, &StudyPoint::x);
    const auto found = std::ranges::find(series, series_name, &StudySeries::name);
    if (point == points.end() || found == series.end()) return nullptr;
    const CrowdTotals& totals = point->measured[static_cast<std::size_t>(found - series.begin())];
    return totals.queries > 0 ? &totals : nullptr;
}

std::vector<StudyTable> measure_tables(std::vector<StudyTable> tables,
                                       const StudySettings& settings,
                                       const std::function<void(double)>& show) {
    double all = 0.0, done = 0.0;
    for (const StudyTable& table : tables) all += static_cast<double>(table.points.size());
    StepTimes times;
    for (StudyTable& table : tables) {
        table.most_seconds = settings.most_seconds_a_point;
        for (StudyPoint& point : table.points) point.measured.resize(table.series.size());
        if (!is_interrupted()) measure_few(table, settings, times);
        for (StudyPoint& point : table.points) {
            if (is_interrupted()) break;
            show(done / all);
            done += 1.0;
            if (point.layout.count > kFewBodies) measure_many(table, point, settings, times);
        }
    }
    return tables;
}

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

std::string short_text(double value) {
    constexpr int kDigits = 3;
    return rounded_text(value, kDigits, Rounding::nearest);
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

std::optional<double> query_slope(const StudyTable& table, std::size_t series,
                                  bool is_published_only) {
    std::vector<double> x, y;
    for (const StudyPoint& point : table.points) {
        if (point.measured[series].candidates == 0) continue;
        if (is_published_only && !point.published_query_ms) continue;
        x.push_back(point.x);
        y.push_back(point.measured[series].mean_query_ms());
    }
    return log_log_slope(x, y);
}

std::optional<PowerLaw> time_law(const StudyTable& table, std::size_t series,
                                 double (CrowdTotals::*time)() const) {
    std::vector<double> x, y;
    for (const StudyPoint& point : table.points) {
        if (point.measured[series].queries == 0) continue;
        x.push_back(point.x);
        y.push_back((point.measured[series].*time)());
    }
    return fit_power_law(x, y);
}

}  // namespace terrane::tools
