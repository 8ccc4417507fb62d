// SPDX-License-Identifier: MIT
#pragma once

#include "ground/contact/contact_patches.h"
#include "ground/frame/ground_window.h"

namespace terrane::internal {

/// Finds the contacts of a sphere or capsule with some cells, as find_patches() does: with their faces, southern and
/// western sides, diagonals and south-western corners.
///
/// @param window      holds the cells and one more on each side
/// @param cells       all that the bounds and the margin meet, or some of them
/// @param shape       radius > kThin
/// @param translation separates the shape; or zero, where its core is clear of the ground
/// @param reach       features are paired where the gap of the translated shape is up to this, metres
void find_round_patches(const LocalGround& local, const GroundWindow& window,
                        const CellRange& cells, const LocalShape& shape, std::uint32_t part,
                        const Eigen::Vector3d& translation, double margin, double reach,
                        ContactPatches& patches);

/// Radius below which directions between closest points may be rounding noise, metres.
inline constexpr double kThin = 1e-6;

}  // namespace terrane::internal
