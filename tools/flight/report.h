// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace terrane::tools {

/// The command line of this process, quoted for a shell; "terrane" if the system does not provide it.
std::string own_command_line();

/// Texts and summary of a report.
struct ReportHeader {
    std::string title;  ///< "Flight over jacksboro.tif"
    std::string command_line = own_command_line();
    std::string film = {};  ///< a file beside the report, such as flight.mp4; "" for none
    nlohmann::ordered_json summary;
};

/// Writes a self-contained HTML page that includes the plot library and needs no network.
///
/// @param data   input of the script; the summary is added to it
/// @param script one of the assets, which creates the content with the functions of report.js
///
/// Fails with io, naming the path; leaves no incomplete page.
Result<void> write_report(const OutputPlace& place, const ReportHeader& header,
                          nlohmann::ordered_json data, std::string_view script);

/// One value per frame; more than about 2000 frames are grouped, with the largest value of each group.
nlohmann::ordered_json thinned(std::span<const FrameRecord> frames,
                               const std::function<double(const FrameRecord&)>& get);

/// Writes the report of one flight: triangles and budget, error, update time, resident bytes and ceiling, late chunks,
/// one plot for each extra column, the summary, and the command line.
///
/// Fails with io, naming the path.
Result<void> write_flight_report(const OutputPlace& place, const ReportHeader& header,
                                 const FlightLog& log, std::size_t memory_bytes);

}  // namespace terrane::tools
