// SPDX-License-Identifier: MIT
#include "assets.h"
#include "lab/study.h"
#include "program/output_file.h"
#include "program/summary.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Published times of a query and an update of the dense grid, ms.
constexpr double kDenseQueryMs = 0.527, kDenseUpdateMs = 65.0;
/// Number of the published grid's cells.
constexpr auto kDenseLists = static_cast<double>(kDenseCells * kDenseCells * kDenseCells);

std::string microseconds(double ms) { return short_text(1e3 * ms); }

// "20 bodies", "detail 5", "radius 2 m"
std::string place_of(const StudyTable& table, const StudyPoint& point) {
    if (table.key == "detail") return fmt::format("detail {}", point.x);
    if (table.key == "radius") return fmt::format("radius {} m", point.x);
    return point.x == 1.0 ? "1 body" : fmt::format("{} bodies", point.x);
}

// Compares the published grid with a scheme: `centroid` is that grid, `dense` lists each body in every cell of its box.
void compare_dense(const StudyTable& table, const char* scheme, const char* name,
                   const char* clearing, std::vector<Comparison>& comparisons) {
    const double x = kPublishedCount;
    const CrowdTotals* const grid = table.totals_at(x, scheme);
    const CrowdTotals* const sap = table.totals_at(x, "sap");
    if (grid == nullptr || sap == nullptr) return;
    comparisons.push_back(
        {fmt::format("query, {}, {} bodies", name, x), kDenseQueryMs, grid->mean_query_ms(),
         fmt::format("Over sweep-and-prune the grid gains a factor of {} there and of {} here, "
                     "where sweep-and-prune keeps its pairs from update to update.",
                     short_text(kSweepQueryMs / kDenseQueryMs),
                     short_text(sap->mean_query_ms() / grid->mean_query_ms()))});
    comparisons.push_back(
        {fmt::format("update, {}, {} bodies", name, x), kDenseUpdateMs, grid->mean_update_ms(),
         fmt::format("{} ns for each of {} lists there and {} ns here, where {}.",
                     short_text(1e6 * kDenseUpdateMs / kDenseLists), kDenseLists,
                     short_text(1e6 * grid->mean_update_ms() / kDenseLists), clearing)});
}

}  // namespace

std::vector<Comparison> compare_with_published(const StudyTable& table) {
    const char* const series = table.key == "detail" ? "convex" : "sap";
    std::vector<Comparison> comparisons;
    for (const StudyPoint& point : table.points) {
        const CrowdTotals* const ours = table.totals_at(point.x, series);
        if (ours == nullptr) continue;
        const std::string at = "sweep-and-prune, " + place_of(table, point);
        const auto bodies = static_cast<double>(point.layout.count);
        if (point.published_query_ms) {
            comparisons.push_back(
                {"query, " + at, *point.published_query_ms, ours->mean_query_ms(),
                 fmt::format("Published are {} us for each body; ours tests nothing but the pairs "
                             "whose boxes overlap, {} of {} in a query.",
                             microseconds(*point.published_query_ms / bodies),
                             short_text(ours->mean_pairs()), 0.5 * bodies * (bodies - 1.0))});
        }
        if (point.published_update_ms) {
            comparisons.push_back(
                {"update, " + at, *point.published_update_ms, ours->mean_update_ms(),
                 fmt::format("The same work, so that machines and programs differ: {} us for each "
                             "body there, {} us here.",
                             microseconds(*point.published_update_ms / bodies),
                             microseconds(ours->mean_update_ms() / bodies))});
        }
    }
    if (table.key == "equal") {
        compare_dense(table, "centroid", "grid of centroids", "clearing a list sets one number",
                      comparisons);
        compare_dense(table, "dense", "dense grid", "a list that is cleared keeps its memory",
                      comparisons);
    }
    return comparisons;
}

namespace {

/// Sentences, or the items of a list in a sentence.
using Texts = std::vector<std::string>;

std::string list_of(const Texts& items) {
    return items.empty() ? "none" : fmt::format("{}", fmt::join(items, "; "));
}

// Adds the power of a mean time in each series, and whether it is as small as wanted.
void judge_powers(const StudyTable& table, const char* what, double (CrowdTotals::*time)() const,
                  Texts& findings) {
    constexpr double kWantedPower = 1.05;
    Texts within, above, fixed;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = time_law(table, i, time);
        if (!law) continue;
        const std::string constant = fmt::format(" ({} us fixed)", microseconds(law->fixed));
        if (law->is_mostly_fixed()) {
            fixed.push_back(table.series[i].name + constant);
            continue;
        }
        (law->power <= kWantedPower ? within : above)
            .push_back(fmt::format("{} {:.2f}{}", table.series[i].name, law->power, constant));
    }
    findings.push_back(fmt::format(
        "{}, as a power of the {} with the fixed cost apart. At most {}: {}. Above: {}. Mostly "
        "fixed: {}.",
        what, table.x_name, kWantedPower, list_of(within), list_of(above), list_of(fixed)));
}

// Published query times as a power law plus a fixed cost.
std::optional<PowerLaw> published_law(const StudyTable& table) {
    std::vector<double> x, y;
    for (const StudyPoint& point : table.points) {
        if (!point.published_query_ms) continue;
        x.push_back(point.x);
        y.push_back(*point.published_query_ms);
    }
    return fit_power_law(x, y);
}

// Adds the powers of published and measured times.
void judge_growth(const StudyTable& table, Texts& findings) {
    if (const std::optional<PowerLaw> law = published_law(table)) {
        findings.push_back(fmt::format(
            "Published query times grow with the power {:.2f} of the {}, with {} us fixed.",
            law->power, table.x_name, microseconds(law->fixed)));
    }
    judge_powers(table, "Our queries", &CrowdTotals::mean_query_ms, findings);
    judge_powers(table, "Our updates and queries together", &CrowdTotals::mean_step_ms, findings);
}

// Adds whether an update costs two orders of magnitude less than a query, as the study claims.
void judge_updates(const StudyTable& table, Texts& findings) {
    constexpr double kTwoOrders = 100.0;
    for (const StudyPoint& point : table.points) {
        if (!point.published_query_ms || !point.published_update_ms || point.x < 2.0) continue;
        std::string text = fmt::format(
            "\"Updates of boxes are two orders of magnitude below queries\", {} {}: the published "
            "times are {:.0f} to 1",
            point.x, table.x_name, *point.published_query_ms / *point.published_update_ms);
        for (const char* name : {"sap", "two-scene"}) {
            const CrowdTotals* const ours = table.totals_at(point.x, name);
            if (ours == nullptr) continue;
            const double ratio = ours->mean_query_ms() / ours->mean_update_ms();
            text += fmt::format("; {}: a query of {} us to an update of {} us is {} to 1, {}", name,
                                microseconds(ours->mean_query_ms()),
                                microseconds(ours->mean_update_ms()), short_text(ratio),
                                ratio >= kTwoOrders ? "so it is" : "not so");
        }
        findings.push_back(text + ".");
    }
}

// Compares updates and queries of the hashed and the dense grids.
void judge_grids(const StudyTable& table, Texts& findings) {
    constexpr double kWantedRatio = 100.0, kAsFast = 1.1;
    const CrowdTotals* const dense = table.totals_at(kPublishedCount, "dense");
    const CrowdTotals* const hashed = table.totals_at(kPublishedCount, "hashed");
    if (dense == nullptr || hashed == nullptr) return;
    const double updates = dense->mean_broadphase_ms() / hashed->mean_broadphase_ms();
    const double queries = hashed->mean_query_ms() / dense->mean_query_ms();
    findings.push_back(fmt::format(
        "{} bodies: without the boxes the dense grid's update takes {} us, the hashed grid's {} "
        "us: {:.0f} times less, {} the {:.0f} times that were wanted. A query of the hashed grid "
        "takes {} us, {:.2f} of the dense grid's {} us: {}.",
        kPublishedCount, microseconds(dense->mean_broadphase_ms()),
        microseconds(hashed->mean_broadphase_ms()), updates,
        updates >= kWantedRatio ? "at least" : "less than", kWantedRatio,
        microseconds(hashed->mean_query_ms()), queries, microseconds(dense->mean_query_ms()),
        queries <= kAsFast ? "as fast" : "slower"));
    const CrowdTotals* const centroid = table.totals_at(kPublishedCount, "centroid");
    if (centroid == nullptr) return;
    findings.push_back(fmt::format(
        "{} bodies: a query of the grid of centroids compares {} pairs of spheres and tests {} for "
        "contact, {} us; one of the dense grid compares {} pairs of boxes and tests {}, {} us. An "
        "update takes {} us, with cubes for boxes, and {} us.",
        kPublishedCount, short_text(centroid->mean(centroid->candidates)),
        short_text(centroid->mean_pairs()), microseconds(centroid->mean_query_ms()),
        short_text(dense->mean(dense->candidates)), short_text(dense->mean_pairs()),
        microseconds(dense->mean_query_ms()), microseconds(centroid->mean_update_ms()),
        microseconds(dense->mean_update_ms())));
}

// Adds whether the time of a query rises with the radius to a plateau, on which all boxes overlap.
void judge_radius(const StudyTable& table, Texts& findings) {
    constexpr double kAlmostAll = 0.95 * 0.5 * kPublishedCount * (kPublishedCount - 1.0);  // pairs
    constexpr double kSame = 1.5;  // ratio of times on a plateau
    std::vector<const CrowdTotals*> sap;
    for (const StudyPoint& point : table.points) sap.push_back(table.totals_at(point.x, "sap"));
    if (std::ranges::find(sap, nullptr) != sap.end()) return;
    std::size_t full = sap.size();  // the first point from which on almost all pairs overlap
    while (full > 0 && sap[full - 1]->mean_pairs() >= kAlmostAll) --full;
    const std::size_t end = full > 0 ? full - 1 : 0;
    findings.push_back(fmt::format(
        "Rise: from radius {} to {} a query by sweep-and-prune takes {} times as long, with {} and "
        "{} pairs of boxes overlapping.",
        table.points.front().x, table.points[end].x,
        short_text(sap[end]->mean_query_ms() / sap.front()->mean_query_ms()),
        short_text(sap.front()->mean_pairs()), short_text(sap[end]->mean_pairs())));
    if (full == sap.size()) {
        findings.push_back("No plateau: not all boxes overlap at the largest radius.");
        return;
    }
    const double first_ms = sap[full]->mean_query_ms(), last_ms = sap.back()->mean_query_ms();
    findings.push_back(fmt::format(
        "{}: from radius {} on almost all pairs of boxes overlap; a query takes {} us there and {} "
        "us at {}.",
        last_ms <= kSame * first_ms ? "Plateau" : "No plateau", table.points[full].x,
        microseconds(first_ms), microseconds(last_ms), table.points.back().x));
}

// The series with the fastest step at a point, or null.
const CrowdTotals* fastest_at(const StudyPoint& point) {
    const CrowdTotals* fastest = nullptr;
    for (const CrowdTotals& totals : point.measured) {
        if (totals.queries == 0) continue;
        if (fastest == nullptr || totals.mean_step_ms() < fastest->mean_step_ms()) {
            fastest = &totals;
        }
    }
    return fastest;
}

void add_fastest(const StudyTable& table, Texts& findings) {
    Texts items;
    for (const StudyPoint& point : table.points) {
        const CrowdTotals* const fastest = fastest_at(point);
        if (fastest == nullptr) continue;
        const StudySeries& series =
            table.series[static_cast<std::size_t>(fastest - point.measured.data())];
        items.push_back(fmt::format("{} at {} ({} ms)", series.name, point.x,
                                    short_text(fastest->mean_step_ms())));
    }
    if (!items.empty()) findings.push_back("The fastest scheme: " + list_of(items) + ".");
}

// Adds which schemes need similar bodies: those that fall behind the fastest scheme if the bodies differ more.
void judge_similarity(const StudyTable& table, Texts& findings) {
    constexpr double kSlow = 2.0;  // times as long as the fastest one
    Texts need, need_not;
    const auto slowness = [](const StudyPoint& point, std::size_t i) {
        return point.measured[i].mean_step_ms() / fastest_at(point)->mean_step_ms();
    };
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        if (table.points.front().measured[i].queries == 0) continue;
        const double alike = slowness(table.points.front(), i);
        double last = 0.0;
        const StudyPoint* from = nullptr;
        for (const StudyPoint& point : std::span(table.points).subspan(1)) {
            if (point.measured[i].queries == 0) continue;
            last = slowness(point, i) / alike;
            if (last <= kSlow) {
                from = nullptr;
            } else if (from == nullptr) {
                from = &point;
            }
        }
        const std::string item = fmt::format("{} {}", table.series[i].name, short_text(last));
        if (from != nullptr) {
            need.push_back(fmt::format("{} (from {} on)", item, from->x));
        } else if (last > 0.0) {
            need_not.push_back(item);
        }
    }
    if (need.empty() && need_not.empty()) return;
    findings.push_back(fmt::format(
        "\"Bodies of similar size and aspect\", as the study concludes: how far each scheme falls "
        "behind the fastest one, over the same for similar bodies. More than {} times, so that it "
        "needs similar bodies: {}. Not so: {}.",
        kSlow, list_of(need), list_of(need_not)));
}

void add_left_out(const StudyTable& table, Texts& findings) {
    Texts items;
    for (const LeftOut& left : table.left_out) {
        items.push_back(
            fmt::format("{} at {} ({} s)", left.series, left.x, short_text(left.seconds)));
    }
    if (items.empty()) return;
    findings.push_back(fmt::format(
        "Left out, because {} queries would take longer than {} s by the growth from fewer "
        "bodies: {}.",
        kFewestQueries, short_text(table.most_seconds), list_of(items)));
}

}  // namespace

std::vector<std::string> study_findings(const StudyTable& table) {
    Texts findings;
    if (table.points.empty()) return findings;
    if (table.key == "count") {
        judge_growth(table, findings);
        judge_updates(table, findings);
    } else if (table.key == "detail") {
        judge_growth(table, findings);
    } else if (table.key == "radius") {
        judge_radius(table, findings);
    } else if (table.key == "equal") {
        judge_grids(table, findings);
        judge_updates(table, findings);
    } else {
        if (table.key != "many") judge_similarity(table, findings);
        add_fastest(table, findings);
        add_left_out(table, findings);
    }
    return findings;
}

namespace {

Json power_or_null(const std::optional<PowerLaw>& law) {
    return law && !law->is_mostly_fixed() ? Json(law->power) : Json();
}

Json to_json(const CrowdTotals& totals) {
    return {{"queries", totals.queries},
            {"positive_queries", totals.positive_queries},
            {"query_ms", totals.mean_query_ms()},
            {"positive_ms", totals.mean_positive_ms()},
            {"update_ms", totals.mean_update_ms()},
            {"boxes_ms", totals.mean_boxes_ms()},
            {"pairs_a_query", totals.mean_pairs()},
            {"boxes_a_query", totals.mean(totals.boxes)}};
}

Json to_json(const StudyTable& table, const StudyPoint& point) {
    Json row;
    row["x"] = point.x;
    if (point.published_query_ms) row["published_query_ms"] = *point.published_query_ms;
    if (point.published_update_ms) row["published_update_ms"] = *point.published_update_ms;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const CrowdTotals& totals = point.measured[i];
        if (totals.queries > 0) row[table.series[i].name] = to_json(totals);
    }
    return row;
}

// One line of a table in Markdown.
std::string row_of(const Texts& cells) { return fmt::format("| {} |\n", fmt::join(cells, " | ")); }

// A heading in Markdown with the line below it.
std::string heading_of(const std::string& line) {
    const auto columns = static_cast<std::size_t>(std::ranges::count(line, '|') - 1);
    return fmt::format("{}\n|{}\n", line, fmt::join(Texts(columns, "---|"), ""));
}

std::string comparison_rows(const std::vector<Comparison>& comparisons) {
    if (comparisons.empty()) return "";
    std::string text =
        heading_of("| | published, us | ours, us | published / ours | why they differ |");
    for (const Comparison& each : comparisons) {
        text += row_of({each.what, microseconds(each.published_ms), microseconds(each.our_ms),
                        short_text(each.published_ms / each.our_ms), each.reason});
    }
    return text + "\n";
}

std::string measurement_rows(const StudyTable& table) {
    std::string text = heading_of(fmt::format(
        "| {} | series | queries | positive | positive, % | query, us | positive query, us | "
        "update, us | boxes, us | pairs a query |",
        table.x_name));
    for (const StudyPoint& point : table.points) {
        for (std::size_t i = 0; i < table.series.size(); ++i) {
            const CrowdTotals& totals = point.measured[i];
            if (totals.queries == 0) continue;
            text +=
                row_of({fmt::format("{}", point.x), table.series[i].name,
                        std::to_string(totals.queries), std::to_string(totals.positive_queries),
                        short_text(100.0 * totals.mean(totals.positive_queries)),
                        microseconds(totals.mean_query_ms()),
                        totals.positive_queries == 0 ? "" : microseconds(totals.mean_positive_ms()),
                        microseconds(totals.mean_update_ms()), microseconds(totals.mean_boxes_ms()),
                        short_text(totals.mean_pairs())});
        }
    }
    return text + "\n";
}

}  // namespace

Json to_json(const StudyTable& table) {
    Json comparisons = Json::array(), left_out = Json::array(), points = Json::array();
    for (const Comparison& each : compare_with_published(table)) {
        comparisons.push_back({{"what", each.what},
                               {"published_ms", each.published_ms},
                               {"our_ms", each.our_ms},
                               {"reason", each.reason}});
    }
    for (const LeftOut& each : table.left_out) {
        left_out.push_back({{"x", each.x}, {"series", each.series}, {"estimated_s", each.seconds}});
    }
    for (const StudyPoint& point : table.points) points.push_back(to_json(table, point));
    Json slopes = Json::object();
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        slopes[table.series[i].name] = {
            {"published_places", number_or_null(query_slope(table, i, true))},
            {"all", number_or_null(query_slope(table, i, false))},
            {"without_fixed_cost", power_or_null(time_law(table, i, &CrowdTotals::mean_query_ms))},
            {"step_without_fixed_cost",
             power_or_null(time_law(table, i, &CrowdTotals::mean_step_ms))}};
    }
    return {{"key", table.key},
            {"title", table.title},
            {"x_name", table.x_name},
            {"text", table.text},
            {"findings", study_findings(table)},
            {"comparisons", comparisons},
            {"left_out", left_out},
            {"points", points},
            {"slopes", slopes}};
}

std::string study_markdown(std::span<const StudyTable> tables) {
    std::string text;
    for (const StudyTable& table : tables) {
        text += fmt::format("## {}\n\n{}\n\n", table.title, table.text);
        text += comparison_rows(compare_with_published(table));
        for (const std::string& each : study_findings(table)) text += fmt::format("- {}\n", each);
        text += "\n";
        text += measurement_rows(table);
    }
    return text;
}

Result<void> write_study_report(const OutputPlace& place, const ReportHeader& header,
                                std::span<const StudyTable> tables) {
    Json data;
    data["tables"] = Json::array();
    for (const StudyTable& table : tables) data["tables"].push_back(to_json(table));
    return write_report(place, header, std::move(data), assets::study_js);
}

}  // namespace terrane::tools
