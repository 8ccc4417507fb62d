// SPDX-License-Identifier: MIT
#include "frames/flight_log.h"

#include "frames/verification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace terrane::tools {
namespace {

template <class Number>
std::string number_or_nothing(const std::optional<Number>& value) {
    return value ? fmt::format("{}", *value) : "";
}

std::string header(std::span<const std::string> extra_columns) {
    std::string line =
        "time_s,eye_x_m,eye_y_m,eye_z_m,triangles,budget,error_px,measured_error_px,update_ms,"
        "chunks_resident,resident_bytes,late_chunks,max_pop_px,"
        "status,threshold_px,max_pop_elsewhere_px,points,holes,in_flight_bytes,chunks_loaded,"
        "chunks_evicted,late,solid_triangles,max_solid_pop_px,draw_ms,objects_drawn,objects_culled,"
        "objects_left_out,object_triangles,objects_ms,objects_occluded,gpu_ms";
    for (const std::string& name : extra_columns) line += "," + name;
    return line + "\n";
}

std::string csv_line(const FrameRecord& r) {
    std::string line = fmt::format(
        "{},{},{},{},{},{},{},{},{:.4f},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}"
        ","
        "{:.4f},{},{}",
        r.time, r.eye_world.x(), r.eye_world.y(), r.eye_world.z(), r.triangles, r.budget,
        r.error_px, number_or_nothing(r.measured_error_px), r.update_ms, r.paging.resident_chunks,
        r.paging.resident_bytes, r.paging.late_chunks, number_or_nothing(r.max_pop_px),
        name_of(r.status), r.threshold_px, number_or_nothing(r.max_pop_elsewhere_px),
        number_or_nothing(r.points), number_or_nothing(r.holes), r.paging.in_flight_bytes,
        r.paging.loaded, r.paging.evicted, r.is_late() ? 1 : 0, r.solid_triangles,
        number_or_nothing(r.max_solid_pop_px), r.draw_ms ? fmt::format("{:.4f}", *r.draw_ms) : "",
        r.objects_drawn, r.objects_culled, r.objects_left_out, r.object_triangles, r.objects_ms,
        r.objects_occluded, r.gpu_ms ? fmt::format("{:.4f}", *r.gpu_ms) : "");
    for (const double value : r.extra) line += fmt::format(",{}", value);
    return line + "\n";
}

template <class Get>
std::vector<double> values_of(std::span<const FrameRecord> frames, Get get) {
    std::vector<double> values;
    values.reserve(frames.size());
    for (const FrameRecord& frame : frames) values.push_back(static_cast<double>(get(frame)));
    return values;
}

double largest(const std::vector<double>& values) {
    return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

/// Adds the statistics of scene objects to the summary.
void add_objects(std::span<const FrameRecord> frames, nlohmann::ordered_json& summary) {
    const auto most = [&](auto&& get) {
        return static_cast<std::size_t>(largest(values_of(frames, get)));
    };
    summary["objects_drawn_max"] = most([](const FrameRecord& r) { return r.objects_drawn; });
    summary["objects_left_out_max"] = most([](const FrameRecord& r) { return r.objects_left_out; });
    summary["objects_occluded_max"] = most([](const FrameRecord& r) { return r.objects_occluded; });
    summary["object_triangles_max"] = most([](const FrameRecord& r) { return r.object_triangles; });
    const auto ms = values_of(frames, [](const FrameRecord& r) { return r.objects_ms; });
    summary["objects_ms_median"] = percentile(ms, 0.5);
    summary["objects_ms_max"] = largest(ms);
}

}  // namespace

Result<FlightLog> FlightLog::create(const std::optional<OutputPlace>& csv,
                                    std::vector<std::string> extra_columns) {
    FlightLog log;
    log.extra_columns_ = std::move(extra_columns);
    if (!csv) return log;
    TERRANE_TRY(OutputFile file, OutputFile::create(*csv));
    log.csv_.emplace(std::move(file));
    log.csv_->write(header(log.extra_columns_));
    return log;
}

Result<void> FlightLog::add(FrameRecord record) {
    frames_.push_back(std::move(record));
    if (!csv_) return {};
    csv_->write(csv_line(frames_.back()));
    return csv_->check();
}

Result<void> FlightLog::commit() { return csv_ ? csv_->commit() : Result<void>{}; }

double percentile(std::vector<double> values, double share) {
    if (values.empty()) return 0.0;
    const double rank = std::ceil(share * static_cast<double>(values.size())) - 1.0;
    const double last = static_cast<double>(values.size() - 1);
    const auto index = static_cast<std::ptrdiff_t>(std::clamp(rank, 0.0, last));
    std::nth_element(values.begin(), values.begin() + index, values.end());
    return values[static_cast<std::size_t>(index)];
}

ExcessError add_up_excess_error(std::span<const FrameRecord> frames, double fps) {
    ExcessError sum;
    for (const FrameRecord& frame : frames) {
        const double excess = frame.excess_error_px() / fps;
        sum.all_px_s += excess;
        if (frame.is_late()) sum.late_px_s += excess;
    }
    return sum;
}

nlohmann::ordered_json summarize(std::span<const FrameRecord> frames, std::size_t memory_bytes,
                                 double fps) {
    const auto triangles = values_of(frames, [](const FrameRecord& r) { return r.triangles; });
    const auto errors = values_of(frames, [](const FrameRecord& r) { return r.error_px; });
    const auto updates = values_of(frames, [](const FrameRecord& r) { return r.update_ms; });
    const auto late = values_of(frames, [](const FrameRecord& r) { return r.paging.late_chunks; });
    const auto count_if = [&](auto&& is_so) {
        return static_cast<std::size_t>(std::count_if(frames.begin(), frames.end(), is_so));
    };

    nlohmann::ordered_json summary;
    summary["frames"] = frames.size();
    summary["triangles_max"] = static_cast<std::size_t>(largest(triangles));
    summary["triangles_median"] = static_cast<std::size_t>(percentile(triangles, 0.5));
    summary["budget"] = frames.empty() ? 0 : frames.front().budget;
    summary["over_budget_frames"] =
        count_if([](const FrameRecord& r) { return r.triangles > r.budget; });
    summary["error_px_median"] = percentile(errors, 0.5);
    summary["error_px_max"] = largest(errors);
    if (!frames.empty() && frames.front().measured_error_px) {
        summary["measured_error_px_max"] =
            largest(values_of(frames, [](const FrameRecord& r) { return *r.measured_error_px; }));
        summary["uncertified_frames"] =
            count_if([](const FrameRecord& r) { return *r.measured_error_px > r.error_px; });
        summary["max_pop_px"] =
            largest(values_of(frames, [](const FrameRecord& r) { return *r.max_pop_px; }));
        summary["pop_frames"] =
            count_if([](const FrameRecord& r) { return *r.max_pop_px > kPopLimit_px; });
        summary["max_pop_elsewhere_px"] = largest(values_of(
            frames, [](const FrameRecord& r) { return r.max_pop_elsewhere_px.value_or(0.0); }));
        if (count_if([](const FrameRecord& r) { return r.solid_triangles > 0; }) > 0) {
            summary["max_solid_pop_px"] = largest(values_of(
                frames, [](const FrameRecord& r) { return r.max_solid_pop_px.value_or(0.0); }));
        }
        const auto points =
            values_of(frames, [](const FrameRecord& r) { return r.points.value_or(0); });
        summary["points_min"] =
            static_cast<std::size_t>(*std::min_element(points.begin(), points.end()));
        summary["holes"] = static_cast<std::size_t>(
            largest(values_of(frames, [](const FrameRecord& r) { return *r.holes; })));
    }
    summary["update_ms_median"] = percentile(updates, 0.5);
    summary["update_ms_p99"] = percentile(updates, 0.99);
    summary["update_ms_max"] = largest(updates);
    if (!frames.empty() && frames.front().draw_ms) {
        summary["draw_ms_median"] = percentile(
            values_of(frames, [](const FrameRecord& r) { return r.draw_ms.value_or(0.0); }), 0.5);
    }
    std::vector<double> gpu_times;
    for (const FrameRecord& frame : frames) {
        if (frame.gpu_ms) gpu_times.push_back(*frame.gpu_ms);
    }
    if (!gpu_times.empty()) summary["gpu_ms_median"] = percentile(std::move(gpu_times), 0.5);
    if (!frames.empty() && frames.front().has_objects) add_objects(frames, summary);
    summary["late_frames"] = count_if([](const FrameRecord& r) { return r.is_late(); });
    const ExcessError excess = add_up_excess_error(frames, fps);
    summary["excess_error_px_s"] = excess.all_px_s;
    summary["late_excess_error_px_s"] = excess.late_px_s;
    summary["late_chunks_max"] = static_cast<std::size_t>(largest(late));
    summary["not_resident_frames"] =
        count_if([](const FrameRecord& r) { return r.status == MeshStatus::not_resident; });
    summary["chunks_resident_max"] = static_cast<std::size_t>(
        largest(values_of(frames, [](const FrameRecord& r) { return r.paging.resident_chunks; })));
    summary["peak_bytes"] = static_cast<std::size_t>(
        largest(values_of(frames, [](const FrameRecord& r) { return r.paging.peak_bytes; })));
    summary["memory_bytes"] = memory_bytes;
    if (!frames.empty()) {
        const PagerStats& last = frames.back().paging;
        summary["chunks_loaded"] = last.loaded;
        summary["chunks_evicted"] = last.evicted;
        summary["chunks_cancelled"] = last.cancelled;
        summary["loads_failed"] = last.failed;
        summary["over_ceiling"] = last.over_ceiling;
    }
    return summary;
}

}  // namespace terrane::tools
