// SPDX-License-Identifier: MIT
#pragma once

#include "ground/contact/contact_patches.h"
#include "ground/frame/ground_window.h"

namespace terrane::internal {

/// Finds the contacts of a box with some cells, as find_patches() does: with their faces, southern and western sides,
/// diagonals and south-western corners.
///
/// @param window      holds the cells and one more on each side
/// @param cells       all that the box's bounds and the margin meet, or some of them
/// @param translation separates the box
/// @param reach       features are paired where the gap of the translated box is up to this, metres
void find_box_patches(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
                      const LocalShape& box, std::uint32_t part, const Eigen::Vector3d& translation,
                      double margin, double reach, ContactPatches& patches);

}  // namespace terrane::internal
