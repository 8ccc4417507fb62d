// SPDX-License-Identifier: MIT
#pragma once

#include "extremes/extreme_row.h"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace terrane::extremes {

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

/// The table as one JSON object; figures that are not finite are null.
std::string to_json(std::span<const MeasuredRow> rows);

}  // namespace terrane::extremes
