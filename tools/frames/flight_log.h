// SPDX-License-Identifier: MIT
#pragma once

#include "program/output_file.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// Measurements of one frame of a flight.
struct FrameRecord {
    double time = 0.0;  ///< seconds of the flight
    WorldPos eye_world = WorldPos::Zero();
    std::size_t triangles = 0;
    std::size_t budget = 0;
    double error_px = 0.0;
    double max_error_px = 1.0;  ///< the target
    double threshold_px = 0.0;
    MeshStatus status = MeshStatus::not_resident;
    bool is_from_device = false;  ///< whether the GPU made the mesh
    double update_ms = 0.0;       ///< of Pager::update, Triangulator::update and objects together
    PagerStats paging;
    std::size_t solid_triangles = 0;          ///< of volumes
    std::optional<double> measured_error_px;  ///< only with --verify, as the next five
    std::optional<double> max_pop_px;
    std::optional<double> max_pop_elsewhere_px;
    std::optional<std::size_t> points;
    std::optional<std::size_t> holes;
    std::optional<double> max_solid_pop_px;
    std::optional<double> draw_ms;  ///< until the picture can be read, if one is drawn
    /// Device time of triangulation and drawing, as last reported: of this frame, or of one of the three before it.
    /// None if nothing is drawn
    std::optional<double> gpu_ms;
    bool has_objects = false;  ///< whether a scene has objects; otherwise the next six are 0
    std::size_t objects_drawn = 0;
    std::size_t objects_culled = 0;    ///< out of view
    std::size_t objects_left_out = 0;  ///< in view, but not drawn at the threshold
    std::size_t objects_occluded = 0;  ///< behind the ground
    std::size_t object_triangles = 0;  ///< included in `triangles`
    double objects_ms = 0.0;           ///< included in `update_ms`
    std::vector<double> extra;         ///< values of FlightLog's extra columns

    /// Whether a needed chunk is not resident, and the error is above the target or nothing is drawn.
    bool is_late() const {
        return status == MeshStatus::not_resident && (error_px > max_error_px || triangles == 0);
    }
    /// Adds a part of gpu_ms, if it is known.
    void add_gpu_ms(std::optional<double> ms) {
        if (ms) gpu_ms = gpu_ms.value_or(0.0) + *ms;
    }
    double excess_error_px() const { return std::max(0.0, error_px - max_error_px); }
};

/// File names in an output folder.
inline constexpr const char* kFramesName = "frames.csv";
inline constexpr const char* kReportName = "report.html";

/// Integrals of the excess error over time, pixel seconds.
struct ExcessError {
    double all_px_s = 0.0;   ///< over all frames
    double late_px_s = 0.0;  ///< over the late frames
};
/// Each frame lasts 1 / fps.
ExcessError add_up_excess_error(std::span<const FrameRecord> frames, double fps);

/// Collects the frames of a flight and appends them to frames.csv, which is renamed to its final name by commit().
class FlightLog {
public:
    /// @param csv           place of frames.csv; absent if no file is written
    /// @param extra_columns names of the values of FrameRecord::extra
    ///
    /// Fails with io if the file cannot be created.
    static Result<FlightLog> create(const std::optional<OutputPlace>& csv,
                                    std::vector<std::string> extra_columns = {});

    /// Fails with io if writing fails, for instance on a full disk.
    Result<void> add(FrameRecord record);
    /// Completes the file. Fails with io.
    Result<void> commit();

    std::span<const FrameRecord> frames() const { return frames_; }
    std::span<const std::string> extra_columns() const { return extra_columns_; }

private:
    FlightLog() = default;

    std::optional<OutputFile> csv_;
    std::vector<std::string> extra_columns_;
    std::vector<FrameRecord> frames_;
};

/// The summary that scripts read: counts, medians and maxima over frames.
///
/// @param memory_bytes memory ceiling of the pager
nlohmann::ordered_json summarize(std::span<const FrameRecord> frames, std::size_t memory_bytes,
                                 double fps);

/// The quantile of the values for a share: 0.5 gives the median. 0 if there are no values.
double percentile(std::vector<double> values, double share);

}  // namespace terrane::tools
