// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/result.h>

#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// Fails: invalid_argument, naming the first instance or particle with a number that is not finite, a scale or radius
///        that is not above 0, or a coverage beyond -1 to 2
Result<void> check_values(const SceneDraws& draws);

/// Fails: invalid_argument for a range that ends beyond the instances
Result<void> check_instances(const SceneDraws& draws, std::uint32_t first, std::uint32_t count);

/// Fails: invalid_argument for positions that are not finite or not one a vertex, and for triangles that are too many
///        for OpenGL or name a vertex beyond the mesh's
Result<void> check_streamed(const StreamedDraw& streamed, std::size_t vertex_count);

}  // namespace terrane::internal
