// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// Part of a sealed file, compressed, with the hash of its content.
struct SealedRecord {
    std::uint64_t offset = 0, stored_bytes = 0, content_bytes = 0;
    ContentHash hash;

    static Result<SealedRecord> append(SealedWriter& file, std::span<const std::uint8_t> content);
    /// Fails: io; bad_data if the record is damaged
    Result<std::vector<std::uint8_t>> read(const SealedReader& file) const;

    void put(ByteWriter& out) const;
    static SealedRecord get(ByteReader& in);
};

/// Samples of a square, filled.
struct ScannedSquare {
    std::vector<std::uint32_t> packed;  ///< [rows * columns]
    std::vector<std::uint8_t>
        flags;  ///< [rows * columns] bits of CellFlag; empty: all samples have data
};

/// What an earlier pass over a raster found, so that its samples can be read by window: a hash for each square of
/// kSide x kSide samples, which finds a raster that has changed since; and the squares with nodata, whose filling
/// depends on the whole raster.
/// Threads: any number at once.
class ScannedSamples {
public:
    static constexpr int kSide = 256;

    /// Statistics and packing of the samples.
    struct Summary {
        double min_m = 0.0, max_m = 0.0, nodata_share = 0.0, filled_share = 0.0;  ///< as in DemInfo
        double base = 0.0, step = 1.0;  ///< of the packing
        bool is_integer = false;
        double rounding = 0.0;  ///< RasterSamples::rounding()
    };
    using GetSquare = std::function<Result<ScannedSquare>(int square_x, int square_y)>;

    /// Writes the squares with nodata as records of a file, and the rest to `directory`.
    ///
    /// Fails: io; as get_square
    static Result<void> write(int columns, int rows, const Summary& summary,
                              const GetSquare& get_square, SealedWriter& file,
                              ByteWriter& directory);
    /// Fails: bad_data if the bytes do not match a raster of this size
    static Result<std::shared_ptr<const ScannedSamples>> read(
        int columns, int rows, std::shared_ptr<const SealedReader> file, ByteReader& directory);

    const Summary& summary() const { return summary_; }
    /// Hash of all samples.
    ContentHash hash() const;
    /// Whether no sample is nodata.
    bool is_whole() const { return voids_.empty(); }

    /// Whether a square has nodata; square() then has its samples.
    bool has_nodata(int square_x, int square_y) const {
        return voids_.contains(index_of(square_x, square_y));
    }
    /// Fails: io; bad_data if the record is damaged
    Result<ScannedSquare> square(int square_x, int square_y) const;
    /// Whether these are the samples of a square, with no_data() for those without data.
    bool is_same(int square_x, int square_y, std::span<const std::uint32_t> packed) const {
        return hash_of_samples(packed) == hashes_[index_of(square_x, square_y)];
    }
    /// No packed height.
    std::uint32_t no_data() const { return no_data(summary_.is_integer); }

private:
    static constexpr std::uint32_t no_data(bool is_integer) {
        return is_integer ? 0x80000000u : 0xffffffffu;  // the least integer, or a NaN
    }
    ScannedSamples(int columns, int rows) : columns_(columns), rows_(rows) {}
    static std::uint64_t hash_of_samples(std::span<const std::uint32_t> packed);
    static int squares_along(int samples) { return (samples + kSide - 1) / kSide; }
    std::size_t index_of(int square_x, int square_y) const {
        return static_cast<std::size_t>(square_y) *
                   static_cast<std::size_t>(squares_along(columns_)) +
               static_cast<std::size_t>(square_x);
    }

    int columns_, rows_;
    Summary summary_;
    std::vector<std::uint64_t> hashes_;  ///< of squares, row by row from the south-west
    std::map<std::size_t, SealedRecord> voids_;
    std::shared_ptr<const SealedReader> file_;
};

}  // namespace terrane::internal
