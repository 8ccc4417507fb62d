// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/playback/camera_path.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <span>
#include <vector>

namespace terrane {

/// One sample of a path.
struct PathMoment {
    double time = 0.0;            ///< seconds
    bool is_before_jump = false;  ///< start of a jump; the next sample is its end
    CameraPose pose;              ///< at that time
};

/// Samples of a path from start to end, 50 ms apart; each jump adds two samples of the same time.
std::vector<PathMoment> path_moments(const CameraPath& path);

/// The part of a trajectory that a pager reads at `time_s`: from the last sample not after it to the first one
/// beyond the horizon.
///
/// @param moments times must not decrease
template <class Moment>
std::span<const Moment> trajectory_ahead(std::span<const Moment> moments, double time_s,
                                         double horizon) {
    const auto is_later = [](double time, const Moment& moment) { return time < moment.time_s; };
    const auto next = std::upper_bound(moments.begin(), moments.end(), time_s, is_later);
    const auto first = next == moments.begin() ? next : next - 1;
    auto last = std::upper_bound(next, moments.end(), time_s + horizon, is_later);
    if (last != moments.end()) ++last;
    return {first, last};
}

/// A path as CameraNeed::trajectory.
///
/// @param clock the pager's time at the start of the path, seconds
std::vector<CameraMoment> camera_trajectory(std::span<const PathMoment> path, double clock);

}  // namespace terrane
