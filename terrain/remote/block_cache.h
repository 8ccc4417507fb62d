// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <compare>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// A block of a file whose content never changes.
struct BlockKey {
    std::string name;
    std::uint64_t file_bytes = 0;  ///< size of the whole file
    std::uint64_t offset = 0;      ///< of the block
    std::uint64_t bytes = 0;       ///< size of the block
    friend auto operator<=>(const BlockKey&, const BlockKey&) = default;
};

/// Blocks on disk, one file each, with a checksum. Processes share a folder without locks: a file appears complete
/// under its name. A process that is killed leaves files under temporary names, which are evicted like others.
///
/// Blocks are removed in the order of their last use when all files together exceed 3/4 of the ceiling. As a process
/// counts the files after each 32nd of the ceiling that it writes, up to 8 processes together stay below it.
///
/// A folder that cannot be read or written is an empty cache. Threads: any number at once
class BlockCache {
public:
    /// @param folder empty: no cache
    BlockCache(std::string folder, std::uint64_t most_bytes);

    /// The content of a block, if it is there and undamaged; marks it as used. A damaged file is removed.
    std::optional<std::vector<std::uint8_t>> find(const BlockKey& key);
    /// Whether there is a file for a block, which may be damaged.
    bool contains(const BlockKey& key) const;
    /// Writes a block; a fault is only counted.
    void insert(const BlockKey& key, std::span<const std::uint8_t> content);
    /// Removes a block.
    void discard(const BlockKey& key);

    std::uint64_t damaged_blocks() const { return damaged_blocks_; }
    std::uint64_t faults() const { return faults_; }

private:
    std::string path_of(const BlockKey& key) const;
    bool write(const std::string& path, std::span<const std::uint8_t> header,
               std::span<const std::uint8_t> content) const;
    void make_space(std::uint64_t bytes);
    void evict() const;

    const std::string folder_;
    const std::uint64_t most_bytes_;
    std::mutex mutex_;  // of the count below
    // bytes since the files were counted; nothing: they never were
    std::optional<std::uint64_t> written_;
    std::atomic<std::uint64_t> damaged_blocks_{0}, faults_{0};
};

}  // namespace terrane::internal
