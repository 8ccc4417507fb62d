// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/scene_graph.h>

#include <cstddef>

namespace terrane::internal {

/// The level or levels that a switch selects in a frame.
struct SwitchChoice {
    std::size_t level = 0;   ///< index of a child; beyond the children: nothing
    bool is_fading = false;  ///< whether level + 1 is drawn too
    float share = 1.0f;      ///< coverage of the level; that of level + 1 is share - 1
};

/// Chooses between the levels of a switch.
///
/// @param distance     from the eye to the bounding sphere, metres, > 0
/// @param factor       pixels per metre of error there
/// @param threshold_px of errors, pixels
/// @param before       level of the frame before, for hysteresis
SwitchChoice choose_level(const SwitchNode& levels, double distance, double factor,
                          double threshold_px, std::size_t before);

}  // namespace terrane::internal
