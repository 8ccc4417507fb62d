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

/// What the volumes over the square of a chunk add to the heightfield: see ChunkSource::solid_extent().
struct SolidExtent {
    /// Bound of the distance, both ways, of the heightfield alone from the true surface, metres.
    double error_m = 0.0;
    HeightInterval heights;  ///< encloses the surfaces of volumes, world z, metres
};

/// Implemented by height sources that have chunks of their own beside their heights: a baked store, a heightfield with
/// volumes. The defaults suit a source all of whose chunks are computed from its heights; a source overrides the
/// functions in which it differs.
///
/// Threads: any number at once, as HeightSource
class ChunkSource {
public:
    virtual ~ChunkSource() = default;

    /// A stored chunk, which make_chunk() then returns instead of making one; null: none is stored.
    ///
    /// @param key  of a chunk of the source's world
    /// @param stop a long call may fail with `cancelled` if this is requested
    ///
    /// Fails: io; bad_data if the stored chunk is damaged
    virtual Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                              const std::stop_token& stop) const;

    /// What the true surface over the square of a chunk of any level has besides the heightfield: caves, tunnels,
    /// overhangs. Chunks of the finest level then have a Chunk::solid. Called in updates when chunks arrive or leave:
    /// must answer from memory.
    virtual std::optional<SolidExtent> solid_extent(const ChunkKey& key) const;

    /// Whether a point of finite coordinates is in a volume, or so near that rounding may decide: a triangle of the
    /// finest spacing is part of the surface where none of its corners is. Changes at run time do not count, so that
    /// the answer stays the same. Must answer from memory.
    virtual bool is_in_volume(double x, double y, double z) const;

    /// Most bytes of a chunk, Chunk::max_bytes() without volumes: what a load claims of the byte ceiling. A chunk that
    /// turns out larger is not taken: it is loaded again at once if this is more by then, else it counts as a failed
    /// load.
    virtual std::size_t max_chunk_bytes(const ChunkKey& key) const;

    /// Whether a chunk that was loaded is still what the source would make of its key. A pager asks before it inserts
    /// one, and loads the chunk again where the answer is no: the source has changed during the load.
    virtual bool is_current(const Chunk& chunk) const;
};

/// The chunks of a height source: the source itself if it is a ChunkSource, otherwise one with the answers above. Lives
/// as long as the source.
const ChunkSource& chunks_of(const HeightSource& source);

/// A change of a source, as a pager follows it: see replace_chunks().
struct ChunkReplacement {
    /// New chunks, a key at most once; those whose keys are not resident are ignored.
    std::span<const std::shared_ptr<const Chunk>> chunks;
    /// Keys of all chunks whose ChunkSource::solid_extent() changes, of any level.
    std::span<const ChunkKey> changed;
    /// Called once, when nothing can fail any more: brings the source up to date. Loads in flight whose chunks are not
    /// ChunkSource::is_current() after it are dropped when they arrive.
    std::function<void()> switch_source;
};

/// For sources that change while a pager runs, as by a VolumeEditor: swaps all resident ones of the changed chunks at
/// once, in the set of the next Pager::update() or finish(), without fades. Chunks that are not resident are left to
/// their next load. All or nothing: the new chunks' bytes are claimed first, while the old ones still count; where they
/// do not fit, nothing happens, the next update() evicts others for them and keeps room, and the call is to be repeated
/// after it.
///
/// Returns: whether it happened
/// Threads: the pager's
/// Cost:    O(chunks + changed * levels)
[[nodiscard]] bool replace_chunks(Pager& pager, const ChunkReplacement& replacement);

}  // namespace terrane
