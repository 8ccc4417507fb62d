// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"
#include "report/report.h"

#include <cstddef>
#include <string>

namespace terrane::tools {

/// Writes the report of one flight: triangles and budget, error, update time, resident bytes and ceiling, late chunks,
/// one plot for each extra column, the summary, and the command line.
///
/// Fails with io, naming the path.
Result<void> write_flight_report(const OutputPlace& place, const ReportHeader& header,
                                 const FlightLog& log, std::size_t memory_bytes);

}  // namespace terrane::tools
