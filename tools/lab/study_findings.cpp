// SPDX-License-Identifier: MIT
#include "lab/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

// The series of the scheme of the published times.
std::string_view published_series(const StudyTable& table) {
    return table.key == "detail" ? "convex" : "sap";
}

// "20 bodies", "detail 5", "radius 2 m"
std::string place_of(const StudyTable& table, const StudyPoint& point) {
    if (table.key == "detail") return fmt::format("detail {}", point.x);
    if (table.key == "radius") return fmt::format("radius {} m", point.x);
    return point.x == 1.0 ? "1 body" : fmt::format("{} bodies", point.x);
}

const StudyPoint* first_published(const StudyTable& table) {
    for (const StudyPoint& point : table.points) {
        if (point.published_query_ms) return &point;
    }
    return nullptr;
}

// Reason for a table whose x is the number of bodies.
std::string reason_of_bodies(double bodies, double published_ms, const CrowdTotals& ours) {
    const double published_us = 1e3 * published_ms / bodies;
    if (bodies < 2.0) {
        return fmt::format(
            "One body has no pair: ours is an empty list of pairs, the published {:.0f} us are a "
            "cost of the body itself.",
            published_us);
    }
    return fmt::format(
        "Published are {:.0f} us for each body; ours tests nothing but the pairs whose boxes "
        "overlap, {} of {:.0f} in a query.",
        published_us, short_text(ours.mean_pairs()), 0.5 * bodies * (bodies - 1.0));
}

// Reason for a table whose x is a property of 20 bodies: compares the growth since the first published point.
std::string reason_of_change(const StudyTable& table, const StudyPoint& point,
                             const CrowdTotals& ours) {
    const StudyPoint& first = *first_published(table);
    const CrowdTotals* const at_first = table.totals_at(first.x, published_series(table));
    if (&point == &first || at_first == nullptr) {
        return reason_of_bodies(kPublishedCount, *point.published_query_ms, ours);
    }
    constexpr double kHardly = 1.5;  // times
    const double published = *point.published_query_ms / *first.published_query_ms;
    const std::string change =
        fmt::format("The published time is {:.2f} times that at {}, ours {:.2f} times: ", published,
                    first.x, ours.mean_query_ms() / at_first->mean_query_ms());
    if (table.key == "detail") {
        return change + fmt::format(
                            "ours reads the meshes of pairs of overlapping boxes only, {} "
                            "in a query; the published one must read them without such "
                            "pairs.",
                            short_text(ours.mean_pairs()));
    }
    return change + fmt::format(
                        "ours is paid for pairs of overlapping boxes, {} in a query and {} "
                        "at {}; in the published one they {}.",
                        short_text(ours.mean_pairs()), short_text(at_first->mean_pairs()), first.x,
                        published < kHardly ? "hardly show" : "show");
}

std::string reason_of_update(const StudyPoint& point, const CrowdTotals& ours) {
    return fmt::format(
        "The same work, so that machines and programs differ: {} us for each body there, {} "
        "us here, {:.0f} % of it for the boxes.",
        short_text(1e3 * *point.published_update_ms / point.x),
        short_text(1e3 * ours.mean_update_ms() / point.x),
        100.0 * ours.mean_boxes_ms() / ours.mean_update_ms());
}

void compare_dense(const StudyTable& table, std::vector<Comparison>& comparisons) {
    const double x = kPublishedCount;
    const CrowdTotals* const dense = table.totals_at(x, "dense");
    const CrowdTotals* const sap = table.totals_at(x, "sap");
    if (dense == nullptr || sap == nullptr) return;
    comparisons.push_back(
        {fmt::format("query, dense grid, {} bodies", x), kDenseQueryMs, dense->mean_query_ms(),
         fmt::format("Over sweep-and-prune the dense grid gains a factor of {} there and of "
                     "{} here, where sweep-and-prune keeps its pairs from update to update.",
                     short_text(kSweepQueryMs / kDenseQueryMs),
                     short_text(sap->mean_query_ms() / dense->mean_query_ms()))});
    comparisons.push_back(
        {fmt::format("update, dense grid, {} bodies", x), kDenseUpdateMs, dense->mean_update_ms(),
         fmt::format(
             "{} ns for each of {} lists there and {} ns here, where a list that "
             "is cleared keeps its memory and only its length is written.",
             short_text(1e6 * kDenseUpdateMs / static_cast<double>(kDenseLists)), kDenseLists,
             short_text(1e6 * dense->mean_update_ms() / static_cast<double>(kDenseLists)))});
}

}  // namespace

std::vector<Comparison> compare_with_published(const StudyTable& table) {
    const bool is_of_bodies = table.key == "count" || table.key == "equal";
    std::vector<Comparison> comparisons;
    for (const StudyPoint& point : table.points) {
        const CrowdTotals* const ours = table.totals_at(point.x, published_series(table));
        if (ours == nullptr) continue;
        const std::string at = "sweep-and-prune, " + place_of(table, point);
        if (point.published_query_ms) {
            comparisons.push_back({"query, " + at, *point.published_query_ms, ours->mean_query_ms(),
                                   is_of_bodies
                                       ? reason_of_bodies(point.x, *point.published_query_ms, *ours)
                                       : reason_of_change(table, point, *ours)});
        }
        if (point.published_update_ms) {
            comparisons.push_back({"update, " + at, *point.published_update_ms,
                                   ours->mean_update_ms(), reason_of_update(point, *ours)});
        }
    }
    if (table.key == "equal") compare_dense(table, comparisons);
    return comparisons;
}

namespace {

using Findings = std::vector<std::string>;

void judge_grids(const StudyTable& table, Findings& findings) {
    constexpr double kWantedRatio = 100.0;
    constexpr double kAsFast = 1.1;
    const double x = kPublishedCount;
    const CrowdTotals* const dense = table.totals_at(x, "dense");
    const CrowdTotals* const hashed = table.totals_at(x, "hashed");
    if (dense == nullptr || hashed == nullptr) return;
    const double updates = dense->mean_broadphase_ms() / hashed->mean_broadphase_ms();
    const double queries = hashed->mean_query_ms() / dense->mean_query_ms();
    findings.push_back(fmt::format(
        "{} bodies: without the boxes the dense grid's update takes {} us, the hashed grid's {} "
        "us: {:.0f} times less, {} the {:.0f} times that were wanted. A query of the hashed grid "
        "takes {} us, {:.2f} of the dense grid's {} us: {}.",
        x, short_text(1e3 * dense->mean_broadphase_ms()),
        short_text(1e3 * hashed->mean_broadphase_ms()), updates,
        updates >= kWantedRatio ? "at least" : "less than", kWantedRatio,
        short_text(1e3 * hashed->mean_query_ms()), queries,
        short_text(1e3 * dense->mean_query_ms()), queries <= kAsFast ? "as fast" : "slower"));
    const CrowdTotals* const alone = table.totals_at(1.0, "dense");
    if (alone == nullptr) return;
    const double clearing = alone->mean_broadphase_ms() / dense->mean_broadphase_ms();
    findings.push_back(fmt::format(
        "With one body the dense grid's update takes {} us, {:.0f} % of that with {} bodies: "
        "to clear {} lists {} of it.",
        short_text(1e3 * alone->mean_broadphase_ms()), 100.0 * clearing, x, kDenseLists,
        clearing >= 0.5 ? "is most" : "is not most"));
}

void add_item(std::string& list, const std::string& item) {
    list += (list.empty() ? "" : ", ") + item;
}

constexpr double kTwoOrders = 100.0;  // of a query to an update, as claimed

// Sum of all series of a point, for quantities that do not depend on the scheme.
CrowdTotals all_of(const StudyPoint& point) {
    CrowdTotals all;
    for (const CrowdTotals& totals : point.measured) all.add(totals);
    return all;
}

// Power of a count or share over the points at which it is above 0; absent for fewer than two.
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
        add_item(list, table.series[i].name);
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
    for (const StudySeries& series : table.series) {
        double most = 0.0, at = 0.0;
        for (const StudyPoint& point : table.points) {
            const CrowdTotals* const ours = table.totals_at(point.x, series.name);
            if (ours == nullptr) continue;
            const double ratio = ours->mean_query_ms() / ours->mean_update_ms();
            if (ratio > most) {
                most = ratio;
                at = point.x;
            }
        }
        text += fmt::format("{}{} {} (at {}){}", text.empty() ? "" : "; ", series.name,
                            short_text(most), at, most >= kTwoOrders ? ", two orders" : "");
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
        short_text(scenes->mean(scenes->boxes)), x, short_text(1e3 * scenes->mean_step_ms()), ratio,
        ratio < 1.0 ? "pays" : "does not pay"));
}

// The growth with the detail, judged against linear and quadratic.
void judge_detail(const StudyTable& table, Findings& findings) {
    const std::optional<PowerLaw> published = published_law(table);
    const double first = table.points.front().x, last = table.points.back().x;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = time_law(table, i, &CrowdTotals::mean_query_ms);
        const CrowdTotals* const low = table.totals_at(first, table.series[i].name);
        const CrowdTotals* const high = table.totals_at(last, table.series[i].name);
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
            table.series[i].name, first, last,
            short_text(high->mean_query_ms() / low->mean_query_ms()), range,
            short_text(high->mean_pairs())));
    }
    if (published) {
        findings.push_back(fmt::format(
            "Published query times grow with the power {:.2f} of the rings, with {} us fixed.",
            published->power, short_text(1e3 * published->fixed)));
    }
}

// Whether the time rises with the radius to a plateau, because all boxes overlap.
void judge_radius(const StudyTable& table, Findings& findings) {
    constexpr double kAlmostAll = 0.95;  // of the pairs
    constexpr double kSame = 1.5;        // ratio of times on a plateau
    const double all = 0.5 * kPublishedCount * (kPublishedCount - 1.0);
    const double first = table.points.front().x, last = table.points.back().x;
    double end = first, full = 0.0;  // radii: the last without and the first with almost all pairs
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

// Ratio of the last measured step to the first of each series.
void add_growth(const StudyTable& table, Findings& findings) {
    std::string text;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const StudyPoint* last = nullptr;
        for (const StudyPoint& point : table.points) {
            if (point.measured[i].queries > 0) last = &point;
        }
        const CrowdTotals& first = table.points.front().measured[i];
        if (last == nullptr || first.queries == 0) continue;
        std::string item =
            fmt::format("{} {}", table.series[i].name,
                        short_text(last->measured[i].mean_step_ms() / first.mean_step_ms()));
        if (last != &table.points.back()) item += fmt::format(" (to {})", last->x);
        add_item(text, item);
    }
    if (text.empty()) return;
    findings.push_back(fmt::format(
        "From {} to {} {} an update and a query together take this many times as long: {}.",
        table.points.front().x, table.points.back().x, table.x_name, text));
}

void add_fastest(const StudyTable& table, Findings& findings) {
    std::string text;
    for (const StudyPoint& point : table.points) {
        const std::size_t fastest = fastest_at(point);
        if (fastest == point.measured.size()) continue;
        add_item(text, fmt::format("{} at {} ({} ms)", table.series[fastest].name, point.x,
                                   short_text(point.measured[fastest].mean_step_ms())));
    }
    if (!text.empty()) findings.push_back("The fastest scheme: " + text + ".");
}

// A scheme needs similar bodies if it falls behind the fastest one as they differ more.
void judge_similarity(const StudyTable& table, Findings& findings) {
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
            add_item(need, fmt::format("{} {} (from {} on)", table.series[i].name,
                                       short_text(*last), *from));
        } else if (last) {
            add_item(need_not, fmt::format("{} {}", table.series[i].name, short_text(*last)));
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
void add_pairs(const StudyTable& table, Findings& findings) {
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

void add_left_out(const StudyTable& table, Findings& findings) {
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

void add_powers(const StudyTable& table, Findings& findings) {
    std::string text;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = time_law(table, i, &CrowdTotals::mean_step_ms);
        if (law) add_item(text, fmt::format("{} {:.2f}", table.series[i].name, law->power));
    }
    if (text.empty()) return;
    findings.push_back(fmt::format(
        "An update and a query together grow with this power of the {}, the fixed cost apart: {}.",
        table.x_name, text));
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
    return findings;
}

}  // namespace terrane::tools
