// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace terrane {

/// What bake() writes.
struct BakeSettings {
    /// Levels to bake, from the root squares on; 0: all.
    int level_count = 0;
    /// The part of the world to bake, metres, widened to whole root squares of the store. Its roots are the
    /// largest chunks that are no larger than the region. Absent: everything.
    std::optional<WorldRect> region = std::nullopt;
    int worker_count = 0;  ///< threads; 0: as many as the machine has. Does not change the file.
    /// Stored, and part of the sha; any bytes, at most 2^20.
    std::string note = {};
    /// Called between chunks by the calling thread with the share that is done, 0 to 1; returning false cancels.
    std::function<bool(double)> progress = {};
};

/// Information about a store.
struct StoreInfo {
    std::int64_t chunk_count = 0;  ///< chunks in the file
    std::uint64_t bytes = 0;       ///< of the file
    /// Certified bound of the vertical distance between the surface of the finest baked level and the true surface of
    /// the baked source, over all ground, metres.
    double max_error_m = 0.0;
    /// SHA-256 of the content, 64 hexadecimal digits: the same on every machine, with any number of threads and any
    /// version of the compressor.
    std::string sha;
    std::string note;  ///< BakeSettings::note
};

/// A file of all chunks of a world with their certified bounds, baked from any source; a source itself.
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

    /// Makes all chunks of a source and writes them. The file appears, or is replaced, atomically when it is complete.
    ///
    /// Fails: invalid_argument for settings out of range, or a world of more than 2^26 chunks; cancelled;
    ///        io if the file cannot be written; as make_chunk(). Then no file is left.
    /// Cost:  that of all chunks: about 10 ms a chunk and thread. Memory: 0.5 MB a thread, and 64 bytes a chunk.
    static Result<StoreInfo> bake(const HeightSource& source, const std::string& path,
                                  const BakeSettings& settings);

    /// Opens a store. Chunks are read and checked on demand, by any thread, without locks.
    ///
    /// Fails: io if it cannot be read; bad_data if it is no store, of another version, or damaged
    /// Cost:  that of its directory, about 64 bytes a chunk
    static Result<std::shared_ptr<const HeightSource>> open(const std::string& path,
                                                            StoreInfo* info_out = nullptr);

    /// Whether a file is a store, of any version; false if it cannot be read.
    static bool is_store(const std::string& path);
};

}  // namespace terrane
