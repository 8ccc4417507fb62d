// SPDX-License-Identifier: MIT
#pragma once

#include "shard_format.h"
#include "store_format.h"

#include <terrane/base/result.h>
#include <terrane/store/chunk_store.h>
#include <terrane/store/shard_files.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

namespace terrane::internal {

/// Uncompressed content of a record; absent if it is damaged.
using RecordContent = std::optional<std::vector<std::uint8_t>>;

/// The records of a store, in one file or in shards. Threads: any number at once.
class StoreRecords {
public:
    virtual ~StoreRecords() = default;

    virtual const StoreWorld& world() const = 0;
    /// The file or folder, for messages.
    virtual const std::string& place() const = 0;
    /// Reads and checks the content of a chunk. Fails: io; timed_out; bad_data; cancelled
    virtual Result<RecordContent> chunk(const ChunkKey& key, const std::stop_token& stop) const = 0;
    /// Reads and checks squares of the raster's samples, in the given order; all must be stored. Fails: as chunk()
    virtual Result<std::vector<RecordContent>> squares(std::span<const SquareKey> keys,
                                                       const std::stop_token& stop) const = 0;
    /// Chunks, and squares of the raster, that will be read soon: see ShardFiles::expect(). All must be stored.
    struct Expected {
        ChunkKey chunk;
        std::vector<SquareKey> squares;
    };
    virtual void expect(std::span<const Expected> /*expected*/) const {}
    /// Contains the heights over a chunk. If records are slow to read, it may be that of an ancestor.
    virtual HeightInterval heights(const ChunkKey& key) const = 0;
    /// See ShardFiles::is_slow().
    virtual bool is_slow() const { return false; }
    /// Contains the heights of the whole world.
    HeightInterval range() const { return range_; }

protected:
    HeightInterval range_;
};

/// A store in one file.
/// Fails: as ChunkStore::open()
Result<std::unique_ptr<const StoreRecords>> open_file(const std::string& path, StoreInfo* info_out);

/// A store in shards.
/// Fails: as ChunkStore::open()
Result<std::unique_ptr<const StoreRecords>> open_shards(std::shared_ptr<const ShardFiles> files,
                                                        StoreInfo* info_out);

StoreInfo info_of(const Manifest& manifest);

/// Reads the index of a shard. Fails: io; timed_out; bad_data, naming the file; cancelled
Result<ShardIndex> read_index(const ShardFiles& files, const ShardFile& shard,
                              const ShardExtent& extent, const std::stop_token& stop);

/// Whether a record of a shard is stored as its index says. Fails: as read_index()
Result<bool> is_whole_record(const ShardFiles& files, const ShardFile& shard,
                             const StoredRecord& record, std::size_t most_bytes);

}  // namespace terrane::internal
