// SPDX-License-Identifier: MIT
#pragma once

#include "bounds/bound_tier.h"
#include "raster/opening_progress.h"
#include "surface/fine_surface.h"

#include <cstdint>
#include <span>

namespace terrane::internal {

/// Finds the greatest deviation of the surface over every triangle that is larger than a cell of the
/// first tier.
///
/// @param first   with heights, cell_low and cell_high
/// @param levels  of two, four, eight ... times the first tier's step, with zeros: receives cell_bounds of all, and in
///                bounds, at the midpoints of all but the last, the deviation over their diamonds
///
/// @return visited tiles, summed over passes and triangles
///
/// Fails: io; cancelled
/// Cost:  tiles over the raster times levels, and the raster's circumference times levels
Result<std::int64_t> find_deviations(const FineSurface& fine, const BoundTier& first,
                                     std::span<BoundTier> levels, OpeningProgress& progress);

}  // namespace terrane::internal
