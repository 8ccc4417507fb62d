// SPDX-License-Identifier: MIT
#include <terrane/playback/camera_trajectory.h>

namespace terrane {

std::vector<PathMoment> path_moments(const CameraPath& path) {
    constexpr double kStep = 0.05;
    std::vector<PathMoment> moments;
    auto jump = path.jumps().begin();
    const auto add_jumps = [&](double until) {
        for (; jump != path.jumps().end() && *jump <= until; ++jump) {
            moments.push_back({*jump, true, path.before(*jump)});
            moments.push_back({*jump, false, path.at(*jump)});
        }
    };
    for (int i = 0; i * kStep < path.duration(); ++i) {
        const double time = i * kStep;
        add_jumps(time);
        if (moments.empty() || moments.back().time < time) {
            moments.push_back({time, false, path.at(time)});
        }
    }
    add_jumps(path.duration());
    moments.push_back({path.duration(), false, path.at(path.duration())});
    return moments;
}

std::vector<CameraMoment> camera_trajectory(std::span<const PathMoment> path, double clock) {
    std::vector<CameraMoment> trajectory;
    trajectory.reserve(path.size());
    for (const PathMoment& moment : path) {
        trajectory.push_back({.time_s = clock + moment.time,
                              .eye_world = moment.pose.eye_world,
                              .forward = moment.pose.forward,
                              .up = moment.pose.up});
    }
    return trajectory;
}

}  // namespace terrane
