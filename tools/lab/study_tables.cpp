// SPDX-License-Identifier: MIT
//
// Sources:
//   S. Ehmann, M. Lin. Accurate and fast proximity queries between polyhedra using convex surface
//   decomposition. Eurographics 2001 (SWIFT++, which the published study measured).
#include "lab/study.h"

#include <algorithm>
#include <span>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kPublishedRoom =
    80.0;  // metres: 40 cells of the dense grid, each as wide as a body
// Published updates of 1 and of 50 bodies, and of bodies of equal size, ms.
constexpr double kFirstUpdateMs = 0.024, kLastUpdateMs = 0.149, kSweepUpdateMs = 0.099;

// A value of a table's parameter, with the published query time, ms, if there is one.
struct Published {
    double x;
    std::optional<double> ms = {};
};

constexpr Published kOfCount[] = {{1, 0.167},  {5, 0.734},  {10, 1.611}, {15, 2.131},
                                  {20, 3.234}, {25, 3.894}, {30, 5.01},  {35, 5.783},
                                  {40, 6.812}, {45, 7.558}, {50, 8.915}};
constexpr Published kOfMany[] = {{100},    {300},     {1000},    {3000},     {10'000},
                                 {30'000}, {100'000}, {300'000}, {1'000'000}};
constexpr Published kOfDetail[] = {{2, 2.932},  {5, 3.699},  {10, 4.375}, {15, 5.002},
                                   {20, 5.067}, {25, 5.475}, {35, 7.121}};
constexpr Published kOfRadius[] = {{0.5, 3.012}, {1, 3.164}, {2, 3.19}, {3, 3.215},
                                   {5, 3.324},   {8},        {12},      {16},
                                   {20},         {24},       {28},      {32}};
constexpr Published kOfEqual[] = {{1}, {kPublishedCount, kSweepQueryMs}, {100}, {1000}};
// Ratios of sizes or aspects; fewer for large counts, which take long.
constexpr Published kOfRatio[] = {{1}, {3}, {10}, {30}, {100}}, kOfLongRatio[] = {{1}, {10}, {100}};
constexpr std::size_t kConclusionCounts[] = {1000, 100'000, 1'000'000};

constexpr CrowdScheme kLibrary[] = {CrowdScheme::sap, CrowdScheme::grid, CrowdScheme::two_scene,
                                    CrowdScheme::hashed};
constexpr CrowdScheme kAll[] = {CrowdScheme::sap,    CrowdScheme::grid,  CrowdScheme::two_scene,
                                CrowdScheme::hashed, CrowdScheme::dense, CrowdScheme::centroid,
                                CrowdScheme::brute};
constexpr CrowdScheme kWithDense[] = {CrowdScheme::sap,       CrowdScheme::grid,
                                      CrowdScheme::two_scene, CrowdScheme::hashed,
                                      CrowdScheme::dense,     CrowdScheme::centroid};

std::vector<StudySeries> series_of(std::span<const CrowdScheme> schemes) {
    std::vector<StudySeries> series;
    for (const CrowdScheme scheme : schemes) {
        series.push_back({.name = std::string(to_string(scheme)), .scheme = scheme});
    }
    return series;
}

// Adds points to a table, up to the first one with more than StudySettings::most_bodies.
//
// @param set sets the parameter of a layout
template <class Set>
StudyTable with_points(StudyTable table, const StudySettings& settings, CrowdLayout layout,
                       std::span<const Published> points, const Set& set) {
    layout.seed = settings.seed;
    for (const Published& each : points) {
        set(layout, each.x);
        if (layout.count > settings.most_bodies) break;
        table.points.push_back({each.x, each.ms, {}, layout, {}});
    }
    return table;
}

void set_count(CrowdLayout& layout, double x) { layout.count = static_cast<std::size_t>(x); }

// The published tables.
std::vector<StudyTable> published_tables(const StudySettings& settings) {
    constexpr double kCrowded = 0.2;
    CrowdLayout layout;
    layout.count = kPublishedCount;
    layout.room = kPublishedRoom;
    CrowdLayout growing = layout, equal = layout;
    growing.room = 0.0;
    equal.detail_deviation = 0.0;
    std::vector<StudyTable> tables{
        with_points(
            {.key = "count",
             .title = "Bodies in the published room",
             .x_name = "bodies",
             .text = "A cube of 80 m with walls that bodies bounce from; radius 1 m, detail "
                     "uniform with mean 3 and deviation 1. Boxes are part of an update. Two scenes "
                     "compute exact boxes for pairs of overlapping cubes only.",
             .series = series_of(kWithDense)},
            settings, layout, kOfCount, set_count),
        with_points({.key = "many",
                     .title = "Many bodies",
                     .x_name = "bodies",
                     .text = "The room grows with the bodies, whose spheres always take 2 % of it: "
                             "each has the same few neighbours.",
                     .series = series_of(kAll)},
                    settings, growing, kOfMany, set_count),
        with_points(
            {.key = "detail",
             .title = "Detail of 20 bodies",
             .x_name = "rings of corners",
             .text = "A body of detail d has d rings of 2 d corners, and deviation 1 in d, at "
                     "least 2 rings. Convex and dented bodies move in the published room of 80 m, "
                     "where they seldom meet; crowded ones fill a fifth of a room of their own, so "
                     "that many pairs reach the corners. Dented bodies are closed meshes that are "
                     "not convex: 2 d convex segments, every second one of 0.7 of the radius.",
             .series =
                 {{.name = "convex"},
                  {.name = "dented", .is_dented = true},
                  {.name = "convex, crowded", .own_room_share = kCrowded},
                  {.name = "dented, crowded", .is_dented = true, .own_room_share = kCrowded}}},
            settings, layout, kOfDetail, [](CrowdLayout& of, double x) { of.detail = x; }),
        with_points({.key = "radius",
                     .title = "Radius of 20 bodies in one room",
                     .x_name = "metres",
                     .text = "The room stays 80 m wide while the bodies grow until they fill it "
                             "and most of them overlap.",
                     .series = series_of(kLibrary)},
                    settings, layout, kOfRadius, [](CrowdLayout& of, double x) { of.radius = x; }),
        with_points(
            {.key = "equal",
             .title = "Bodies of equal size in the published room",
             .x_name = "bodies",
             .text = "All bodies have the same mesh. Published for 20 bodies: 3.164 ms a "
                     "query with 0.099 ms an update by sweep-and-prune, 0.527 ms with 65 ms "
                     "an update by a dense grid of 40^3 cells, each of which had to be "
                     "cleared; it put each body into the cell of its centre and compared spheres, "
                     "as the grid of centroids does.",
             .series = series_of(kWithDense)},
            settings, equal, kOfEqual, set_count)};
    tables[0].points.front().published_update_ms = kFirstUpdateMs;
    tables[0].points.back().published_update_ms = kLastUpdateMs;
    for (StudyPoint& point : tables[4].points) {
        if (point.published_query_ms) point.published_update_ms = kSweepUpdateMs;
    }
    return tables;
}

// The published conclusion is about bodies of similar size and aspect; in these three tables sizes or aspects differ.
std::vector<StudyTable> conclusion_tables(const StudySettings& settings, std::size_t count) {
    const std::string bodies = std::to_string(count);
    const auto over_ratios = [&](const char* key, std::string title, const char* x_name,
                                 const char* text, double CrowdLayout::*changed,
                                 double size_power) {
        CrowdLayout layout;
        layout.count = count;
        layout.size_power = size_power;
        return with_points({.key = key + bodies,
                            .title = std::move(title),
                            .x_name = x_name,
                            .text = text,
                            .series = series_of(kAll)},
                           settings, layout,
                           count > 100'000 ? std::span<const Published>(kOfLongRatio) : kOfRatio,
                           [changed](CrowdLayout& of, double x) { of.*changed = x; });
    };
    return {over_ratios("spread_", "Sizes that differ: " + bodies + " bodies",
                        "largest over smallest radius",
                        "100 radii in equal ratios around 1 m; spheres take 2 % of the room.",
                        &CrowdLayout::size_spread, 0.0),
            over_ratios("fragments_", "Few large bodies among many small ones: " + bodies,
                        "largest over smallest radius",
                        "Bodies of at least a radius are as many as its power of -2.5, as "
                        "fragments are; spheres take 2 % of the room.",
                        &CrowdLayout::size_spread, 2.5),
            over_ratios("aspect_", "Long bodies: " + bodies + " bodies", "length over width",
                        "Spheres of radius 1 m around the bodies take 2 % of the room: long bodies "
                        "fill less and less of their spheres.",
                        &CrowdLayout::aspect, 0.0)};
}

}  // namespace

std::vector<StudyTable> make_study_tables(const StudySettings& settings) {
    std::vector<StudyTable> tables = published_tables(settings);
    for (const std::size_t count : kConclusionCounts) {
        for (StudyTable& table : conclusion_tables(settings, count)) {
            tables.push_back(std::move(table));
        }
    }
    std::erase_if(tables, [](const StudyTable& table) { return table.points.empty(); });
    return tables;
}

}  // namespace terrane::tools
