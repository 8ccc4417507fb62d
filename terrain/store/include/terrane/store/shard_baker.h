// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/store/chunk_store.h>
#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <memory>
#include <string>

namespace terrane {

/// Bakes a source as a sharded store: a folder with files of up to about 200 MB, which ChunkStore::open() opens. Shards
/// are baked in any order, by any number of processes and machines that share the folder and do not know of each
/// other; the files are the same. A shard whose process was killed is baked again; one that is complete is not.
///
/// Threads: any number at once; BakeSettings::progress is called on those that bake.
///
/// The format is described in docs/store.md.
class ShardBaker {
public:
    /// Plans the shards. Writes `plan.json` into the folder, which is created; if it is there, it must be of the same
    /// source and settings.
    ///
    /// @param source must outlive the baker
    ///
    /// Fails: as ChunkStore::bake(), but for the number of chunks; invalid_argument for more than 2^20 shards, or if
    ///        `plan.json` is of another source or of other settings
    static Result<ShardBaker> create(const HeightSource& source, const std::string& folder,
                                     const BakeSettings& settings);
    ShardBaker(ShardBaker&&) noexcept;
    ~ShardBaker();

    std::int64_t shard_count() const;  ///< all shards of the store
    /// Whether a shard is complete: its file is there, and its index is whole.
    bool is_baked(std::int64_t shard) const;
    /// Bakes a shard, unless it is complete. Returns whether it was not.
    ///
    /// Fails: invalid_argument if there is no such shard; cancelled by BakeSettings::progress; as ChunkStore::bake().
    ///        No partial file is left then.
    /// Cost:  as ChunkStore::bake(), of up to 1365 chunks
    Result<bool> bake_shard(std::int64_t shard) const;

    /// Compares a baked shard with the source: bakes some of its chunks and squares of samples again, without writing
    /// them. Returns how many were compared.
    ///
    /// @param every compares one of so many, from the first on; at least 1
    ///
    /// Fails: invalid_argument for a number out of range; io if the shard is not baked; bad_data if it is damaged, or
    ///        differs, naming the first chunk or square; as ChunkStore::bake()
    Result<std::int64_t> verify_shard(std::int64_t shard, std::int64_t every) const;

    /// Writes `terrain.json` from the shards of a plan, after which the folder is a store. Does not need the source.
    ///
    /// Fails: io; bad_data if a shard is missing or damaged, naming the first
    static Result<StoreInfo> combine(const std::string& folder);

private:
    struct State;
    explicit ShardBaker(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
