// SPDX-License-Identifier: MIT
#pragma once

#include "source/terrain_options.h"

#include <string>

namespace terrane::tools {

/// The description of the raster of a terrain, for the note of its store; "" without a raster.
std::string note_of(const Terrain& terrain);

/// Opens a terrain written by `terrane bake`.
CommandResult<Terrain> open_baked(const std::string& path);

/// The cache of bounds that --cache selects. "": the user's cache folder, $XDG_CACHE_HOME/terrane or ~/.cache/terrane;
/// none where neither variable is set.
DemCache choose_cache(const std::string& option);

}  // namespace terrane::tools
