// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear_grid.h"

#include <terrane/terrain/result.h>

#include <cstddef>
#include <string>

namespace terrane::internal {

/// Bytes that a raster takes at most while it is opened and after that, but for what depends on where
/// its nodata is and for the cache of GDAL.
///
/// @param held_bytes  for samples: all of them, or the cache of a raster that is read by window
double opening_bytes(const BilinearGrid& grid, double held_bytes);

/// Fails: out_of_memory where a raster needs more than the limit
Result<void> check_memory(const std::string& raster, int columns, int rows, double needed_bytes,
                          std::size_t limit_bytes);

/// Rows of a strip that is read at once: a multiple of the block's side, as many as make about four
/// million samples.
int strip_rows(int columns);

}  // namespace terrane::internal
