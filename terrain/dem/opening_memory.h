// SPDX-License-Identifier: MIT
#pragma once

#include "surface/bilinear_grid.h"

namespace terrane::internal {

/// Upper bound of the bytes of a raster during and after opening, without those that depend on its nodata and without
/// the cache of GDAL.
///
/// @param held_bytes  of samples: all of them, or the cache of a raster read by window
double opening_bytes(const BilinearGrid& grid, double held_bytes);

}  // namespace terrane::internal
