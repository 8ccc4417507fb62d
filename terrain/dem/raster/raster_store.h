// SPDX-License-Identifier: MIT
#pragma once

#include "raster/cancellable_work.h"
#include "raster/raster_reader.h"
#include "raster/voids.h"

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace terrane::internal {

/// Packs the samples of a raster into 32 bits each: base + step * number, where the number is a float or an integer.
/// Unpacked heights are relative to the base, so that sums and differences keep their precision for heights far from 0.
class SamplePacking {
public:
    /// For bands whose numbers are exact as floats: no sample is rounded.
    ///
    /// @param scale, offset of the band, metres; may be infinite or NaN
    static SamplePacking of_floats(double scale, double offset);
    /// Packs heights as integer multiples of the smallest power of two for which 32 bits cover `low` to `high`, metres.
    static SamplePacking of_range(double low, double high);

    /// The base, metres, to which unpacked heights are relative.
    double base() const { return base_; }

    /// @param height  metres, not relative to the base; NaN: no data
    std::uint32_t pack(double height) const { return pack_relative(height - base_); }
    std::uint32_t pack_relative(double height) const;
    /// Metres from the base; NaN: no data.
    double unpack(std::uint32_t packed) const;
    void unpack(std::span<const std::uint32_t> packed, double* heights_out) const;

private:
    SamplePacking() = default;

    double base_ = 0.0;
    double step_ = 1.0;
    bool is_integer_ = false;
};

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
};

/// The samples of a raster, with nodata filled: all finite, rows from south to north, heights relative to a base. They
/// are held in memory, or read by window through a cache of squares.
class RasterStore {
public:
    /// Reads the raster once: finds nodata, fills it, and completes the reader's DemInfo. A band whose numbers are not
    /// exact as floats is read once more, beforehand, to find its range.
    ///
    /// @param needed_bytes part of the limit reserved for everything except runs and rims of nodata
    ///
    /// Fails: io; timed_out; cancelled; bad_data if no sample is valid, or one is beyond kMostHeight; out_of_memory if
    ///        nodata needs more than the limit
    static Result<std::unique_ptr<RasterStore>> open(std::shared_ptr<const HeightReader> reader,
                                                     const StoreSettings& settings,
                                                     double needed_bytes,
                                                     OpeningProgress& progress);

    const DemInfo& info() const { return info_; }
    const VoidMap& voids() const { return voids_; }
    bool in_memory() const { return !samples_.empty(); }

    /// Heights are base() plus the result of read(), metres.
    double base() const { return packing_.base(); }
    /// Upper bound of the vertical distance between the surfaces of the stored samples and of the file's, metres. 0 if
    /// no sample was rounded and doubles resolve the heights to a small fraction of a nanometre.
    double rounding() const { return rounding_; }
    /// Likewise the distance due to resampling, over a rectangle of cells: see HeightReader.
    bool is_resampled() const { return reader_->has_errors(); }
    double error_over(std::int64_t west, std::int64_t south, std::int64_t east,
                      std::int64_t north) const {
        return reader_->error_over(west, south, east, north);
    }

    /// Reads a window of samples. Beyond the raster the nearest sample is repeated.
    ///
    /// @param heights_out [rows * columns] metres from the base, from the south-west
    ///
    /// Fails:   io
    /// Threads: any
    Result<void> read(std::int64_t column, std::int64_t row, int columns, int rows,
                      std::span<double> heights_out) const;

private:
    static constexpr int kSquareSide = 256;
    using Square = std::vector<std::uint32_t>;
    struct Cached {
        std::shared_ptr<const Square> square;
        std::list<std::int64_t>::iterator place;
    };

    RasterStore(std::shared_ptr<const HeightReader> reader, const StoreSettings& settings,
                double needed_bytes);
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
    Result<std::shared_ptr<const Square>> square(int square_x, int square_y) const;
    Result<std::shared_ptr<const Square>> read_square(int square_x, int square_y) const;

    std::shared_ptr<const HeightReader> reader_;  ///< shared with reads that timed out
    StoreSettings settings_;
    double needed_bytes_;
    std::unique_ptr<GuardedCalls> calls_;
    DemInfo info_;
    VoidMap voids_;
    std::optional<VoidFill> fill_;
    SamplePacking packing_;
    double rounding_ = 0.0;
    std::vector<std::uint32_t> samples_;  ///< empty if the raster is read by window

    mutable std::mutex mutex_;                ///< of the cache
    mutable std::list<std::int64_t> recent_;  ///< most recent first
    mutable std::unordered_map<std::int64_t, Cached> squares_;
};

}  // namespace terrane::internal
