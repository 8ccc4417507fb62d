// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"
#include "source/terrain_options.h"

#include <cstddef>

namespace terrane::tools {

/// Largest triangle budget.
inline constexpr std::size_t kMostTriangles = 1'000'000'000;

/// Check that --budget (triangles) and --memory-mb hold the root squares of the terrain, which are always resident.
/// Fail with exit_failed, not exit_usage, because their number depends on the terrain.
CommandResult<void> check_budget(const Terrain& terrain, std::size_t budget);
CommandResult<void> check_memory(const Terrain& terrain, double memory_mb);

}  // namespace terrane::tools
