// SPDX-License-Identifier: MIT
#include "edit/change.h"

#include <new>
#include <utility>

namespace terrane::internal {

void begin(PreparedChange& prepared, const HeightSource& heights, const Volumes& volumes,
           const EditedVolumes& in_force, std::map<ChunkKey, ChunkVersion> before,
           const std::map<ChunkKey, ChunkVersion>* snapshot) {
    const Change& change = prepared.change;
    prepared.before = std::move(before);
    for (const ChunkKey& key : prepared.touched) {
        const ChunkVersion& old = prepared.before.at(key);
        ChunkEdits none;
        if (!old.edits) none.base_extent = none.extent = in_force.extent_of(key);
        const ChunkEdits& edits = old.edits ? *old.edits : none;
        ChunkVersion version = old;
        if (change.is_undo) {
            version.edits = without_last(heights, volumes, key, edits, change.number);
            if (snapshot) {
                const ChunkVersion& earlier = snapshot->at(key);
                version.tiles = earlier.tiles;
                version.tile_edits = earlier.tile_edits;
            }
            // Level sets forget what an operation overwrote.
            if (version.tile_edits > version.list().size()) {
                version.tiles.reset();
                version.tile_edits = 0;
            }
        } else {
            version.edits = with_edit(heights, volumes, key, edits, change.edit);
        }
        prepared.versions[key] = std::move(version);
    }
}

void make_chunk_of(PreparedChange& prepared, const Volumes& volumes, const Chunk& resident) {
    try {
        ChunkVersion& version = prepared.versions.at(resident.key);
        if (!version.is_made()) {
            auto tiles = make_tiles(volumes, resident, version);
            if (!tiles) {
                prepared.failure = tiles.error().message;
                return;
            }
            version.tiles = std::move(*tiles);
            version.tile_edits = version.list().size();
        }
        prepared.chunks[resident.key] =
            with_tiles(volumes.lattice(), resident, *version.tiles, version.edits->changed);
        prepared.failure.clear();
    } catch (const std::bad_alloc&) {
        prepared.failure = "out of memory";
    }
}

}  // namespace terrane::internal
