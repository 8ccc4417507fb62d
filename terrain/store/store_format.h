// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/bilinear_grid.h"
#include "bilinear/raster_samples.h"
#include "chunk/chunk_vertices.h"

#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// SHA-256 of bytes, as 64 hexadecimal digits.
std::string sha256(std::span<const std::uint8_t> bytes);

/// A part of a file, compressed, and the hash of its content.
struct StoredRecord {
    std::uint64_t offset = 0;
    std::uint32_t bytes = 0;  ///< in the file
    ContentHash hash;         ///< of the uncompressed content
};

/// A square of a raster, by its column and row among the squares.
struct SquareKey {
    int x = 0, y = 0;
};

/// A rectangle of squares.
struct SquareRange {
    int first_column = 0, first_row = 0;
    int column_count = 0, row_count = 0;

    std::size_t count() const {
        return static_cast<std::size_t>(column_count) * static_cast<std::size_t>(row_count);
    }
    bool contains(const SquareKey& square) const {
        return square.x >= first_column && square.y >= first_row &&
               square.x - first_column < column_count && square.y - first_row < row_count;
    }
    SquareKey key_at(std::size_t index) const {
        const auto columns = static_cast<std::size_t>(column_count);
        return {first_column + static_cast<int>(index % columns),
                first_row + static_cast<int>(index / columns)};
    }
    /// Index of a square of the range, row by row from the south-west.
    std::size_t index_of(const SquareKey& square) const {
        return static_cast<std::size_t>(square.y - first_row) *
                   static_cast<std::size_t>(column_count) +
               static_cast<std::size_t>(square.x - first_column);
    }
};

/// The raster whose samples a store holds instead of the heights of its finest levels.
struct StoredRaster {
    /// Samples along the side of a square; the last squares of rows and columns may be smaller.
    static constexpr int kSquareSide = 128;

    BilinearGrid grid;  ///< its lattice is the store's
    SamplePacking packing = SamplePacking::of_parts(0.0, 1.0, false);
    double rounding = 0.0;      ///< RasterSamples::rounding()
    std::vector<double> rises;  ///< HeightSource::rise_bound() of the source, at rise_distances()
    SquareRange squares;        ///< that the store holds

    /// Number of samples along the sides of a square.
    int columns_of(int column) const {
        return std::min(kSquareSide, grid.columns - column * kSquareSide);
    }
    int rows_of(int row) const { return std::min(kSquareSide, grid.rows - row * kSquareSide); }
};

/// The squares of a raster from which make_chunk() computes chunks over a rectangle of lattice points.
///
/// @param step of the chunks' level, at most that of the coarsest level which is computed from samples
SquareRange squares_around(const BilinearGrid& grid, const LatticePoint& south_west,
                           const LatticePoint& north_east, std::int64_t step);

/// What the record of a chunk holds, besides flags of cells. The rest is computed from the raster of the store.
enum class ChunkContent {
    all,            ///< heights, bounds and reaches
    vertex_bounds,  ///< bounds of vertices, also of coarser ones, which take longest to compute
    flags,          ///< nothing else
};

/// What the records of a level hold: at the spacing of the raster's cells and below, flags; at twice this spacing, and
/// for root squares, bounds of vertices; at greater spacings and without a raster, all.
ChunkContent content_of(const Lattice& lattice, const std::optional<StoredRaster>& raster,
                        int level);

/// Encodes fields of a chunk as bytes that compress well: heights and cell bounds become differences from a prediction
/// by their neighbours, and numbers are split into planes of their first, second ... bytes. Gives the same bytes on
/// every machine. With ChunkContent::all it encodes the fields that complete_chunk() does not compute.
std::vector<std::uint8_t> encode_chunk(const Chunk& chunk,
                                       ChunkContent content = ChunkContent::all);

/// Upper limit of the size of an encoded chunk.
std::size_t max_encoded_bytes();

/// Decodes a chunk that was encoded with ChunkContent::all.
///
/// Fails: bad_data if the bytes are not an encoded chunk
Result<std::shared_ptr<const Chunk>> decode_chunk(std::span<const std::uint8_t> bytes,
                                                  const Lattice& lattice, const ChunkKey& key);

/// What was encoded with another ChunkContent.
struct PartialChunk {
    std::shared_ptr<ChunkVertices> vertices;  ///< with bounds alone; null if there are none
    MostBounds most;
    std::vector<std::uint8_t> cell_flags;  ///< as Chunk::cell_flags
};

/// @param is_root whether the chunk has bounds of coarser vertices
///
/// Fails: bad_data if the bytes are not an encoded chunk with this content
Result<PartialChunk> decode_partial(std::span<const std::uint8_t> bytes, ChunkContent content,
                                    bool is_root);

/// Encodes the samples of a square of a stored raster, packed as in StoredRaster::packing.
///
/// @param packed [rows * columns]
std::vector<std::uint8_t> encode_square(std::span<const std::uint32_t> packed, bool is_integer,
                                        int columns);
/// Fails: bad_data if the bytes are not an encoded square of this size
Result<std::vector<std::uint32_t>> decode_square(std::span<const std::uint8_t> bytes,
                                                 bool is_integer, int columns, int rows);
/// Upper limit of the size of an encoded square.
std::size_t max_square_bytes();

/// A hash as two numbers of 64 bits.
void put_hash(ByteWriter& out, const ContentHash& hash);
ContentHash get_hash(ByteReader& in);

inline constexpr SealedKind kStoreKind{{'C', 'H', 'N', 'K'}, 2};
inline constexpr std::int64_t kMostChunks = std::int64_t{1} << 26;
inline constexpr std::size_t kLongestNote = std::size_t{1} << 20;

/// Location and hash of an encoded chunk, and its interval of heights.
struct ChunkRecord : StoredRecord {
    HeightInterval heights;
};

/// What a store says about all of its ground.
struct StoreWorld {
    Lattice lattice;
    WorldRect extent;
    double max_error_m = 0.0;
    std::vector<double> rises;  ///< HeightSource::rise_bound() at rise_distances()
    std::string note;
    std::optional<StoredRaster> raster;
};

/// The content of a store in one file, except the chunks.
struct StoreDirectory : StoreWorld {
    std::vector<ChunkRecord> chunks;    ///< level by level; row by row from the south-west
    std::vector<StoredRecord> squares;  ///< of the raster, row by row from the south-west

    std::size_t index_of(const ChunkKey& key) const;
};

/// Whether a chunk or a surface can be computed from the numbers: they are in range, and agree with each other.
bool is_valid(const StoredRaster& raster);

/// Number of chunks on all levels of a lattice; kMostChunks + 1 if it exceeds kMostChunks.
std::int64_t count_chunks(const Lattice& lattice);
/// The key of a chunk by its index in StoreDirectory::chunks.
ChunkKey key_at(const Lattice& lattice, std::int64_t index);
/// The distances for which rise bounds are stored, in increasing order. A triangulator uses no others.
std::vector<double> rise_distances(const Lattice& lattice);

std::vector<std::uint8_t> encode(const StoreDirectory& directory);
/// Fails: bad_data if the bytes are not a valid directory
Result<StoreDirectory> decode_directory(std::span<const std::uint8_t> bytes);

/// SHA-256 of the content of a store, excluding offsets in the file and compressed sizes.
std::string sha_of(const StoreDirectory& directory);

}  // namespace terrane::internal
