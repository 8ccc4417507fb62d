// SPDX-License-Identifier: MIT
#pragma once

#include "raster/guarded_calls.h"
#include "raster/opening_progress.h"
#include "raster/raster_reader.h"
#include "raster/sample_packing.h"
#include "voids/void_fill.h"
#include "voids/void_map.h"

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace terrane::internal {

/// Rows of a strip that is read at once: a multiple of the block's side, as many as make about four
/// million samples.
int strip_rows(int columns);

/// What a program never has to know; tests do.
struct StoreSettings {
    std::size_t memory_bytes = std::size_t{256} << 20;  ///< larger rasters are read by window
    std::size_t cache_bytes = std::size_t{128} << 20;   ///< of a raster that is read by window
    std::size_t limit_bytes = std::size_t{2} << 30;     ///< as DemSettings::memory_bytes
    double patience_s = 60.0;                           ///< as DemSettings::read_timeout
    DemCache bounds_cache = {};                         ///< where what opening finds is kept
};

/// The samples of a raster after voids and outside were filled: every one finite, rows from south to
/// north, relative to a base. Held in memory, or read by window through a cache of squares.
class RasterStore {
public:
    /// Makes the first pass: finds nodata, fills it, and completes the reader's DemInfo. A band whose
    /// numbers no float holds is read once before that, for its range.
    ///
    /// @param needed_bytes  of the limit, for everything but runs and rims of nodata
    ///
    /// Fails: io; timed_out; cancelled; bad_data where no sample is valid, or one is beyond
    ///        kMostHeight; out_of_memory where nodata takes more than the limit
    static Result<std::unique_ptr<RasterStore>> open(std::unique_ptr<RasterReader> reader,
                                                     const StoreSettings& settings,
                                                     double needed_bytes,
                                                     OpeningProgress& progress);

    const DemInfo& info() const { return info_; }
    const VoidMap& voids() const { return voids_; }
    bool in_memory() const { return !samples_.empty(); }

    /// Heights are base() + what read() gives, metres.
    double base() const { return packing_.base(); }
    /// The surface between the heights that are held is nowhere further from the one between the
    /// file's own numbers, metres. 0 where no sample was rounded and heights are such that doubles
    /// know them to a small part of a nanometre.
    double rounding() const { return rounding_; }

    /// Fills a window of samples. It may reach beyond the raster: there the nearest sample is
    /// repeated.
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

    RasterStore(std::unique_ptr<RasterReader> reader, const StoreSettings& settings,
                double needed_bytes);
    Result<void> choose_packing(OpeningProgress& progress);
    Result<void> first_pass(OpeningProgress& progress);
    Result<void> rim_pass();
    void fill_memory();
    std::uint32_t filled(int column, int row) const;
    void find_rounding(double of_packing);
    /// Calls use(south, rows, heights) with strips of the raster in the order of the file, metres, NaN: no
    /// data. Readers of text and of compressed files go through a file once, and stop where it is damaged.
    template <typename Use>
    Result<void> for_each_strip(OpeningProgress& progress, Use&& use) const;
    int strip_count() const;
    /// As RasterReader::read, given up after a while.
    Result<void> read_file(int column, int row, int columns, int rows,
                           std::span<double> heights_out) const;
    /// Fails: out_of_memory where nodata takes more than is left
    Result<void> check_nodata_bytes(std::size_t bytes) const;
    Result<std::shared_ptr<const Square>> square(int square_x, int square_y) const;
    Result<std::shared_ptr<const Square>> read_square(int square_x, int square_y) const;

    std::shared_ptr<const RasterReader> reader_;  ///< shared with reads that were given up
    StoreSettings settings_;
    double needed_bytes_;
    std::unique_ptr<GuardedCalls> calls_;
    DemInfo info_;
    VoidMap voids_;
    std::optional<VoidFill> fill_;
    SamplePacking packing_;
    double rounding_ = 0.0;
    std::vector<std::uint32_t> samples_;  ///< empty where the raster is read by window

    mutable std::mutex mutex_;                ///< of the cache
    mutable std::list<std::int64_t> recent_;  ///< most recent first
    mutable std::unordered_map<std::int64_t, Cached> squares_;
};

}  // namespace terrane::internal
