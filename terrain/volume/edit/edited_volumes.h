// SPDX-License-Identifier: MIT
#pragma once

#include "contour/chunk_solids.h"

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// A placed dig or fill. Immutable.
struct Edit {
    std::uint32_t number = 0;
    VolumeOperation operation;
    PlacedVolume placed;
    std::vector<VolumeTilePart> parts;  ///< tiles that it touches, sorted

    Edit(std::uint32_t edit_number, VolumeOperation of, PlacedVolume volume);
    bool touches(const VolumeTileKey& tile) const;
    /// Chunks that it touches, sorted and unique.
    std::vector<ChunkKey> chunks(int level) const;
};

/// Edits in force, by ascending number. Only the last edit can be undone, so two lists that have the same edit at an
/// index are equal up to that index.
using EditList = std::vector<std::shared_ptr<const Edit>>;

/// Whether `first` is a prefix of `list`.
bool begins_with(const EditList& list, const EditList& first);

/// An undone edit, and the number of the undo.
struct UndoneEdit {
    std::uint32_t edit = 0, undo = 0;
};

/// The edits of a chunk of the pinned level. Immutable.
struct ChunkEdits {
    std::uint32_t changed = 0;  ///< number of the last change that touches the chunk
    EditList edits;             ///< in force
    std::vector<UndoneEdit> undone;
    std::optional<ChunkExtent> base_extent, extent;  ///< of the volumes alone, and with the edits

    /// Number of edits in a file that was saved at change `position`; absent if one of them has been undone since.
    std::optional<std::size_t> count_at(std::uint32_t position) const;
};

/// A chunk's edits, and its tiles if they are held. `edits` is null if no edit has ever touched the chunk.
struct ChunkVersion {
    std::shared_ptr<const ChunkEdits> edits;
    std::shared_ptr<const ChunkTiles> tiles;
    std::size_t tile_edits = 0;  ///< number of edits that are applied to the tiles

    const EditList& list() const;
    bool is_made() const { return tiles && tile_edits == list().size(); }
};

/// The extent of the volumes and all edits of a chunk.
std::optional<ChunkExtent> extent_with(const HeightSource& heights, const Volumes& volumes,
                                       const ChunkKey& key, const ChunkEdits& edits);

/// A copy of a chunk's edits with one more edit at the end.
std::shared_ptr<const ChunkEdits> with_edit(const HeightSource& heights, const Volumes& volumes,
                                            const ChunkKey& key, const ChunkEdits& before,
                                            const std::shared_ptr<const Edit>& edit);
/// A copy of a chunk's edits without the last one in force, which is recorded as undone by change `undo`.
std::shared_ptr<const ChunkEdits> without_last(const HeightSource& heights, const Volumes& volumes,
                                               const ChunkKey& key, const ChunkEdits& before,
                                               std::uint32_t undo);

/// Makes the tiles of a chunk with its volumes and all its edits. Starts from the version's tiles and applies the edits
/// that they lack; without tiles, starts from the volumes and applies all edits.
///
/// Fails: as VolumeTile::create()
/// Cost:  that of making the tiles that these edits touch or, without tiles, all tiles
Result<std::shared_ptr<const ChunkTiles>> make_tiles(const Volumes& volumes, const Chunk& chunk,
                                                     const ChunkVersion& version);

/// The volumes that touch a tile, then those among the volumes of the first `edit_count` edits that touch it, in order.
std::vector<const PlacedVolume*> operations_of(const Volumes& volumes, const EditList& edits,
                                               std::size_t edit_count, const VolumeTileKey& tile);

/// A copy of a chunk with the surface of its tiles.
std::shared_ptr<const Chunk> with_tiles(const Lattice& lattice, const Chunk& chunk,
                                        const ChunkTiles& tiles, SolidLevels levels,
                                        std::uint32_t change);

class ChunkFiles;

/// The volumes of a terrain and the edits in force; VolumeHeights takes its answers from here. After keep_tiles(), also
/// caches the tiles of chunks up to a memory limit and evicts the least recently used.
///
/// Threads: any number of readers, while one thread changes it
class EditedVolumes {
public:
    EditedVolumes(const HeightSource& heights, const Volumes& volumes)
        : volumes_(volumes), extents_(heights, volumes) {}

    /// Extent of the volumes and edits over a chunk of any level, or over a rectangle.
    std::optional<ChunkExtent> extent_of(const ChunkKey& key) const;
    std::optional<HeightInterval> over(const WorldRect& rect) const;
    /// Whether a chunk of the pinned level differs, or has ever differed, from the heightfield alone.
    bool is_touched(const ChunkKey& key) const;
    /// Expected upper limit of a chunk's bytes: see VolumeHeights::max_chunk_bytes().
    std::size_t max_bytes(const ChunkKey& key, std::size_t plain_bytes) const;
    bool is_current(const Chunk& chunk) const;
    /// Number of the last change in force.
    std::uint32_t number() const;

    /// Makes the current version of a chunk of the pinned level from the heightfield's chunk.
    ///
    /// Fails: as VolumeTile::create()
    Result<std::shared_ptr<const Chunk>> make(std::shared_ptr<const Chunk> chunk);

    /// Enables the cache of tiles and the use of files for chunks without cached tiles.
    void keep_tiles(std::size_t most_bytes, std::shared_ptr<const ChunkFiles> files);
    ChunkVersion version_of(const ChunkKey& key) const;

    struct NewVersion {
        ChunkKey key;
        ChunkVersion version;
        std::size_t chunk_bytes = 0;  ///< 0: unknown
    };
    /// Makes the versions the current ones. Returns the dropped tiles, so that the caller can free them elsewhere.
    ///
    /// Cost: O(versions * levels)
    std::vector<std::shared_ptr<const ChunkTiles>> switch_to(std::span<const NewVersion> versions,
                                                             std::uint32_t number);

private:
    struct Entry {
        ChunkVersion version;
        std::size_t tile_bytes = 0;   // of version.tiles
        std::size_t chunk_bytes = 0;  // 0: unknown
        std::list<ChunkKey>::iterator use;
    };
    // These require the lock.
    void hold(Entry& entry, const ChunkKey& key, std::shared_ptr<const ChunkTiles> tiles,
              std::size_t tile_edits);
    void drop_old();

    Volumes volumes_;
    mutable std::shared_mutex mutex_;  // guards all below
    SolidExtents extents_;
    std::map<ChunkKey, Entry> entries_;
    std::list<ChunkKey> uses_;  // keys of entries with tiles, most recently used first
    std::size_t tile_bytes_ = 0, most_tile_bytes_ = 0;
    std::uint32_t number_ = 0;
    std::shared_ptr<const ChunkFiles> files_;
    std::vector<std::shared_ptr<const ChunkTiles>> dropped_;
};

/// A dig, a fill, or an undo of one.
struct Change {
    std::uint32_t number = 0;
    std::shared_ptr<const Edit> edit;  ///< the edit that is made or undone
    bool is_undo = false;
};

/// A change with everything that it needs to take effect.
struct PreparedChange {
    Change change;
    std::vector<ChunkKey> touched;              ///< sorted
    std::map<ChunkKey, ChunkVersion> versions;  ///< [touched] after the change
    std::map<ChunkKey, ChunkVersion> before;    ///< [touched] before the change
    /// New chunks in place of those that were resident when the change was prepared.
    std::map<ChunkKey, std::shared_ptr<const Chunk>> chunks;
    std::vector<ChunkKey> deferred;  ///< resident chunks that a later change of the batch makes
    std::string failure;             ///< why a chunk could not be made; empty if none failed
    bool is_completing = false;      ///< a chunk loaded after the preparation is being made
};

/// Fills in the versions of the chunks that a change touches. Tiles of a version may lack edits or be absent: see
/// make_tiles().
///
/// @param before   current versions of all touched chunks
/// @param snapshot the versions before the undone edit, if they were kept; else null
void begin(PreparedChange& prepared, const HeightSource& heights, const Volumes& volumes,
           const EditedVolumes& in_force, std::map<ChunkKey, ChunkVersion> before,
           const std::map<ChunkKey, ChunkVersion>* snapshot);

/// Makes the chunk that replaces a resident one. Sets PreparedChange::failure on failure, including lack of memory.
void make_chunk_of(PreparedChange& prepared, const Volumes& volumes, const Chunk& resident);

}  // namespace terrane::internal
