// SPDX-License-Identifier: MIT
#pragma once

#include "edit/edit.h"

#include <terrane/store/sealed_file.h>

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace terrane::internal {

/// Files with the level sets of edited chunks, one each, in a folder: so that a chunk is loaded without applying all of
/// its edits again. A file holds a chunk at one number of the log; edits after it are applied when it is read.
///
/// A file is a sealed file (store/sealed_file.h): written to another name, flushed and renamed. Its directory has the
/// hashes of the volumes, of the log up to that number, of the tiles' heights and of each tile's bytes. All are
/// compared before OpenVDB sees a byte, because its reader is not hardened. A file that does not agree is refused and
/// counted, and the chunk is made from its volumes and edits.
///
/// Threads: any number
class ChunkFiles {
public:
    ChunkFiles(std::string folder, const Volumes& volumes);

    /// Tells the hash of the log up to a number.
    void add_position(std::uint32_t number, std::uint64_t log_hash);

    struct Read {
        std::shared_ptr<const ChunkTiles> tiles;
        std::size_t edit_count = 0;  ///< edits of the list that the tiles have
    };
    /// None where there is no file, or it is of no use.
    std::optional<Read> read(const Chunk& chunk, const ChunkEdits& edits) const;
    /// Fails: io; then the file before is left as it was
    Result<void> write(const ChunkKey& key, const ChunkTiles& tiles, std::uint32_t position) const;

    std::string path_of(const ChunkKey& key) const;
    struct Counts {
        std::uint64_t read = 0, refused = 0, written = 0;
        std::string last_refusal;
    };
    Counts counts() const;

private:
    Result<std::optional<Read>> try_read(const Chunk& chunk, const ChunkEdits& edits) const;
    std::optional<std::uint64_t> log_hash(std::uint32_t number) const;

    const std::string folder_;
    const Volumes volumes_;
    mutable std::mutex mutex_;
    std::map<std::uint32_t, std::uint64_t> log_hashes_;
    mutable Counts counts_;
};

}  // namespace terrane::internal
