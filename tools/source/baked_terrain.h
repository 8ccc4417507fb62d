// SPDX-License-Identifier: MIT
#pragma once

#include "source/terrain_options.h"

#include <string>

namespace terrane::tools {

/// What a baked terrain says of the raster that it was made of, as the note of its store; "" where there was
/// none.
std::string note_of(const Terrain& terrain);

/// Opens a terrain that `terrane bake` wrote.
CommandResult<Terrain> open_baked(const std::string& path);

/// Where --cache says that bounds are kept: in the user's cache folder for "", which is
/// $XDG_CACHE_HOME/terrane or ~/.cache/terrane; nowhere where there is no such folder to be named.
DemCache choose_cache(const std::string& option);

}  // namespace terrane::tools
