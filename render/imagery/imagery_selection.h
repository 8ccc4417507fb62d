// SPDX-License-Identifier: MIT
#pragma once

#include "imagery/imagery_square.h"

#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <vector>

namespace terrane::internal {

/// The finest level at which imagery has texels for pixels to show.
int finest_imagery_level(const Lattice& lattice, double texel_size);

/// The squares that a view shows at the size of its pixels, each after the square that contains it: those in view, then
/// those around the eye that a turn would show.
///
/// @param resident heights of the ground
/// @param rect     of the imagery
/// @param most     squares; the finest are left out where there are more
///
/// Cost: linear in the squares, and in the root squares within 16 of the eye's
std::vector<ImagerySquare> select_imagery(const ResidentSet& resident, const View& view,
                                          const WorldRect& rect, double texel_size,
                                          std::size_t most);

}  // namespace terrane::internal
