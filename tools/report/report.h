// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace terrane::tools {

/// What a report says beside its plots.
struct ReportHeader {
    std::string title;         ///< "Flight over jacksboro.tif"
    std::string command_line;  ///< that made it
    std::string film;          ///< a file beside the report, such as flight.mp4; "" for none
    nlohmann::ordered_json summary;
};

/// Writes one HTML page with everything in it, plots' library included, that opens without a network.
///
/// @param data   what the script reads, but for the summary, which is added to it
/// @param script what fills the page, on top of report.js: one of the assets
///
/// Fails with io, naming the place; no half page is left.
Result<void> write_report(const OutputPlace& place, const ReportHeader& header,
                          nlohmann::ordered_json data, std::string_view script);

/// A value of each frame, thinned where there are more than about two thousand: each is then the
/// largest of its share.
nlohmann::ordered_json thinned(std::span<const FrameRecord> frames,
                               const std::function<double(const FrameRecord&)>& get);

/// The command line that this process was started with, as a person would type it again; "terrane"
/// where the system does not tell.
std::string own_command_line();

}  // namespace terrane::tools
