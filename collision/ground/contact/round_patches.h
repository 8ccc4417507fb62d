// SPDX-License-Identifier: MIT
#pragma once

#include "ground/contact/contact_patches.h"
#include "ground/frame/ground_window.h"

namespace terrane::internal {

/// Finds the contacts of a sphere or capsule that is free after moving by `translation`, or whose core is clear of
/// the ground, as find_patches() does, with some cells: their faces, southern and western sides, diagonals, and
/// south-western corners.
///
/// @param window holds the cells and one more on each side
/// @param cells  all that the bounds and the margin meet, or some of them
/// @param shape  thicker than a core whose nearest points tell no direction, radius > kThin
/// @param reach  gaps up to this are looked at where the shape is free, metres
void find_round_patches(const LocalGround& local, const GroundWindow& window,
                        const CellRange& cells, const LocalShape& shape, std::uint32_t part,
                        const Eigen::Vector3d& translation, double margin, double reach,
                        ContactPatches& patches);

/// Radius below which directions between nearest points may be noise, metres.
inline constexpr double kThin = 1e-6;

}  // namespace terrane::internal
