// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/simplify.h>

#include <cstddef>
#include <span>

namespace terrane::internal {

/// Fails: invalid_argument for a mesh of 2^32 vertices or more than 1e9 triangles, and for locks that are neither
///        none nor one a vertex
Result<void> check_sizes(std::size_t vertex_count, std::size_t triangle_count,
                         std::size_t locked_count);

/// Fails: invalid_argument, as simplify() says
Result<void> check_simplify_input(const SimplifyInput& input,
                                  std::span<const SimplifyLevel> levels);

}  // namespace terrane::internal
