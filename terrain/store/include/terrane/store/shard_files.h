// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

namespace terrane {

/// A range of a file whose bytes never change: the name of a shard depends on its content.
struct FileRange {
    std::string name;                   ///< of the file
    std::uint64_t file_bytes = 0;       ///< size of the whole file; the range is inside it
    std::uint64_t offset = 0;           ///< of the first byte of the range
    std::span<std::uint8_t> bytes_out;  ///< of the range
};

/// A range that may be read soon.
struct ExpectedRange {
    std::string name;              ///< of the file
    std::uint64_t file_bytes = 0;  ///< size of the whole file; the range is inside it
    std::uint64_t offset = 0;      ///< of the first byte of the range
    std::uint64_t bytes = 0;       ///< size of the range
    /// Read only together with a range beside it that is read sooner.
    bool is_later = false;
};

/// Where the files of a sharded store are: a folder, or a server.
/// Threads: any number at once
class ShardFiles {
public:
    virtual ~ShardFiles() = default;

    /// The folder or address, for messages.
    virtual const std::string& place() const = 0;

    /// Reads a whole file, which may have changed since the last call.
    /// Fails: io; timed_out; bad_data if it has more than `most_bytes`
    virtual Result<std::vector<std::uint8_t>> read_whole(const std::string& name,
                                                         std::size_t most_bytes) const = 0;

    /// Reads all of the ranges, at the same time where that is faster.
    ///
    /// Fails: io; timed_out; bad_data if a file does not have its size; cancelled after a request to stop
    virtual Result<void> read(std::span<const FileRange> ranges,
                              const std::stop_token& stop) const = 0;

    /// Says which ranges will be read soon, the most urgent one first, and after them those that may be read later.
    /// Files that are slow may begin to read them. Replaces what the last call said. Does not wait.
    virtual void expect(std::span<const ExpectedRange> /*ranges*/) const {}

    /// Says that bytes which were read are damaged. Returns whether they came from a cache, which has dropped them, so
    /// that read() may give others.
    virtual bool discard(const FileRange& /*range*/) const { return false; }

    /// Whether read() may take long. If so, functions that must answer from memory do not call it.
    virtual bool is_slow() const { return false; }
};

/// The files of a folder. Files are opened when they are first read; at most 64 are open.
/// Fails: io if it is no folder
Result<std::shared_ptr<const ShardFiles>> open_shard_folder(const std::string& folder);

}  // namespace terrane
