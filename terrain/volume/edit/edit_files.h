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
    std::uint32_t number = 0;                  ///< ascending, 1 to 2^31 - 1
    std::uint32_t undone = 0;                  ///< number of the edit that an undo takes back
    std::optional<VolumeOperation> operation;  ///< none: an undo
};

/// A file of changes in their order.
///
/// Format, little-endian: the 8 characters "TRNDIGS\n", the version (32 bits), the fingerprint of the volumes (128
/// bits), XXH3 of these 28 bytes (64 bits); then records: length of the content (32 bits), content, XXH3 (64 bits) of
/// the hash before and the content. Content: number (32 bits), kind (8 bits: 0 an edit, 1 an undo), then the operation
/// (level_set/shapes.h) or the number of the undone edit. Hashes form a chain, so that the hash of a record
/// stands for the log up to it.
class DigLog {
public:
    /// Opens a log, or begins one where there is no file. A record at the end that was not written whole is left out:
    /// no append() had succeeded with it.
    ///
    /// Fails: io; bad_data for no log, a newer version, other volumes, or damage before the end
    static Result<DigLog> open(std::string path, const std::array<std::uint64_t, 2>& fingerprint);

    const std::vector<LogRecord>& records() const { return records_; }
    /// [records] hash of the log up to each.
    const std::vector<std::uint64_t>& hashes() const { return hashes_; }
    /// Bytes at the end of the file that were no whole record when it was opened.
    std::uint64_t torn_bytes() const { return torn_bytes_; }

    /// Adds a record in memory, and returns the hash up to it. Cost: O(its bytes)
    std::uint64_t add(LogRecord record);
    /// Appends what the file does not have yet, and flushes it to the disk.
    ///
    /// Fails: io; then the file ends as before, and the next call tries again
    Result<void> save();

private:
    DigLog(std::string path, const std::array<std::uint64_t, 2>& fingerprint);
    Result<void> parse(std::span<const std::uint8_t> bytes);

    std::string path_;
    std::vector<std::uint8_t> header_;
    std::vector<LogRecord> records_;
    std::vector<std::uint64_t> hashes_;
    std::vector<std::uint8_t> unsaved_;  // bytes of records
    std::uint64_t saved_bytes_ = 0;      // of the file that are whole; 0: no file
    std::uint64_t file_bytes_ = 0;       // of the file as we know it
    std::uint64_t torn_bytes_ = 0;
};

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
