// SPDX-License-Identifier: MIT
#pragma once

#include "flight/flight_log.h"

#include <nlohmann/json.hpp>

#include <span>
#include <string>

namespace terrane::tools {

/// What a report says beside its plots.
struct ReportHeader {
    std::string title;         ///< "Flight over jacksboro.tif"
    std::string command_line;  ///< that made it
    std::string film;          ///< a file beside the report, such as flight.mp4; "" for none
    nlohmann::ordered_json summary;
};

/// Writes one HTML page with everything in it, plots' library included, that opens without a network:
/// triangles against the budget, error, update time, resident bytes against the ceiling, late chunks,
/// one plot for each extra column, the summary, and the command line. Long flights are thinned to
/// about two thousand points, of which each is the largest of its share.
///
/// Fails with io, naming the path; no half page is left.
Result<void> write_report(const std::string& path, const ReportHeader& header, const FlightLog& log,
                          std::size_t memory_bytes);

/// The command line that this process was started with, as a person would type it again; "terrane"
/// where the system does not tell.
std::string own_command_line();

}  // namespace terrane::tools
