// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace terrane {

struct BakeSettings {
    /// Levels to bake, from the root squares on; 0: all that the source has.
    int level_count = 0;
    /// The part of the world to bake, metres, widened to whole root squares of the store. Its roots are the
    /// largest chunks that are no larger than the region. Absent: everything.
    std::optional<WorldRect> region = std::nullopt;
    int worker_count = 0;  ///< threads; 0: as many as the machine has. The file is the same.
    /// Kept in the store, and counted in its sha; any bytes, at most 2^20.
    std::string note = {};
    /// Called between chunks by the calling thread with the share that is done, 0 to 1; false gives up.
    std::function<bool(double)> progress = {};
};

/// What a store holds.
struct StoreInfo {
    std::int64_t chunk_count = 0;
    std::uint64_t bytes = 0;  ///< of the file
    /// Nowhere on the ground does the surface of the finest baked level leave the true surface of the source
    /// that was baked by more, vertically; metres, certified.
    double max_error_m = 0.0;
    /// SHA-256 of what the store holds, 64 hexadecimal digits: the same on every machine, by any number of
    /// threads, whatever version of the compressor.
    std::string sha;
    std::string note;
};

/// A file of all chunks of a world, with their certified bounds, that any source was baked to, and that is a
/// source itself.
///
/// Its chunks are those of the source that was baked, bit for bit, and so are the meshes of its levels.
/// Its true surface is the triangulation of its finest level: height() gives that, and bounds and intervals
/// hold for it and for the surface that was baked. rise_bound() is that of the surface that was baked; over
/// more than a spacing the triangulation may rise by 2 max_error_m more. Beyond the world it repeats the
/// border.
///
/// docs/store.md describes the file.
class ChunkStore {
public:
    ChunkStore() = delete;

    /// Makes all chunks of a source and writes them. The file appears when it is whole; one that was there is
    /// replaced then.
    ///
    /// Fails: invalid_argument for settings out of range, or a world of more than 2^26 chunks; cancelled;
    ///        io where the file cannot be written; as make_chunk(). Leaves no file then.
    /// Cost:  that of all chunks: about 10 ms a chunk and thread. Memory: 0.5 MB a thread, and 64 bytes a chunk.
    static Result<StoreInfo> bake(const HeightSource& source, const std::string& path,
                                  const BakeSettings& settings);

    /// Opens a store. Chunks are read and checked when they are asked for, by any thread, without locks.
    ///
    /// Fails: io where it cannot be read; bad_data where it is no store, of another version, or damaged
    /// Cost:  that of its directory, about 64 bytes a chunk
    static Result<std::shared_ptr<const HeightSource>> open(const std::string& path,
                                                            StoreInfo* info_out = nullptr);

    /// Whether a file is a store, of any version; false where it cannot be read.
    static bool is_store(const std::string& path);
};

}  // namespace terrane
