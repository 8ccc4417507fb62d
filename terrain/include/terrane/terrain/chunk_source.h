// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>

namespace terrane {

struct Chunk;
class Pager;

/// Extent of the volumes over the square of a chunk: see ChunkSource::solid_extent().
struct SolidExtent {
    /// Bound of the two-sided distance between the heightfield alone and the true surface, metres.
    double error_m = 0.0;
    HeightInterval heights;  ///< contains the surfaces of volumes, world z, metres
};

/// Implemented by height sources whose chunks are not all computed from their heights, such as a baked store or a
/// heightfield with volumes. The default functions are for chunks that are computed from heights; a source overrides
/// those that do not fit its own chunks.
///
/// Threads: any number at once, as HeightSource
class ChunkSource {
public:
    virtual ~ChunkSource() = default;

    /// A stored chunk, which make_chunk() returns instead of computing one; null if none is stored.
    ///
    /// @param key  of a chunk of the source's world
    /// @param stop if a stop is requested, a long call may fail with `cancelled`
    ///
    /// Fails: io; bad_data if the stored chunk is damaged
    virtual Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                              const std::stop_token& stop) const;

    /// Says which chunks stored_chunk() will be asked for soon, the most urgent one first. A source whose storage is
    /// slow may begin to read them. Replaces what the last call said. Must not wait.
    virtual void expect_chunks(std::span<const ChunkKey> /*keys*/) const {}

    /// Extent of the volumes (caves, tunnels, overhangs) over the square of a chunk of any level; absent if there are
    /// none. If it is present, chunks of the finest level have a Chunk::solid. Must answer from memory, because
    /// Pager::update() calls it when chunks arrive or leave.
    virtual std::optional<SolidExtent> solid_extent(const ChunkKey& key) const;

    /// Whether a point with finite coordinates is in a volume, or so near one that rounding decides. A triangle of the
    /// heightfield at the finest spacing is part of the surface if this is false at its three corners. The answer never
    /// changes: edits at run time do not count. Must answer from memory.
    virtual bool is_in_volume(double x, double y, double z) const;

    /// Largest size of a chunk, bytes, which its load claims of the ceiling; Chunk::max_bytes() without volumes. A
    /// larger chunk is rejected; it is loaded again at once if this function returns more by then, else the load has
    /// failed.
    virtual std::size_t max_chunk_bytes(const ChunkKey& key) const;

    /// Whether a loaded chunk is the one that the source would still make. A pager checks this before it inserts a
    /// chunk; if the source has changed during the load, the pager loads the chunk again.
    virtual bool is_current(const Chunk& chunk) const;
};

/// The ChunkSource of a height source: the source itself if it is one, otherwise one with the default functions. Valid
/// while the source lives.
const ChunkSource& chunks_of(const HeightSource& source);

/// A change of a source, for replace_chunks().
struct ChunkReplacement {
    /// New chunks, at most one per key. Chunks whose keys are not resident are ignored.
    std::span<const std::shared_ptr<const Chunk>> chunks;
    /// Keys of all chunks whose ChunkSource::solid_extent() changes, of any level.
    std::span<const ChunkKey> changed;
    /// Applies the change to the source. Called once, when nothing can fail any more. Chunks in flight for which
    /// ChunkSource::is_current() is false afterwards are dropped when they arrive.
    std::function<void()> switch_source;
};

/// Replaces chunks in a running pager for a change of the source, such as an edit by a VolumeEditor. Resident chunks
/// are replaced together, without fades, in the set of the next Pager::update() or finish(); other chunks change with
/// their next load. All or nothing: the new chunks' bytes are claimed while the old ones still count. If they do not
/// fit, nothing is replaced; the next update() evicts other chunks to make room, and the caller then repeats the call.
///
/// Returns: whether the chunks are replaced
/// Threads: the pager's
/// Cost:    O(chunks + changed * levels)
[[nodiscard]] bool replace_chunks(Pager& pager, const ChunkReplacement& replacement);

}  // namespace terrane
