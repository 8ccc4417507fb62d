// SPDX-License-Identifier: MIT
#pragma once

#include "camera/camera_path.h"

#include <terrane/terrain/pager.h>

#include <algorithm>
#include <span>
#include <vector>

namespace terrane::tools {

/// One of the moments that stand for a path where it is told ahead.
struct PathMoment {
    double time = 0.0;
    bool is_before_jump = false;  ///< where a jump begins; where it leads to is the next moment
    CameraPose pose;
};

/// A path from its beginning to its end in steps of 50 ms; two moments of one time for each jump.
std::vector<PathMoment> path_moments(const CameraPath& path);

/// Of moments whose times rise, those that a pager reads at a time: from the last one that is not
/// after it to the first one behind the horizon.
template <class Moment>
std::span<const Moment> trajectory_ahead(std::span<const Moment> moments, double time_s, double horizon) {
    const auto is_later = [](double time, const Moment& moment) { return time < moment.time_s; };
    const auto next = std::upper_bound(moments.begin(), moments.end(), time_s, is_later);
    const auto first = next == moments.begin() ? next : next - 1;
    auto last = std::upper_bound(next, moments.end(), time_s + horizon, is_later);
    if (last != moments.end()) ++last;
    return {first, last};
}

/// What a pager is told of a path: CameraNeed::way.
///
/// @param clock the pager's time at the path's beginning, seconds
std::vector<CameraMoment> camera_trajectory(std::span<const PathMoment> path, double clock);

}  // namespace terrane::tools
