// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <terrane/scene/object_model.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>

#include <functional>
#include <memory>

namespace terrane::test {

/// All chunks of a source down to a level.
///
/// @param is_resident of a chunk whose parent is resident; none: all are
/// @param change      replaces a chunk; none: none is
std::shared_ptr<const ResidentSet> resident_chunks(
    const HeightSource& source, int finest_level,
    const std::function<bool(const ChunkKey&)>& is_resident = {},
    const std::function<std::shared_ptr<const Chunk>(std::shared_ptr<const Chunk>)>& change = {});

/// The triangles of a frame as they are drawn, for rays.
MeshRays drawn_surface(const TerrainMesh& mesh);

/// A view that looks along a horizontal direction, raised by a slope, and rolled by an angle.
View view_along(const WorldPos& eye_world, const Eigen::Vector2d& direction, double slope,
                double roll);

}  // namespace terrane::test
