// SPDX-License-Identifier: MIT
#pragma once

#include "store_format.h"

#include <terrane/base/result.h>
#include <terrane/terrain/lattice.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// A sharded store: files that each hold a subtree of chunks, and `terrain.json`, which lists them. docs/store.md
// describes both.
namespace terrane::internal {

/// Most levels in a shard: 1365 chunks, up to about 200 MB.
inline constexpr int kShardLevels = 6;
inline constexpr std::int64_t kMostShards = std::int64_t{1} << 20;
inline constexpr SealedKind kShardKind{{'S', 'H', 'R', 'D'}, 1};
inline constexpr std::string_view kManifestName = "terrain.json";
inline constexpr std::size_t kMostManifestBytes = std::size_t{1} << 27;

/// What a shard holds: the chunks of a subtree, and a rectangle of squares of the raster's samples. Both are numbered
/// along a Z-order curve, the chunks level by level, so that neighbours are near each other in the file.
struct ShardExtent {
    ChunkKey root;
    int level_count = 0;
    SquareRange squares;

    std::size_t chunk_count() const;
    ChunkKey chunk_at(std::size_t index) const;
    std::size_t index_of(const ChunkKey& key) const;
};

/// The squares of a shard in their order.
std::vector<SquareKey> squares_of(const ShardExtent& extent);

/// How a world is divided into shards. From the finest level up, six levels at a time are one band; a shard is a chunk
/// of a band's coarsest level with its descendants in the band. Shards are numbered from the coarsest band on, row by
/// row from the south-west. A square of samples belongs to the shard of the finest band over which its south-western
/// sample lies.
class ShardLayout {
public:
    /// @param world must outlive the layout
    explicit ShardLayout(const StoreWorld& world);

    /// Number of shards; kMostShards + 1 if it exceeds kMostShards.
    std::int64_t count() const { return count_; }
    ShardExtent extent(std::int64_t shard) const;
    std::int64_t shard_of(const ChunkKey& key) const;
    std::int64_t shard_of(const SquareKey& square) const;

private:
    struct Band {
        int first_level = 0, level_count = 0;
        std::int64_t first_shard = 0, columns = 0, rows = 0;
    };
    std::int64_t shard_in(const Band& band, std::int64_t x, std::int64_t y) const;

    const StoreWorld& world_;
    std::vector<Band> bands_;  ///< the coarsest first
    std::int64_t count_ = 0;
    /// Of each column and row of squares that the store holds: of shards in the finest band. They do not decrease.
    std::vector<std::int64_t> shard_columns_, shard_rows_;
};

/// The directory of a shard.
struct ShardIndex {
    ShardExtent extent;
    double max_error_m = 0.0;           ///< of chunks of the finest level; 0 if there are none
    double steepest = 0.0;              ///< square of the steepest slope of their triangles
    std::vector<ChunkRecord> chunks;    ///< in the order of `extent`
    std::vector<StoredRecord> squares;  ///< likewise
};

std::vector<std::uint8_t> encode(const ShardIndex& index);
/// Fails: bad_data if the bytes are not the directory of a shard with this extent
Result<ShardIndex> decode_shard(std::span<const std::uint8_t> bytes, const ShardExtent& extent);
/// Size of encode() for an extent.
std::size_t encoded_bytes(const ShardExtent& extent);
/// Hash of the index without offsets and compressed sizes, as text: the name of the shard's file before ".shard".
std::string name_of(const ShardIndex& index);

/// A file of a sharded store. Its index, compressed, is at its end.
struct ShardFile {
    std::string name;  ///< name_of() its index; empty: not baked yet
    std::uint64_t bytes = 0;
    std::uint32_t index_bytes = 0;
    HeightInterval heights;  ///< of the root of the subtree

    std::string file_name() const { return name + ".shard"; }
};

/// One row of `terrain.json` as JSON text.
std::string encode_row(const ShardFile& shard);
/// Fails: bad_data
Result<ShardFile> decode_row(std::string_view text);

/// `terrain.json`: what a sharded store says about all of its ground, and its files.
struct Manifest {
    StoreWorld world;
    std::string fingerprint;        ///< BakeSettings::fingerprint
    std::vector<ShardFile> shards;  ///< in the order of ShardLayout
};

/// JSON text. Fails: invalid_argument if the note or the fingerprint is not UTF-8
Result<std::string> encode(const Manifest& manifest);
/// Fails: bad_data if the text is not a manifest: the message says which member is wrong
///
/// @param is_plan the shards are not known yet, and not read
Result<Manifest> decode_manifest(std::string_view text, bool is_plan);
/// SHA-256 of the content of a store, excluding compressed sizes.
std::string sha_of(const Manifest& manifest);

}  // namespace terrane::internal
