// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

namespace terrane::internal {

/// Whether a place is above the drawn triangles at its x and y. False where none is drawn there.
///
/// Cost: O(triangles of the chunks at the place)
bool is_above_drawn_ground(const TerrainMesh& mesh, const WorldPos& place);

}  // namespace terrane::internal
