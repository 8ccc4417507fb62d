// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>
#include <terrane/volume/volumes.h>

#include <memory>

namespace terrane {

/// Contours the volumes over one chunk of the pinned level: what Chunk::solid holds, null where no volume touches the
/// chunk. Chunks are contoured alone and agree bit for bit at their borders.
///
/// Its error is the largest diameter of a tetrahedron that the surface passes through, because each triangle is in one
/// with a part of the true surface: a bound, many times the error of smooth surfaces (docs/volumes.md). What is
/// thinner than two spacings may be lost between nodes; the error does not bound that.
///
/// Fails:   invalid_argument for a chunk of another level, or as VolumeTile::create()
/// Threads: any number
/// Cost:    that of its tiles; nothing but a search where no volume touches it
Result<std::shared_ptr<const SolidSurface>> make_chunk_solid(const Volumes& volumes,
                                                             const Chunk& chunk);

}  // namespace terrane
