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

class ChunkFiles;

/// A terrain's volumes with the edits that are in force: what VolumeHeights answers from. It keeps the tiles of chunks
/// where an editor asks for that, up to a number of bytes, the last used ones.
///
/// Threads: any number that read; one that changes it
class EditedVolumes {
public:
    EditedVolumes(const HeightSource& heights, const Volumes& volumes)
        : volumes_(volumes), extents_(heights, volumes) {}

    /// Of a chunk of any level; over a rectangle.
    std::optional<ChunkExtent> extent_of(const ChunkKey& key) const;
    std::optional<HeightInterval> over(const WorldRect& rect) const;
    /// Whether a chunk of the pinned level differs from the heightfield alone, or ever did.
    bool is_touched(const ChunkKey& key) const;
    /// Most bytes of a chunk: an estimate, or what it has turned out to need.
    std::size_t max_bytes(const ChunkKey& key, std::size_t plain_bytes) const;
    bool is_current(const Chunk& chunk) const;
    /// Number of the last change in force.
    std::uint32_t number() const;

    /// A chunk of the pinned level, from that of the heightfield, as it is in force.
    ///
    /// Fails: as VolumeTile::create()
    Result<std::shared_ptr<const Chunk>> make(std::shared_ptr<const Chunk> chunk);

    /// From now on, keeps tiles, and reads files where it has none.
    void keep_tiles(std::size_t most_bytes, std::shared_ptr<const ChunkFiles> files);
    ChunkVersion version_of(const ChunkKey& key) const;

    struct NewVersion {
        ChunkKey key;
        ChunkVersion version;
        std::size_t chunk_bytes = 0;  ///< 0: not known
    };
    /// Brings versions into force, and returns the tiles that it dropped, to be freed elsewhere. Cost: O(versions *
    /// levels)
    std::vector<std::shared_ptr<const ChunkTiles>> switch_to(std::span<const NewVersion> versions,
                                                             std::uint32_t number);

private:
    struct Entry {
        ChunkVersion version;
        std::size_t tile_bytes = 0;   // of version.tiles
        std::size_t chunk_bytes = 0;  // 0: not known
        std::list<ChunkKey>::iterator use;
    };
    // These require the lock.
    void hold(Entry& entry, const ChunkKey& key, std::shared_ptr<const ChunkTiles> tiles,
              std::size_t tile_edits);
    void drop_old();

    Volumes volumes_;
    mutable std::shared_mutex mutex_;  // of all below
    SolidExtents extents_;
    std::map<ChunkKey, Entry> entries_;
    std::list<ChunkKey> uses_;  // of entries with tiles, the last used first
    std::size_t tile_bytes_ = 0, most_tile_bytes_ = 0;
    std::uint32_t number_ = 0;
    std::shared_ptr<const ChunkFiles> files_;
    std::vector<std::shared_ptr<const ChunkTiles>> dropped_;
};

/// A dig, a fill, or an undo of one.
struct Change {
    std::uint32_t number = 0;
    std::shared_ptr<const Edit> edit;  ///< that is made, or taken back
    bool is_undo = false;
};

/// A change with all that it needs to come into force.
struct PreparedChange {
    Change change;
    std::vector<ChunkKey> touched;              ///< sorted
    std::map<ChunkKey, ChunkVersion> versions;  ///< [touched]
    std::map<ChunkKey, ChunkVersion> before;    ///< [touched]
    /// New chunks of those that were resident when it was made.
    std::map<ChunkKey, std::shared_ptr<const Chunk>> chunks;
    std::vector<ChunkKey> deferred;  ///< resident ones whose chunk a later change makes
    std::string failure;             ///< why a chunk could not be made; empty if all were
    bool is_completing = false;      ///< a chunk that has arrived since is being made
};

/// The chunks that a change touches, and their versions after it, without tiles where these have to be made.
///
/// @param before   versions that it changes, of all touched
/// @param snapshot of an undo: the versions before the edit, or null
void begin(PreparedChange& prepared, const HeightSource& heights, const Volumes& volumes,
           const EditedVolumes& in_force, std::map<ChunkKey, ChunkVersion> before,
           const std::map<ChunkKey, ChunkVersion>* snapshot);

/// Makes the chunk that replaces a resident one. Sets PreparedChange::failure where memory is out.
void make_chunk_of(PreparedChange& prepared, const Volumes& volumes, const Chunk& resident);

}  // namespace terrane::internal
