// SPDX-License-Identifier: MIT
#pragma once

#include "path/camera_leg.h"

#include <span>
#include <string_view>
#include <vector>

namespace terrane::internal {

/// Names of the built-in paths, as CameraPath explains them.
std::span<const std::string_view> built_in_names();

/// The legs of a built-in path in order of time; the camera jumps between two legs. A pure function of the
/// arguments.
///
/// @param name     one of built_in_names()
/// @param speed    horizontal, m/s, > 0
/// @param duration of all legs together, seconds, > 0
///
/// Fails: io where the terrain cannot be read
Result<std::vector<LegPlan>> plan_built_in(std::string_view name, const HeightSource& source,
                                           double speed, double duration);

}  // namespace terrane::internal
