// SPDX-License-Identifier: MIT
#pragma once

#include "raster_reader.h"
#include "sample_packing.h"
#include "void_fill.h"
#include "void_map.h"

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace terrane::internal {

/// What a program never has to know; tests do.
struct StoreSettings {
    std::size_t memory_bytes = std::size_t{256} << 20;  ///< larger rasters are read by window
    std::size_t cache_bytes = std::size_t{128} << 20;   ///< of a raster that is read by window
};

/// The samples of a raster after voids and outside were filled: every one finite, rows from south to
/// north, relative to a base. Held in memory, or read by window through a cache of squares.
class RasterStore {
public:
    /// Makes the first pass: finds nodata, fills it, and completes the reader's DemInfo. A band whose
    /// numbers no float holds is read once before that, for its range.
    ///
    /// Fails: io; bad_data where no sample is valid, or one is beyond kMostHeight
    static Result<std::unique_ptr<RasterStore>> open(std::unique_ptr<RasterReader> reader,
                                                     const StoreSettings& settings);

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

    RasterStore(std::unique_ptr<RasterReader> reader, const StoreSettings& settings);
    Result<void> choose_packing();
    Result<void> first_pass();
    Result<void> rim_pass();
    void fill_memory();
    std::uint32_t filled(int column, int row) const;
    void find_rounding(double of_packing);
    /// Calls use(south, rows, heights) with strips of the file from the south, metres, NaN: no data.
    template <typename Use>
    Result<void> for_each_strip(Use&& use) const;
    /// Rows read at a time in a pass.
    int strip_rows() const;
    Result<std::shared_ptr<const Square>> square(int square_x, int square_y) const;
    Result<std::shared_ptr<const Square>> read_square(int square_x, int square_y) const;

    std::unique_ptr<RasterReader> reader_;
    StoreSettings settings_;
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
