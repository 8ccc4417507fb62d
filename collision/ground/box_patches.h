// SPDX-License-Identifier: MIT
#pragma once

#include "contact_patches.h"
#include "ground_window.h"

namespace terrane::internal {

/// Finds all contacts of a box that is free after moving by `freeing`: see find_patches().
///
/// @param reach  gaps up to this are looked at where the box is free, metres
/// @param window holds every cell that the box's bounds and the margin meet, and one more on each side
void find_box_patches(const LocalGround& local, const GroundWindow& window, const LocalShape& box,
                      std::uint32_t part, const Eigen::Vector3d& freeing, double margin,
                      double reach, ContactPatches& patches);

}  // namespace terrane::internal
