// SPDX-License-Identifier: MIT
#include "crowd/study/study_findings.h"

#include "crowd/study/study_comparison.h"
#include "crowd/study/study_limits.h"
#include "crowd/study/study_plans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace {

constexpr double kTwoOrders = 100.0;  // of a query to an update, as claimed

using Findings = std::vector<std::string>;

// All series of a point together: for what does not depend on the scheme.
CrowdTotals all_of(const StudyPoint& point) {
    CrowdTotals all;
    for (const CrowdTotals& totals : point.measured) all.add(totals);
    return all;
}

// Power of a count or share over the points where it is above 0; absent for fewer than two.
std::optional<double> power_of(const StudyTable& table, double (CrowdTotals::*count)() const) {
    std::vector<double> x, y;
    for (const StudyPoint& point : table.points) {
        const double value = (all_of(point).*count)();
        if (!(value > 0.0)) continue;
        x.push_back(point.x);
        y.push_back(value);
    }
    return log_log_slope(x, y);
}

// The power of each series, and whether it is as small as wanted.
void judge_powers(const StudyTable& table, const std::string& what,
                  double (CrowdTotals::*time)() const, Findings& findings) {
    constexpr double kWantedPower = 1.05;
    std::string within, above, fixed;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = time_law(table, i, time);
        if (!law) continue;
        const bool is_fixed = law->is_mostly_fixed();
        std::string& list = is_fixed ? fixed : law->power <= kWantedPower ? within : above;
        list += (list.empty() ? "" : ", ") + table.series[i];
        if (!is_fixed) list += fmt::format(" {:.2f}", law->power);
        list += fmt::format(" ({} us fixed)", short_text(1e3 * law->fixed));
    }
    std::string text = fmt::format(
        "{}, as a power of the {} with the fixed cost apart. At most {}: {}. Above: {}.", what,
        table.x_name, kWantedPower, within.empty() ? "none" : within,
        above.empty() ? "none" : above);
    if (!fixed.empty()) text += " Mostly fixed: " + fixed + ".";
    findings.push_back(text);
}

void judge_slopes(const StudyTable& table, Findings& findings) {
    if (const std::optional<PowerLaw> law = published_law(table)) {
        findings.push_back(
            fmt::format("Published query times grow with the power {:.2f} of the {}, with {} "
                        "us fixed.",
                        law->power, table.x_name, short_text(1e3 * law->fixed)));
    }
    judge_powers(table, "Our queries", &CrowdTotals::mean_query_ms, findings);
    judge_powers(table, "Our updates and queries together", &CrowdTotals::mean_step_ms, findings);
    if (const std::optional<double> pairs = power_of(table, &CrowdTotals::mean_pairs)) {
        findings.push_back(fmt::format(
            "In a room of one size the pairs of overlapping boxes grow with the power {:.2f} of "
            "the bodies; a query that does nothing but its pairs cannot grow more slowly.",
            *pairs));
    }
}

void add_positive_share(const StudyTable& table, Findings& findings) {
    const StudyPoint &first = table.points.front(), &last = table.points.back();
    std::string text =
        fmt::format("Queries with a touching pair: {} % at {} {}, {} % at {}",
                    short_text(100.0 * all_of(first).positive_share()), first.x, table.x_name,
                    short_text(100.0 * all_of(last).positive_share()), last.x);
    if (const std::optional<double> power = power_of(table, &CrowdTotals::positive_share)) {
        text += fmt::format("; where there are any, the share grows with the power {:.2f}", *power);
    }
    findings.push_back(text + ".");
}

// Whether an update costs two orders of magnitude less than a query, as the study claims.
void judge_updates(const StudyTable& table, Findings& findings) {
    for (const StudyPoint& point : table.points) {
        if (!point.published_query_ms || !point.published_update_ms || point.x < 2.0) continue;
        const double published = *point.published_query_ms / *point.published_update_ms;
        std::string text = fmt::format(
            "\"Updates of boxes are two orders of magnitude below queries\", {} {}: the published "
            "times are {:.0f} to 1",
            point.x, table.x_name, published);
        for (const std::string_view name : {"sap", "two-scene"}) {
            const CrowdTotals* const ours = table.totals_at(point.x, name);
            if (ours == nullptr) continue;
            const double ratio = ours->mean_query_ms() / ours->mean_update_ms();
            text += fmt::format(
                "; {}: a query of {} us to an update of {} us is {} to "
                "1, {}",
                name, short_text(1e3 * ours->mean_query_ms()),
                short_text(1e3 * ours->mean_update_ms()), short_text(ratio),
                ratio >= kTwoOrders ? "so it is" : "not so");
        }
        findings.push_back(text + ".");
    }
}

// The table's largest ratio of the time of a query to that of an update.
void judge_largest_ratio(const StudyTable& table, Findings& findings) {
    std::string text;
    for (const std::string& name : table.series) {
        double most = 0.0, at = 0.0;
        for (const StudyPoint& point : table.points) {
            const CrowdTotals* const ours = table.totals_at(point.x, name);
            if (ours == nullptr) continue;
            const double ratio = ours->mean_query_ms() / ours->mean_update_ms();
            if (ratio > most) {
                most = ratio;
                at = point.x;
            }
        }
        text += fmt::format("{}{} {} (at {}){}", text.empty() ? "" : "; ", name, short_text(most),
                            at, most >= kTwoOrders ? ", two orders" : "");
    }
    findings.push_back(
        fmt::format("The most that a query takes over an update, by {}: {}.", table.x_name, text));
}

void judge_lazy_boxes(const StudyTable& table, Findings& findings) {
    const double x = table.points.back().x;
    const CrowdTotals* const scenes = table.totals_at(x, "two-scene");
    const CrowdTotals* const sap = table.totals_at(x, "sap");
    if (scenes == nullptr || sap == nullptr) return;
    const double ratio = scenes->mean_step_ms() / sap->mean_step_ms();
    findings.push_back(fmt::format(
        "Two scenes computed {} exact boxes for each query of {} bodies, only those of pairs "
        "of cubes: an update and a query together take {} us, {:.2f} of what they take with "
        "all boxes, so that it {} to compute no others.",
        short_text(scenes->mean_boxes()), x, short_text(1e3 * scenes->mean_step_ms()), ratio,
        ratio < 1.0 ? "pays" : "does not pay"));
}

// The growth with the detail, judged against linear and quadratic.
void judge_detail(const StudyTable& table, Findings& findings) {
    const std::optional<PowerLaw> published = published_law(table);
    const double first = table.points.front().x, last = table.points.back().x;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = time_law(table, i, &CrowdTotals::mean_query_ms);
        const CrowdTotals* const low = table.totals_at(first, table.series[i]);
        const CrowdTotals* const high = table.totals_at(last, table.series[i]);
        if (!law || low == nullptr || high == nullptr) continue;
        const double power = std::round(100.0 * law->power) / 100.0;
        const std::string range =
            law->is_mostly_fixed()
                ? "mostly fixed, the detail is seldom read"
                : fmt::format("with the power {:.2f} of the rings, the fixed cost apart, {}", power,
                              power < 1.0    ? "below linear"
                              : power <= 2.0 ? "between linear and quadratic"
                                             : "above quadratic");
        findings.push_back(fmt::format(
            "{}: from detail {} to {} a query takes {} times as long: {}; {} pairs of boxes "
            "overlap "
            "in a query at the end.",
            table.series[i], first, last, short_text(high->mean_query_ms() / low->mean_query_ms()),
            range, short_text(high->mean_pairs())));
    }
    if (published) {
        findings.push_back(fmt::format(
            "Published query times grow with the power {:.2f} of the rings, with {} us fixed.",
            published->power, short_text(1e3 * published->fixed)));
    }
}

// Whether the time rises with the radius and then stays, because all boxes overlap.
void judge_radius(const StudyTable& table, Findings& findings) {
    constexpr double kAlmostAll = 0.95;  // of the pairs
    constexpr double kSame = 1.5;        // ratio of times on a plateau
    const double all = 0.5 * kPublishedCount * (kPublishedCount - 1.0);
    const double first = table.points.front().x, last = table.points.back().x;
    double end = first, full = 0.0;  // radii: the last without, and the next with almost all pairs
    for (const StudyPoint& point : table.points) {
        const CrowdTotals* const sap = table.totals_at(point.x, "sap");
        if (sap == nullptr) return;
        if (sap->mean_pairs() < kAlmostAll * all) {
            end = point.x;
            full = 0.0;
        } else if (full == 0.0) {
            full = point.x;
        }
    }
    const auto query_us = [&](double x) {
        return 1e3 * table.totals_at(x, "sap")->mean_query_ms();
    };
    const auto pairs = [&](double x) {
        return short_text(table.totals_at(x, "sap")->mean_pairs());
    };
    findings.push_back(fmt::format(
        "Rise: from radius {} to {} a query by sweep-and-prune takes {} times as long, with {} and "
        "{} of {:.0f} pairs of boxes overlapping.",
        first, end, short_text(query_us(end) / query_us(first)), pairs(first), pairs(end), all));
    if (full == 0.0) {
        findings.push_back("No plateau: not all boxes overlap at the largest radius.");
        return;
    }
    findings.push_back(fmt::format(
        "{}: from radius {} on at least {:.0f} % of the pairs of boxes overlap; a query takes {} "
        "us "
        "there and {} us at {}.",
        query_us(last) <= kSame * query_us(full) ? "Plateau" : "No plateau", full,
        100.0 * kAlmostAll, short_text(query_us(full)), short_text(query_us(last)), last));
}

}  // namespace

std::vector<std::string> study_findings(const StudyTable& table) {
    Findings findings;
    if (table.points.empty()) return findings;
    if (table.key == "count") {
        judge_slopes(table, findings);
        add_positive_share(table, findings);
        judge_updates(table, findings);
        judge_lazy_boxes(table, findings);
    } else if (table.key == "detail") {
        judge_detail(table, findings);
        judge_largest_ratio(table, findings);
    } else if (table.key == "radius") {
        judge_radius(table, findings);
        judge_largest_ratio(table, findings);
        add_positive_share(table, findings);
    } else if (table.key == "equal") {
        judge_grids(table, findings);
        judge_updates(table, findings);
    } else {
        judge_limits(table, findings);
    }
    return findings;
}

}  // namespace terrane::tools
