// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/raster_samples.h"
#include "raster/cancellable_work.h"
#include "raster/raster_reader.h"
#include "raster/scanned_samples.h"
#include "raster/scratch_memory.h"
#include "raster/voids.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Number of rows in a strip that is read at once: a multiple of the block's side, about four million samples.
int strip_rows(int columns);

/// Internal settings, for tests.
struct StoreSettings {
    std::size_t memory_bytes = std::size_t{256}
                               << 20;  ///< for all samples; larger rasters are read by window
    std::size_t cache_bytes = std::size_t{128} << 20;  ///< cache of a raster read by window
    std::size_t limit_bytes = std::size_t{2} << 30;    ///< as DemSettings::memory_bytes
    double patience_s = 60.0;                          ///< as DemSettings::read_timeout
    DemCache bounds_cache = {};                        ///< see DemSettings::cache
    NumberReading reading = {};                        ///< of the raster's numbers
    double progress_share = 0.5;                       ///< of the whole opening, when all is read
    std::string scan_file = {};                        ///< as DemSettings::scan_file
    std::size_t scratch_above = std::size_t{64}
                                << 20;  ///< bytes of arrays above which a scan has them on the disk
};

/// The samples of a raster, with nodata filled: all finite, rows from south to north, heights relative to a base. They
/// are held in memory, or read by window through a cache of squares.
class RasterStore final : public RasterSamples {
public:
    /// Reads the raster once: finds nodata, fills it, and completes the reader's DemInfo. A band whose numbers are not
    /// exact as floats is read once more, beforehand, to find its range.
    ///
    /// @param needed_bytes part of the limit reserved for everything except runs and rims of nodata
    /// @param scratch      for arrays with an entry for each block of samples; null: in ordinary memory
    ///
    /// Fails: io; timed_out; cancelled; bad_data if no sample is valid, or one is beyond kMostHeight; out_of_memory if
    ///        nodata needs more than the limit
    static Result<std::unique_ptr<RasterStore>> open(std::shared_ptr<const HeightReader> reader,
                                                     const StoreSettings& settings,
                                                     double needed_bytes,
                                                     std::shared_ptr<ScratchMemory> scratch,
                                                     OpeningProgress& progress);

    /// The samples of a raster that was opened before, always read by window. Reads fail with bad_data in squares that
    /// have changed since. Requires a scan of a raster of this size.
    static std::unique_ptr<RasterStore> reopen(std::shared_ptr<const HeightReader> reader,
                                               const StoreSettings& settings,
                                               std::shared_ptr<const ScannedSamples> scan);
    /// Compares all samples of a reopened raster with the scan: one pass.
    /// Fails: io; bad_data if one is another; cancelled
    Result<void> check_all(OpeningProgress& progress) const;
    /// Writes what reopen() needs.
    /// Fails: io
    Result<void> write(SealedWriter& file, ByteWriter& directory) const;

    const DemInfo& info() const { return info_; }
    /// Memory for arrays that grow with the raster; exists as long as this store.
    std::pmr::memory_resource* memory() const {
        return scratch_ ? scratch_->resource() : std::pmr::get_default_resource();
    }
    /// Whether no sample is nodata.
    bool is_whole() const { return scan_ ? scan_->is_whole() : voids_.empty(); }
    /// Bits of CellFlag over the samples of a closed rectangle inside the raster.
    /// Fails: io and bad_data if the raster was reopened
    Result<std::uint8_t> flags(int west, int south, int east, int north) const;
    bool in_memory() const { return !samples_.empty(); }

    const SamplePacking& packing() const override { return packing_; }
    double rounding() const override { return rounding_; }
    /// The distance due to resampling, beside that due to rounding, over a rectangle of cells: see HeightReader.
    bool is_resampled() const { return reader_->has_errors(); }
    double error_over(std::int64_t west, std::int64_t south, std::int64_t east,
                      std::int64_t north) const {
        return reader_->error_over(west, south, east, north);
    }

    Result<void> read(std::int64_t column, std::int64_t row, int columns, int rows,
                      std::span<double> heights_out) const override;

private:
    static constexpr int kSquareSide = ScannedSamples::kSide;

    RasterStore(std::shared_ptr<const HeightReader> reader, const StoreSettings& settings,
                double needed_bytes, std::shared_ptr<ScratchMemory> scratch);
    Result<void> choose_packing(OpeningProgress& progress);
    Result<void> first_pass(OpeningProgress& progress);
    Result<void> rim_pass();
    void fill_memory();
    std::uint32_t filled(int column, int row) const;
    void find_rounding(double of_packing);
    /// Calls use(south, rows, heights) with strips of the raster in the order of the file, metres, NaN: no data.
    /// Drivers for text and for compressed files read a file sequentially and stop where it is damaged.
    template <typename Use>
    Result<void> for_each_strip(OpeningProgress& progress, Use&& use) const;
    int strip_count() const;
    /// RasterReader::read with a timeout.
    Result<void> read_file(int column, int row, int columns, int rows,
                           std::span<double> heights_out) const;
    /// Fails: out_of_memory if nodata needs more than the remaining memory
    Result<void> check_nodata_bytes(std::size_t bytes) const;
    Result<std::shared_ptr<const SquareCache::Square>> read_square(int square_x,
                                                                   int square_y) const;
    /// The flags of a reopened raster's square with nodata, [rows * columns].
    Result<std::shared_ptr<const SquareCache::Square>> read_flags(int square_x, int square_y) const;

    std::shared_ptr<const HeightReader> reader_;  ///< shared with reads that timed out
    StoreSettings settings_;
    double needed_bytes_;
    std::unique_ptr<GuardedCalls> calls_;
    DemInfo info_;
    std::shared_ptr<ScratchMemory> scratch_;
    VoidMap voids_;
    std::optional<VoidFill> fill_;
    SamplePacking packing_;
    double rounding_ = 0.0;
    std::vector<std::uint32_t> samples_;          ///< empty if the raster is read by window
    std::shared_ptr<const ScannedSamples> scan_;  ///< of a raster that was reopened; otherwise null
    SquareCache squares_;                         ///< of a raster that is read by window
    SquareCache flag_squares_;                    ///< flags of a reopened raster
};

}  // namespace terrane::internal
