// SPDX-License-Identifier: MIT
#pragma once

#include "edit/edited_volumes.h"

#include <map>
#include <string>

namespace terrane::internal {

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
