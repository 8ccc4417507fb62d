// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/bilinear_grid.h"

#include <terrane/base/result.h>
#include <terrane/dem/dem_heights.h>

namespace terrane::internal {

/// Defines the lattice over a raster.
///
/// @param finest_spacing, spacing_tolerance as in DemSettings
///
/// Fails: invalid_argument if the finest spacing is out of range
Result<BilinearGrid> make_grid(const DemInfo& info, double finest_spacing,
                               double spacing_tolerance = 1.0);

}  // namespace terrane::internal
