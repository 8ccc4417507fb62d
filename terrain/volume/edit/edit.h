// SPDX-License-Identifier: MIT
#pragma once

#include "paging/chunk_tiles.h"
#include "paging/solid_extents.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace terrane::internal {

/// A dig or fill, placed. Immutable.
struct Edit {
    std::uint32_t number = 0;
    VolumeOperation operation;
    PlacedVolume placed;
    std::vector<VolumeTilePart> parts;  ///< tiles that it touches, sorted

    Edit(std::uint32_t edit_number, VolumeOperation of, PlacedVolume volume);
    bool touches(const VolumeTileKey& tile) const;
    /// Sorted, each once.
    std::vector<ChunkKey> chunks(int level) const;
};

/// Edits in force, by ascending number. An undo takes the last one away, so that two lists with the same edit at an
/// index are equal up to it.
using EditList = std::vector<std::shared_ptr<const Edit>>;

/// Whether `list` begins with all of `first`.
bool begins_with(const EditList& list, const EditList& first);

/// An edit that was taken back, and the number of the undo.
struct UndoneEdit {
    std::uint32_t edit = 0, undo = 0;
};

/// What edits have made of a chunk of the pinned level. Immutable.
struct ChunkEdits {
    std::uint32_t changed = 0;  ///< number of the last change that touches the chunk
    EditList edits;             ///< in force
    std::vector<UndoneEdit> undone;
    std::optional<ChunkExtent> base_extent, extent;  ///< of the volumes alone, and with the edits

    /// The number of edits that a file of change `position` holds; none where it holds one that was undone since.
    std::optional<std::size_t> count_at(std::uint32_t position) const;
};

/// A chunk's edits, and tiles where these are held. Null edits: none ever touched it.
struct ChunkVersion {
    std::shared_ptr<const ChunkEdits> edits;
    std::shared_ptr<const ChunkTiles> tiles;
    std::size_t tile_edits = 0;  ///< how many edits of the list the tiles have

    const EditList& list() const;
    bool is_made() const { return tiles && tile_edits == list().size(); }
};

/// What the volumes and all edits of a chunk add over it.
std::optional<ChunkExtent> extent_with(const HeightSource& heights, const Volumes& volumes,
                                       const ChunkKey& key, const ChunkEdits& edits);

/// The edits of a chunk after one more, or without the last one.
std::shared_ptr<const ChunkEdits> with_edit(const HeightSource& heights, const Volumes& volumes,
                                            const ChunkKey& key, const ChunkEdits& before,
                                            const std::shared_ptr<const Edit>& edit);
std::shared_ptr<const ChunkEdits> without_last(const HeightSource& heights, const Volumes& volumes,
                                               const ChunkKey& key, const ChunkEdits& before,
                                               std::uint32_t undo);

/// The tiles of a chunk with its volumes and all of its edits.
///
/// Applies the edits that the version's tiles do not have; all, on top of the volumes, where it has no tiles.
///
/// Fails: as VolumeTile::create()
/// Cost:  that of the tiles which these edits touch; without tiles that of all
Result<std::shared_ptr<const ChunkTiles>> make_tiles(const Volumes& volumes, const Chunk& chunk,
                                                     const ChunkVersion& version);

/// The volumes that touch a tile, and those of the first edits that do, in their order.
std::vector<const PlacedVolume*> operations_of(const Volumes& volumes, const EditList& edits,
                                               std::size_t edit_count, const VolumeTileKey& tile);

/// A copy of a chunk with the surface of its tiles.
std::shared_ptr<const Chunk> with_tiles(const Lattice& lattice, const Chunk& chunk,
                                        const ChunkTiles& tiles, SolidLevels levels,
                                        std::uint32_t change);

}  // namespace terrane::internal
