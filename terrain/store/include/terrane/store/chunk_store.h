// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/store/shard_files.h>
#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace terrane {

/// Settings of ChunkStore::bake().
struct BakeSettings {
    /// Number of levels to bake, from the root squares down; 0: all.
    int level_count = 0;
    /// Part of the world to bake, metres, extended to whole root squares of the store. Absent: the whole world. The
    /// root squares of the store are chunks of the source, of the finest level that is not smaller than the region.
    std::optional<WorldRect> region = std::nullopt;
    int worker_count = 0;  ///< threads; 0: as many as the machine has. Does not affect the file.
    /// Any bytes, at most 2^20, that are stored in the file and included in StoreInfo::sha.
    std::string note = {};
    /// ShardBaker only: text that differs if the source differs, such as a hash of its file. UTF-8.
    std::string fingerprint = {};
    /// Called on the calling thread, between batches of chunks, with the completed share; returning false cancels.
    std::function<bool(double)> progress = {};
};

/// Properties of a store.
struct StoreInfo {
    std::int64_t chunk_count = 0;  ///< chunks in the file
    std::uint64_t bytes = 0;       ///< size of the file
    /// Certified bound of the vertical distance between the triangles of the finest baked level and the source's true
    /// surface, over all ground, metres.
    double max_error_m = 0.0;
    /// SHA-256 of the content, 64 hexadecimal digits: independent of the machine, the number of threads and the version
    /// of the compressor.
    std::string sha;
    std::string note;  ///< BakeSettings::note
};

/// A file with all chunks of a world and their certified bounds, baked from any source. open() makes it a height
/// source. Of a raster it holds samples instead of the finest chunks, which are computed when they are read.
///
/// Its chunks, and so the meshes of its levels, have the same bits as those of the baked source. Its true surface is
/// the triangulation of its finest level, which height() returns; bounds and intervals hold for the triangulation and
/// for the baked surface. rise_bound() holds for the baked surface, and up to a distance of one spacing also for the
/// triangulation, which may rise by 2 max_error_m more over longer distances. Beyond the world the height of the
/// nearest border point is returned.
///
/// The file format is described in docs/store.md.
class ChunkStore {
public:
    ChunkStore() = delete;

    /// Makes all chunks of a source and writes them. The file appears, or is replaced, atomically when it is complete.
    ///
    /// Fails: invalid_argument for settings out of range, or a world of more than 2^26 chunks; cancelled by `progress`;
    ///        io if the file cannot be written; as make_chunk(). No partial file is left then.
    /// Cost:  about 10 ms per chunk, divided by the number of threads. Memory: 0.5 MB a thread, and 64 bytes a chunk
    static Result<StoreInfo> bake(const HeightSource& source, const std::string& path,
                                  const BakeSettings& settings);

    /// Opens a store: a file, the folder of a sharded store, or its `terrain.json`. Chunks are read and checked on
    /// demand, on any thread. Threads share a cache of a raster's samples of 8 MiB.
    ///
    /// Fails: io if it cannot be read; bad_data if it is not a store, has another version, or is damaged
    /// Cost:  reads the directory, about 64 bytes per chunk, or `terrain.json`
    static Result<std::shared_ptr<const HeightSource>> open(const std::string& path,
                                                            StoreInfo* info_out = nullptr);
    /// Opens a sharded store. Chunks are read and checked on demand, on any thread; if the files are slow, interval()
    /// may return the interval of a larger square until a chunk nearby has been read.
    ///
    /// Fails: as ShardFiles::read_whole(); bad_data if `terrain.json` has another version or makes no sense
    /// Cost:  reads `terrain.json`, about 80 bytes for 1365 chunks. Memory: 100 kB for each of the last 256 shards read
    static Result<std::shared_ptr<const HeightSource>> open(std::shared_ptr<const ShardFiles> files,
                                                            StoreInfo* info_out = nullptr);

    /// Whether a file or folder is a store, of any version; false if it cannot be read.
    static bool is_store(const std::string& path);
};

}  // namespace terrane
