// SPDX-License-Identifier: MIT
#pragma once

#include "edit/edit.h"

#include <list>
#include <map>
#include <shared_mutex>
#include <span>

namespace terrane::internal {

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

}  // namespace terrane::internal
