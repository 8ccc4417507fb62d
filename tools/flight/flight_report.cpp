// SPDX-License-Identifier: MIT
#include "flight/flight_report.h"

#include "assets.h"
#include "output/figures.h"

#include <functional>
#include <span>
#include <utility>

namespace terrane::tools {
namespace {

nlohmann::ordered_json make_data(const FlightLog& log, std::size_t memory_bytes) {
    const std::span<const FrameRecord> frames = log.frames();
    constexpr double kMegabyte = 0x1p20;
    nlohmann::ordered_json data;
    const auto add = [&](const char* name, const std::function<double(const FrameRecord&)>& get) {
        data[name] = thinned(frames, get);
    };
    add("time", [](const FrameRecord& r) { return r.time; });
    add("triangles", [](const FrameRecord& r) { return static_cast<double>(r.triangles); });
    add("error", [](const FrameRecord& r) { return r.error_px; });
    add("update", [](const FrameRecord& r) { return r.update_ms; });
    add("resident", [](const FrameRecord& r) {
        return static_cast<double>(r.paging.resident_bytes) / kMegabyte;
    });
    add("late", [](const FrameRecord& r) { return static_cast<double>(r.paging.late_chunks); });
    if (!frames.empty() && frames.front().measured_error_px) {
        add("measured", [](const FrameRecord& r) { return r.measured_error_px.value_or(0.0); });
        add("pop", [](const FrameRecord& r) { return r.max_pop_px.value_or(0.0); });
    }
    data["budget"] = frames.empty() ? 0 : frames.front().budget;
    data["ceiling"] = static_cast<double>(memory_bytes) / kMegabyte;
    data["extra"] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < log.extra_columns().size(); ++i) {
        data["extra"].push_back(
            {{"name", log.extra_columns()[i]},
             {"title", figure_title(log.extra_columns()[i])},
             {"values", thinned(frames, [i](const FrameRecord& r) { return r.extra[i]; })}});
    }
    return data;
}

}  // namespace

Result<void> write_flight_report(const OutputPlace& place, const ReportHeader& header,
                                 const FlightLog& log, std::size_t memory_bytes) {
    nlohmann::ordered_json data = make_data(log, memory_bytes);
    data["note"] = figure_note("error_px_max", header.summary);
    return write_report(place, header, std::move(data), assets::flight_js);
}

}  // namespace terrane::tools
