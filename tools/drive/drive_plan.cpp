// SPDX-License-Identifier: MIT
#include "drive/drive_plan.h"

#include "camera/terrain_track.h"

#include <terrane/playback/camera_path.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kGreatestMean = 1e3;  // m/s

Result<CameraPath> open_drive_path(const FlightOptions& options, const Terrain& terrain,
                                   CameraPathSettings& settings, double usual_speed) {
    if (!names_track_file(options.path)) {
        if (!settings.speed) settings.speed = usual_speed;
        return CameraPath::create(options.path, *terrain.source, planned_in(terrain, settings));
    }
    Result<Track> track = read_track(options.path, make_geo_reference(terrain.dem));
    if (!track) return tl::unexpected(track.error());
    if (!track->has_times && !settings.speed) settings.speed = usual_speed;
    return follow_track(std::move(*track), *terrain.source, settings);
}

}  // namespace

CommandResult<DrivePlan> make_drive_plan(const FlightOptions& options, const Terrain& terrain,
                                         double usual_speed) {
    CameraPathSettings settings;
    if (!std::isnan(options.speed)) settings.speed = options.speed;
    if (!std::isnan(options.seconds)) settings.seconds = options.seconds;
    const Result<CameraPath> path = open_drive_path(options, terrain, settings, usual_speed);
    if (!path) return pass_on(path.error());
    if (!path->jumps().empty()) {
        return pass_on(
            {ErrorCode::invalid_argument,
             fmt::format("no vehicle or character can jump as the path '{}' does", options.path)});
    }
    const CommandResult<std::size_t> frame_count = count_frames(options.fps, path->duration());
    if (!frame_count) return tl::unexpected(frame_count.error());

    constexpr double kSpacing = 1.0;  // least distance of points, metres
    constexpr double kTimeStep = 0.05;
    std::vector<Eigen::Vector2d> points;
    double length = 0.0;
    for (double time = 0.0; time <= path->duration(); time += kTimeStep) {
        const Eigen::Vector2d p = path->at(time).eye_world.head<2>();
        const double step = points.empty() ? 0.0 : (p - points.back()).norm();
        if (!points.empty() && step < kSpacing) continue;
        length += step;
        points.push_back(p);
    }
    if (points.size() < 2) {
        return pass_on(
            {ErrorCode::invalid_argument,
             fmt::format("the path '{}' is shorter than {} m", options.path, 2.0 * kSpacing)});
    }
    const double mean_speed = std::clamp(length / path->duration(), 1.0, kGreatestMean);
    return DrivePlan{.path = Polyline(std::move(points)),
                     .speed = settings.speed.value_or(mean_speed),
                     .frame_count = *frame_count};
}

}  // namespace terrane::tools
