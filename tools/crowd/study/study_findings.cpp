// SPDX-License-Identifier: MIT
#include "crowd/study/study_findings.h"

#include "crowd/study/study_plans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace {

std::optional<PowerLaw> law_of(const StudyTable& table, std::size_t series,
                               double (CrowdTotals::*time)() const) {
    std::vector<double> x, y;
    for (const StudyPoint& point : table.points) {
        if (point.measured[series].queries == 0) continue;
        x.push_back(point.x);
        y.push_back((point.measured[series].*time)());
    }
    return fit_power_law(x, y);
}

std::size_t series_of(const StudyTable& table, std::string_view name) {
    const auto found = std::find(table.series.begin(), table.series.end(), name);
    return static_cast<std::size_t>(found - table.series.begin());
}

const CrowdTotals* totals_of(const StudyTable& table, const StudyPoint& point,
                             std::string_view name) {
    const std::size_t series = series_of(table, name);
    if (series >= point.measured.size() || point.measured[series].queries == 0) return nullptr;
    return &point.measured[series];
}

const StudyPoint* point_at(const StudyTable& table, double x) {
    for (const StudyPoint& point : table.points) {
        if (point.x == x) return &point;
    }
    return nullptr;
}

using LawOfSeries = std::optional<PowerLaw> (*)(const StudyTable&, std::size_t);

std::string slopes_text(const StudyTable& table, LawOfSeries fit) {
    std::string text;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = fit(table, i);
        if (!law) continue;
        text += fmt::format("{}{} {:.2f} (and {:.3g} us fixed)", text.empty() ? "" : ", ",
                            table.series[i], law->power, 1e3 * law->fixed);
    }
    return text;
}

void add_published_slope(const StudyTable& table, std::vector<std::string>& findings) {
    std::vector<double> x, y;
    for (const StudyPoint& point : table.points) {
        if (!point.published_query_ms) continue;
        x.push_back(point.x);
        y.push_back(*point.published_query_ms);
    }
    const std::optional<PowerLaw> law = fit_power_law(x, y);
    const std::string ours = slopes_text(table, query_law);
    if (!law || ours.empty()) return;
    findings.push_back(fmt::format(
        "Published query times grow with the power {:.2f} of the {}, the fixed cost apart; our "
        "queries: {}. In a room of one size the pairs that meet grow with the square of the "
        "bodies, and our queries are little else; the published ones had a cost for each body. "
        "Our whole steps, update and query: {}.",
        law->power, table.x_name, ours, slopes_text(table, step_law)));
}

// Whether an update costs two orders of magnitude less than a query, as the study claims.
void judge_updates(const StudyTable& table, std::vector<std::string>& findings) {
    for (const double bodies : {20.0, 50.0}) {
        const StudyPoint* const point = point_at(table, bodies);
        const CrowdTotals* const sap = point ? totals_of(table, *point, "sap") : nullptr;
        if (sap == nullptr) continue;
        const double ratio = sap->mean_update_ms() / sap->mean_query_ms();
        findings.push_back(fmt::format(
            "{:.0f} bodies, sweep-and-prune: an update of all boxes takes {:.3g} us, {:.3g} of a "
            "query ({:.3g} us). Published was that updates are two orders of magnitude below "
            "queries: {}.",
            bodies, 1e3 * sap->mean_update_ms(), ratio, 1e3 * sap->mean_query_ms(),
            ratio <= 0.01 ? "so it is here"
                          : "not here, where few pairs reach the corners of their meshes"));
    }
}

void judge_lazy_boxes(const StudyTable& table, std::vector<std::string>& findings) {
    const StudyPoint& point = table.points.back();
    const CrowdTotals* const scenes = totals_of(table, point, "two-scene");
    const CrowdTotals* const sap = totals_of(table, point, "sap");
    if (scenes == nullptr || sap == nullptr) return;
    findings.push_back(fmt::format(
        "Two scenes computed {:.3g} exact boxes a query of {:.0f} bodies: its update takes {:.3g} "
        "us, {:.2f} of that with all boxes.",
        static_cast<double>(scenes->boxes) / static_cast<double>(scenes->queries), point.x,
        1e3 * scenes->mean_update_ms(), scenes->mean_update_ms() / sap->mean_update_ms()));
}

void add_positive_share(const StudyTable& table, std::vector<std::string>& findings) {
    const StudyPoint& first = table.points.front();
    const StudyPoint& last = table.points.back();
    const auto share = [](const StudyPoint& point) {
        const CrowdTotals& totals = point.measured.front();
        return totals.queries == 0 ? 0.0
                                   : static_cast<double>(totals.positive_queries) /
                                         static_cast<double>(totals.queries);
    };
    findings.push_back(
        fmt::format("Queries with a touching pair: {:.3g} % at {:.3g} {}, {:.3g} % at {:.3g}.",
                    100.0 * share(first), first.x, table.x_name, 100.0 * share(last), last.x));
}

void judge_detail(const StudyTable& table, std::vector<std::string>& findings) {
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<double> slope = query_slope(table, i, false);
        const CrowdTotals& first = table.points.front().measured[i];
        const CrowdTotals& last = table.points.back().measured[i];
        if (!slope || first.queries == 0 || last.queries == 0) continue;
        findings.push_back(fmt::format(
            "{}: a query takes {:.2f} times as long at detail {:.0f} as at {:.0f} (published 2.43 "
            "times); slope {:.2f} over the rings, {:.2f} over the corners. {}",
            table.series[i], last.mean_query_ms() / first.mean_query_ms(), table.points.back().x,
            table.points.front().x, *slope, *slope / 2.0,
            i == 0 ? "Kernels climb from corner to corner instead of looking at all."
                   : "A dented body has 2 d convex segments, and pairs of segments are searched "
                     "by a tree."));
    }
}

void judge_radius(const StudyTable& table, std::vector<std::string>& findings) {
    const StudyPoint* const one = point_at(table, 1.0);
    const StudyPoint* const five = point_at(table, 5.0);
    const StudyPoint& last = table.points.back();
    const CrowdTotals* const at_one = one ? totals_of(table, *one, "sap") : nullptr;
    const CrowdTotals* const at_five = five ? totals_of(table, *five, "sap") : nullptr;
    const CrowdTotals* const at_last = totals_of(table, last, "sap");
    if (at_one == nullptr || at_five == nullptr || at_last == nullptr) return;
    findings.push_back(fmt::format(
        "From radius 1 to 5 a query takes {:.1f} times as long (published 1.05 times: its fixed "
        "cost hides the pairs), to {:.0f} {:.0f} times: it rises with the pairs of overlapping "
        "boxes ({:.2g}, {:.2g} and {:.3g} of 190) and ends where all overlap.",
        at_five->mean_query_ms() / at_one->mean_query_ms(), last.x,
        at_last->mean_query_ms() / at_one->mean_query_ms(),
        static_cast<double>(at_one->pairs) / static_cast<double>(at_one->queries),
        static_cast<double>(at_five->pairs) / static_cast<double>(at_five->queries),
        static_cast<double>(at_last->pairs) / static_cast<double>(at_last->queries)));
}

void judge_grids(const StudyTable& table, std::vector<std::string>& findings) {
    const StudyPoint& point = table.points.front();
    const CrowdTotals* const dense = totals_of(table, point, "dense");
    const CrowdTotals* const hashed = totals_of(table, point, "hashed");
    if (dense == nullptr || hashed == nullptr) return;
    findings.push_back(fmt::format(
        "{:.0f} bodies: without the boxes the dense grid's update takes {:.3g} us, the hashed "
        "grid's {:.3g} us: {:.0f} times less. Its query takes {:.3g} us, the dense one's {:.3g} "
        "us.",
        point.x, 1e3 * dense->mean_broadphase_ms(), 1e3 * hashed->mean_broadphase_ms(),
        dense->mean_broadphase_ms() / hashed->mean_broadphase_ms(), 1e3 * hashed->mean_query_ms(),
        1e3 * dense->mean_query_ms()));
    findings.push_back(fmt::format(
        "Published: {} ms an update and {} ms a query by the dense grid, {} and {} ms by "
        "sweep-and-prune. Clearing 64,000 lists is the whole update in both studies.",
        kDenseUpdateMs, kDenseQueryMs, kSweepUpdateMs, kSweepQueryMs));
}

// How much slower each scheme is where the table's parameter is largest.
void judge_limits(const StudyTable& table, std::vector<std::string>& findings) {
    const StudyPoint &first = table.points.front(), &last = table.points.back();
    std::string text;
    double least = 0.0;
    std::string fastest;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const CrowdTotals &a = first.measured[i], &b = last.measured[i];
        if (a.queries == 0 || b.queries == 0) continue;
        const double before = a.mean_step_ms();
        const double after = b.mean_step_ms();
        text +=
            fmt::format("{}{} {:.2f}", text.empty() ? "" : ", ", table.series[i], after / before);
        if (fastest.empty() || after < least) {
            least = after;
            fastest = table.series[i];
        }
    }
    if (fastest.empty()) return;
    findings.push_back(
        fmt::format("From {:.0f} to {:.0f} {} an update and a query together take this many times "
                    "as long: {}. {} is the fastest there, with {:.3g} ms.",
                    first.x, last.x, table.x_name, text, fastest, least));
}

}  // namespace

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

std::optional<PowerLaw> query_law(const StudyTable& table, std::size_t series) {
    return law_of(table, series, &CrowdTotals::mean_query_ms);
}

std::optional<PowerLaw> step_law(const StudyTable& table, std::size_t series) {
    return law_of(table, series, &CrowdTotals::mean_step_ms);
}

nlohmann::ordered_json number_or_null(const std::optional<double>& number) {
    return number ? nlohmann::ordered_json(*number) : nlohmann::ordered_json();
}

std::vector<std::string> study_findings(const StudyTable& table) {
    std::vector<std::string> findings;
    if (table.points.empty()) return findings;
    if (table.key == "count") {
        add_published_slope(table, findings);
        add_positive_share(table, findings);
        judge_updates(table, findings);
        judge_lazy_boxes(table, findings);
    } else if (table.key == "detail") {
        judge_detail(table, findings);
    } else if (table.key == "radius") {
        judge_radius(table, findings);
        add_positive_share(table, findings);
    } else if (table.key == "equal") {
        judge_grids(table, findings);
    } else {
        judge_limits(table, findings);
    }
    return findings;
}

}  // namespace terrane::tools
