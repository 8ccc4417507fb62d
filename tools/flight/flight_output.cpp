// SPDX-License-Identifier: MIT
#include "flight/flight_output.h"

#include "report/flight_report.h"

#include <utility>

namespace terrane::tools {

FlightOutput::FlightOutput(const FlightOptions& options, FlightLog log)
    : options_(options), log_(std::move(log)) {}

Result<FlightOutput> FlightOutput::create(const FlightOptions& options, const HeightSource& source,
                                          std::vector<std::string> extra_columns) {
    const bool has_folder = !options.out.empty();
    if (has_folder) {
        const Result<void> ready = prepare_output_folder(options.out);
        if (!ready) return tl::unexpected(ready.error());
    }
    Result<FlightLog> log =
        FlightLog::create(has_folder ? options.out + "/frames.csv" : "", std::move(extra_columns));
    if (!log) return tl::unexpected(log.error());
    FlightOutput output(options, std::move(*log));
    if (options.has_pictures()) {
        Result<FlightPictures> pictures = FlightPictures::create(options, source);
        if (!pictures) return tl::unexpected(pictures.error());
        output.pictures_.emplace(std::move(*pictures));
    }
    return output;
}

Result<void> FlightOutput::add(MadeFrame frame, const View& view,
                               std::span<const DrawnObject> objects) {
    if (pictures_) {
        const Result<void> drawn = pictures_->add(log_.frames().size(), frame.mesh, view, objects);
        if (!drawn) return drawn;
    }
    return log_.add(std::move(frame.record));
}

Result<void> FlightOutput::finish(const std::string& title, nlohmann::ordered_json& summary) {
    summary["renderer"] = pictures_ ? pictures_->renderer_name() : "none";
    if (pictures_) summary["samples"] = pictures_->sample_count();
    if (options_.out.empty()) return {};
    summary["out"] = options_.out;
    if (pictures_) {
        if (const Result<void> ended = pictures_->finish(); !ended) return ended;
    }
    if (const Result<void> ended = log_.commit(); !ended) return ended;
    return write_flight_report(options_.out + "/report.html",
                               {.title = title,
                                .command_line = own_command_line(),
                                .film = options_.video ? kFilmName : "",
                                .summary = summary},
                               log_, options_.memory_bytes());
}

}  // namespace terrane::tools
