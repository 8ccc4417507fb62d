// SPDX-License-Identifier: MIT
#pragma once

#include "flight/report.h"
#include "lab/crowd.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// Number of bodies in the published tables of detail and radius, and in the comparison.
inline constexpr std::size_t kPublishedCount = 20;
/// Published time of a query by sweep-and-prune for bodies of equal size, ms.
inline constexpr double kSweepQueryMs = 3.164;

/// Least-squares slope of log y over log x; absent for fewer than two different x.
std::optional<double> log_log_slope(std::span<const double> x, std::span<const double> y);

/// y = fixed + factor * x^power.
struct PowerLaw {
    double fixed = 0.0;  ///< >= 0: the part that does not depend on x
    double factor = 0.0;
    double power = 0.0;
    double fixed_share = 0.0;  ///< share of `fixed` in the last y

    /// Whether the power is insignificant, because it describes a small part of every y.
    bool is_mostly_fixed() const { return fixed_share > 0.8; }
};

/// The power law with the least sum of squared relative errors; powers up to 3 in steps of 0.005 are tried. Absent for
/// fewer than four points, or if a y is not above 0.
std::optional<PowerLaw> fit_power_law(std::span<const double> x, std::span<const double> y);

/// One point of a table, measured with each of its series.
struct StudyPoint {
    double x = 0.0;
    std::optional<double> published_query_ms;   ///< by sweep-and-prune
    std::optional<double> published_update_ms;  ///< by sweep-and-prune
    CrowdLayout layout;                         ///< of the bodies, except what each series changes
    std::vector<CrowdTotals> measured;  ///< [series] without queries where the point was left out
};

/// A series of a table: its changes to each point's layout.
struct StudySeries {
    std::string name;  ///< of the scheme, or of the kind of bodies
    CrowdScheme scheme = CrowdScheme::sap;
    bool is_dented = false;
    /// Share of the room's volume that the spheres fill; above 0, the series has a room of its own.
    double own_room_share = 0.0;
};

/// A point that was not measured with a series, because of its estimated time.
struct LeftOut {
    double x = 0.0;
    std::string series;
    double seconds = 0.0;  ///< estimated time of kFewestQueries queries
};

/// Cost of a query as a function of one parameter.
struct StudyTable {
    std::string key;
    std::string title;
    std::string x_name;
    std::string text;  ///< what was held fixed
    std::vector<StudySeries> series;
    std::vector<StudyPoint> points = {};
    std::vector<LeftOut> left_out = {};
    double most_seconds = 0.0;  ///< StudySettings::most_seconds_a_point

    /// The measurement at x with a series, or null.
    const CrowdTotals* totals_at(double x, std::string_view series_name) const;
};

/// Extent of a study.
struct StudySettings {
    /// Least time of a point's queries, seconds. For points of up to 1000 bodies it is divided into five rounds over
    /// all such points, whose medians are reported.
    double seconds_a_point = 0.3;
    /// A series leaves out a point of more than 1000 bodies if kFewestQueries are estimated to take longer than this,
    /// seconds.
    double most_seconds_a_point = 30.0;
    std::size_t most_bodies = 1'000'000;
    std::uint64_t seed = 1;
};

/// Least number of queries measured for each point and series.
inline constexpr std::size_t kFewestQueries = 5;

/// The tables of the published study of many bodies (SWIFT++), without measurements: by count, detail and radius, for
/// bodies of equal size, and to the limits of the study's conclusion ("bodies of similar size and aspect").
std::vector<StudyTable> make_study_tables(const StudySettings& settings);

/// Measures tables one after another, with the library's broadphases and the study's.
///
/// @param show called with the completed share, 0 to 1
/// @return incomplete tables if is_interrupted()
std::vector<StudyTable> measure_tables(std::vector<StudyTable> tables,
                                       const StudySettings& settings,
                                       const std::function<void(double)>& show);

/// Estimates the time of a step (an update and a query) of many bodies from measured steps of fewer.
class StepTimes {
public:
    /// Records the time of a step, seconds, for a number of bodies of a kind: a scheme and a layout except its count.
    void add(const std::string& kind, std::size_t bodies, double seconds);

    /// Extrapolates from the kind's largest count below `bodies`. The power, 1 to 2, is that between the kind's two
    /// largest such counts. If the kind has only one, the power is taken from `similar`; if that has fewer than two,
    /// the power is 2. Absent if the kind has none.
    std::optional<double> seconds_at(const std::string& kind, const std::string& similar,
                                     std::size_t bodies) const;

private:
    std::optional<double> power_at(const std::string& kind, std::size_t bodies) const;

    std::map<std::string, std::map<std::size_t, double>> seconds_;
};

/// Log-log slope of a series' query times; absent for fewer than two points with candidate pairs, because without pairs
/// the time is only overhead.
std::optional<double> query_slope(const StudyTable& table, std::size_t series,
                                  bool is_published_only);

/// A mean time of a series, such as &CrowdTotals::mean_step_ms, as a power law plus a fixed cost.
std::optional<PowerLaw> time_law(const StudyTable& table, std::size_t series,
                                 double (CrowdTotals::*time)() const);

/// A number with three significant digits, without an exponent for usual sizes: "1230", "0.0456".
std::string short_text(double value);

/// The smallest ratio over all points of the published query time to that of the fastest series; absent without
/// published times.
std::optional<double> least_speedup(const StudyTable& table);

/// A published time and the measured one.
struct Comparison {
    std::string what;  ///< "query, sweep-and-prune, 20 bodies"
    double published_ms = 0.0;
    double our_ms = 0.0;
    std::string reason;  ///< why they differ, with figures of this run
};

/// Every published time of a table with the measured one of the same scheme: sweep-and-prune, and for bodies of equal
/// size the grid of centroids, beside the dense grid. Empty for a table without published times.
///
/// The machine of the published study is unknown: its speed is an unknown factor, common to all ratios.
std::vector<Comparison> compare_with_published(const StudyTable& table);

/// Sentences about a measured table, with its figures: which published claims the measurement confirms, and from which
/// number of bodies, size or aspect on it contradicts them. Depends only on the table.
std::vector<std::string> study_findings(const StudyTable& table);

/// A table in the form of the report's script and of `--json`, with its slopes, findings and comparisons.
nlohmann::ordered_json to_json(const StudyTable& table);

/// All tables in Markdown: fixed parameters, published and measured times with the reason for their difference,
/// findings, and every figure. Ready to be pasted into a document.
std::string study_markdown(std::span<const StudyTable> tables);

/// Writes the report of the study of many bodies: for each table its text, measured and published times, a log-log
/// plot, and the share of positive queries.
///
/// Fails with io, naming the path.
Result<void> write_study_report(const OutputPlace& place, const ReportHeader& header,
                                std::span<const StudyTable> tables);

}  // namespace terrane::tools
