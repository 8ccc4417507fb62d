// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/tile_level_set.h"

#include <terrane/volume/volume_contour.h>

#include <array>

namespace terrane::internal {

/// Contours a tile: marches the tetrahedra of all columns, and clips the triangles of the heightfield that have a
/// sample in a void or solid.
///
/// @param closes the western, eastern, southern and northern side: whether its cap is made
VolumeContour contour_tile(const TileLevelSet& level_set, const TileLines& lines,
                           const VolumeTileKey& key, const std::array<bool, 4>& closes);

}  // namespace terrane::internal
