// SPDX-License-Identifier: MIT
#include "crowd/study/study_comparison.h"

#include "crowd/study/study_plans.h"

#include <fmt/format.h>

namespace terrane::tools {
namespace {

// The series of the scheme that the published times are of.
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

// Of a table whose x is the number of bodies.
std::string reason_of_bodies(const StudyPoint& point, const CrowdTotals& ours) {
    const double published_us = 1e3 * *point.published_query_ms / point.x;
    if (point.x < 2.0) {
        return fmt::format(
            "One body has no pair: ours is an empty list of pairs, the published {:.0f} us are a "
            "cost of the body itself.",
            published_us);
    }
    return fmt::format(
        "Published are {:.0f} us for each body; ours tests nothing but the pairs whose boxes "
        "overlap, {} of {:.0f} in a query.",
        published_us, short_text(ours.mean_pairs()), 0.5 * point.x * (point.x - 1.0));
}

// Of a table whose x is a property of 20 bodies: compares the growth since the first published point.
std::string reason_of_change(const StudyTable& table, const StudyPoint& point,
                             const CrowdTotals& ours) {
    const StudyPoint& first = *first_published(table);
    const CrowdTotals* const at_first = table.totals_at(first.x, published_series(table));
    if (&point == &first || at_first == nullptr) {
        return reason_of_bodies({.x = kPublishedCount,
                                 .published_query_ms = point.published_query_ms,
                                 .published_update_ms = {},
                                 .measured = {}},
                                ours);
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
                                   is_of_bodies ? reason_of_bodies(point, *ours)
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

void judge_grids(const StudyTable& table, std::vector<std::string>& findings) {
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

}  // namespace terrane::tools
