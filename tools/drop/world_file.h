// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>

#include <string>

namespace terrane::tools {

/// A world from a file that holds the bytes of World::save(). Fails with io where it cannot be read, and as
/// World::load(); messages name the file.
Result<World> restore_world(const std::string& path, int worker_count);

}  // namespace terrane::tools
