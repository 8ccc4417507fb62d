// SPDX-License-Identifier: MIT
#pragma once

#include "scene/terrain_options.h"

#include <terrane/playback/camera_path.h>

#include <limits>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// How much of a path, seen from above, is over ground: inside the terrain's extent, and not `cell_outside`.
struct PathGround {
    double length = 0.0;      ///< of the path, metres
    double off_ground = 0.0;  ///< of its parts without ground, metres
    /// Distance along the path to the first point without ground, metres; 0: the path starts there; infinite: there is
    /// ground everywhere.
    double first_along = std::numeric_limits<double>::infinity();
    WorldVec2 first_world = WorldVec2::Zero();  ///< that point, metres
    double first_beyond = 0.0;  ///< its distance from the terrain's extent, metres; 0: it is inside

    bool is_complete() const { return first_along == std::numeric_limits<double>::infinity(); }
};

/// Follows lines, each of one point or more, in steps of a cell of the terrain, or longer ones if that would be more
/// than 20,000 steps.
///
/// @param lines points of the continuous parts of a path, metres
///
/// Fails: io if the terrain cannot be read
Result<PathGround> find_ground_under(std::span<const std::vector<Eigen::Vector2d>> lines,
                                     const Terrain& terrain);

/// The plan of a path as lines, one between each two jumps, of about 20,000 points or fewer.
std::vector<std::vector<Eigen::Vector2d>> lines_of(const CameraPath& path);

/// Says where a path has no ground first, as the predicate of a sentence whose subject is the path. Requires a path
/// that is not complete.
std::string describe_lack(const PathGround& ground, const Terrain& terrain);

}  // namespace terrane::tools
