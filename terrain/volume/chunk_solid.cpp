// SPDX-License-Identifier: MIT
#include "paging/chunk_tiles.h"

#include <terrane/volume/chunk_solid.h>

#include <string>

namespace terrane {

Result<std::shared_ptr<const SolidSurface>> make_chunk_solid(const Volumes& volumes,
                                                             const Chunk& chunk) {
    if (chunk.key.level != volumes.level()) {
        return tl::unexpected(Error{ErrorCode::invalid_argument,
                                    "a chunk of level " + std::to_string(chunk.key.level) +
                                        " has no volumes: the pinned level is " +
                                        std::to_string(volumes.level())});
    }
    internal::ChunkTiles tiles;
    for (int i = 0; i < internal::kChunkTiles; ++i) {
        const VolumeTileKey key = internal::tile_of(chunk.key, i);
        if (volumes.operations_at(key).empty()) continue;
        Result<VolumeTile> tile =
            VolumeTile::create(volumes, key, internal::tile_heights(chunk, i));
        if (!tile) return tl::unexpected(tile.error());
        tiles[static_cast<std::size_t>(i)] = std::make_shared<const internal::TileSolid>(
            std::move(*tile), internal::operations_of(volumes, key));
    }
    return internal::make_solid(volumes.lattice(), chunk, tiles, internal::SolidLevels::all);
}

}  // namespace terrane
