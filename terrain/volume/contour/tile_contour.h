// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/tile_level_set.h"

#include <terrane/volume/volume_contour.h>

namespace terrane::internal {

/// Contours a tile: marches the tetrahedra of all columns, and clips the triangles of the heightfield that have a
/// sample in a void or solid.
VolumeContour contour_tile(const TileLevelSet& level_set, const TileLines& lines,
                           const VolumeTileKey& key);

}  // namespace terrane::internal
