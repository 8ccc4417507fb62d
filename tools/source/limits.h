// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"
#include "source/terrain_options.h"

#include <cstddef>

namespace terrane::tools {

/// Most triangles that a budget can allow.
inline constexpr std::size_t kMostTriangles = 1'000'000'000;

/// Refuse a --budget of triangles or a --memory-mb that does not hold the terrain's root squares, which are always
/// there. Fail with exit_failed: how many there are is the terrain's affair.
CommandResult<void> check_budget(const Terrain& terrain, std::size_t budget);
CommandResult<void> check_memory(const Terrain& terrain, double memory_mb);

}  // namespace terrane::tools
