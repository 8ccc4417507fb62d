// SPDX-License-Identifier: MIT
#pragma once

#include "surface/bilinear_grid.h"

namespace terrane::internal {

/// Bytes that a raster takes at most while it is opened and after that, but for what depends on where
/// its nodata is and for the cache of GDAL.
///
/// @param held_bytes  for samples: all of them, or the cache of a raster that is read by window
double opening_bytes(const BilinearGrid& grid, double held_bytes);

}  // namespace terrane::internal
