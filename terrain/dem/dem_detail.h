// SPDX-License-Identifier: MIT
#pragma once

#include "dem_source.h"

#include <terrane/dem/dem_heights.h>

#include <memory>

namespace terrane::internal {

/// Fails: invalid_argument if the detail's roughness is out of range
Result<void> check_detail(const DemSettings& settings);

/// Adds fractal detail between the samples of a raster, with an amplitude proportional to the local roughness. It
/// vanishes at the samples and outside the surveyed ground.
///
/// Fails: io; invalid_argument
Result<std::shared_ptr<const HeightSource>> add_dem_detail(std::shared_ptr<const DemSource> source,
                                                           const DemSettings& settings);

}  // namespace terrane::internal
