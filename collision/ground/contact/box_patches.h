// SPDX-License-Identifier: MIT
#pragma once

#include "ground/contact/contact_patches.h"
#include "ground/frame/ground_window.h"

namespace terrane::internal {

/// Finds the contacts of a box that is free after moving by `translation`, as find_patches() does, with some cells:
/// their faces, southern and western sides, diagonals, and south-western corners.
///
/// @param window holds the cells and one more on each side
/// @param cells  all that the box's bounds and the margin meet, or some of them
/// @param reach  gaps up to this are looked at where the box is free, metres
void find_box_patches(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
                      const LocalShape& box, std::uint32_t part, const Eigen::Vector3d& translation,
                      double margin, double reach, ContactPatches& patches);

}  // namespace terrane::internal
