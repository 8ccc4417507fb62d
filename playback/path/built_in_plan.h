// SPDX-License-Identifier: MIT
#pragma once

#include "path/camera_leg.h"

#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace terrane::internal {

/// Names of the built-in paths, as CameraPath explains them.
std::span<const std::string_view> built_in_names();

/// Where a path is planned: see CameraPathSettings.
struct PlanPlace {
    WorldRect region;
    std::optional<WorldVec2> start_world;
};

/// The legs of a built-in path in order of time; the camera jumps between two legs. A pure function of the
/// arguments.
///
/// @param name     one of built_in_names()
/// @param place    where the path is planned
/// @param speed    horizontal, m/s, > 0
/// @param duration of all legs together, seconds, > 0
///
/// Fails: io where the terrain cannot be read
Result<std::vector<LegPlan>> plan_built_in(std::string_view name, const HeightSource& source,
                                           const PlanPlace& place, double speed, double duration);

}  // namespace terrane::internal
