// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace terrane::extremes {

/// One end of a range: a value that is accepted and one beyond it that is refused. find_end() finds where between them
/// the range ends.
struct RangeEnd {
    double accepted = 0.0;  ///< inside the range
    double refused = 0.0;   ///< outside it
    bool is_whole = false;  ///< only whole numbers are asked
    std::string message{};  ///< what the refusal has to contain: the name of the thing
};

/// A quantity that is swept from one end of its range to the other: what is promised, what is measured at each value,
/// and how values beyond the range are refused.
struct ExtremeRow {
    std::string name{};     ///< as a test's parameter is named
    std::string topic{};    ///< a heading of the table
    std::string swept{};    ///< what the values are, with their unit
    std::string promise{};  ///< one sentence
    std::string figure{};   ///< what is measured, with its unit
    /// The promise holds where the figure is at most this. NaN and infinity break every promise.
    double limit = 1.0;
    std::vector<double> values{};       ///< measured in seconds
    std::vector<double> long_values{};  ///< measured in minutes; beyond `values`
    /// The figure at a value that is accepted. Pure: the same bits in every call.
    std::function<double(double)> measure{};
    /// Why a value is refused, one sentence or the name of a status; empty where it is accepted. Cheap.
    std::function<std::string(double)> refusal{};
    std::vector<RangeEnd> ends{};  ///< from the lowest to the highest
    std::string note{};            ///< what else limits it, one sentence; may be empty
};

/// Where a range ends.
struct FoundEnd {
    double last_accepted = 0.0;  ///< next to `first_refused`, as doubles or as whole numbers
    double first_refused = 0.0;
    std::string message;      ///< of `first_refused`
    std::string far_message;  ///< of RangeEnd::refused
};

/// The neighbouring pair of values between which a range ends, by bisection of the values that lie between the two of
/// `end`.
FoundEnd find_end(const ExtremeRow& row, const RangeEnd& end);

/// Whether a figure keeps a row's promise.
bool keeps_promise(const ExtremeRow& row, double figure);

/// All rows, in the order of the table.
const std::vector<ExtremeRow>& all_rows();

/// Rows of spacing, places, heights and slopes of the ground.
std::vector<ExtremeRow> ground_rows();
/// Rows of the size of a world.
std::vector<ExtremeRow> world_rows();
/// Rows of speeds, steps and casts.
std::vector<ExtremeRow> motion_rows();
/// Rows of sizes, masses, places and numbers of bodies.
std::vector<ExtremeRow> body_rows();
/// Rows of fields of view, viewpoints and budgets.
std::vector<ExtremeRow> view_rows();
/// Rows of long simulations.
std::vector<ExtremeRow> time_rows();

/// What was measured of a row.
struct MeasuredRow {
    const ExtremeRow* row = nullptr;
    std::vector<double> values;   ///< as they were measured
    std::vector<double> figures;  ///< [values.size()]
    std::vector<FoundEnd> ends;   ///< [row->ends.size()]
};

/// Measures a row.
///
/// @param is_long the values that take minutes too
/// @param begins  called with each value before it is measured; may be empty
MeasuredRow measure(const ExtremeRow& row, bool is_long,
                    const std::function<void(double)>& begins = {});

/// A number of the table: three significant digits, "1e-06" for instance.
std::string figure_text(double value);

/// The table as in docs/measurements.md, chapter Extremes; ends with a line feed.
std::string to_markdown(std::span<const MeasuredRow> rows);

}  // namespace terrane::extremes
