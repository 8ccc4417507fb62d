// SPDX-License-Identifier: MIT
#pragma once

#include "edit/edited_volumes.h"

#include <terrane/base/result.h>
#include <terrane/store/sealed_file.h>
#include <terrane/volume/volume_shapes.h>

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// A dig or fill, or an undo of one.
struct LogRecord {
    std::uint32_t number = 0;                  ///< number of the change: ascending, 1 to 2^31 - 1
    std::uint32_t undone = 0;                  ///< undo only: number of the undone edit
    std::optional<VolumeOperation> operation;  ///< absent for an undo
};

/// Log file of changes, in order.
///
/// Format, little-endian: the 8 characters "TRNDIGS\n", the version (32 bits), the fingerprint of the volumes (128
/// bits), XXH3 of these 28 bytes (64 bits); then records: length of the content (32 bits), content, XXH3 (64 bits) of
/// the previous hash and the content. Content: number (32 bits), kind (8 bits: 0 an edit, 1 an undo), then the
/// operation (level_set/shapes.h) or the number of the undone edit. The hashes form a chain, so that the hash of a
/// record identifies the log up to it.
class DigLog {
public:
    /// Opens a log, or starts an empty one if there is no file. An incomplete record at the end is dropped: append()
    /// never reported success for it.
    ///
    /// Fails: io; bad_data for a file that is no log, of a newer version, of other volumes, or damaged before its end
    static Result<DigLog> open(std::string path, const std::array<std::uint64_t, 2>& fingerprint);

    const std::vector<LogRecord>& records() const { return records_; }
    /// [records] hash of the log up to each record.
    const std::vector<std::uint64_t>& hashes() const { return hashes_; }
    /// Bytes of an incomplete record at the end of the file when it was opened.
    std::uint64_t torn_bytes() const { return torn_bytes_; }

    /// Adds a record in memory, and returns the hash of the log up to it. Cost: O(bytes of the record)
    std::uint64_t add(LogRecord record);
    /// Appends the records that the file does not have yet, and flushes it to the disk.
    ///
    /// Fails: io; the file is then truncated to its previous end, and the next call tries again
    Result<void> save();

private:
    DigLog(std::string path, const std::array<std::uint64_t, 2>& fingerprint);
    Result<void> parse(std::span<const std::uint8_t> bytes);

    std::string path_;
    std::vector<std::uint8_t> header_;
    std::vector<LogRecord> records_;
    std::vector<std::uint64_t> hashes_;
    std::vector<std::uint8_t> unsaved_;  // serialised records
    std::uint64_t saved_bytes_ = 0;      // complete records in the file; 0: no file
    std::uint64_t file_bytes_ = 0;       // size of the file as far as known
    std::uint64_t torn_bytes_ = 0;
};

/// A folder of files with the level sets of edited chunks, one per chunk, so that loading a chunk need not apply all
/// its edits again. A file holds a chunk as it was at one position in the log; later edits are applied when it is read.
///
/// Each is a sealed file (terrane/store/sealed_file.h): written under another name, flushed and renamed. Its directory
/// has the hashes of the volumes, of the log up to that position, of the tiles' heights and of each tile's bytes. All
/// hashes are checked before OpenVDB reads a byte, because OpenVDB's reader is not hardened. A file that does not match
/// is refused and counted, and the chunk is made from its volumes and edits.
///
/// Threads: any number
class ChunkFiles {
public:
    ChunkFiles(std::string folder, const Volumes& volumes);

    /// Registers the hash of the log up to a change.
    void add_position(std::uint32_t number, std::uint64_t log_hash);

    struct Read {
        std::shared_ptr<const ChunkTiles> tiles;
        std::size_t edit_count = 0;  ///< edits of the list that are applied to the tiles
    };
    /// Reads the tiles of a chunk; absent if there is no file, it does not match, or it has an edit that was undone.
    std::optional<Read> read(const Chunk& chunk, const ChunkEdits& edits) const;
    /// Writes the file of a chunk as it is after a change. Fails: io; the previous file is then left as it was
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
