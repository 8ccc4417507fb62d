// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/ground_cast.h>

namespace terrane::internal {

/// Whether a shape stays further than a margin from the ground all along a short motion: true
/// where planes prove it, one for each triangle in reach, at once and for all of the motion. False where nobody
/// knows: where a plane would have to change on the way, where cells in reach are no ground or not resident, and for
/// motions too long to be looked at in one piece.
///
/// @param margin metres, > 0
/// Cost: O(cells in reach), and a fraction of a cast
bool is_sweep_clear(const Shape& shape, const Motion& motion, const Ground& ground, double margin);

}  // namespace terrane::internal
