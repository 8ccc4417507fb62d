// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <utility>
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
    /// A packing with these base(), step() and is_integer(). Requires a step other than 0.
    static SamplePacking of_parts(double base, double step, bool is_integer);

    /// The base, metres, to which unpacked heights are relative.
    double base() const { return base_; }
    /// Metres per unit of the numbers.
    double step() const { return step_; }
    /// Whether the numbers are integers, not floats.
    bool is_integer() const { return is_integer_; }

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

/// The samples of a raster, all finite, rows from south to north, as heights relative to a base.
class RasterSamples {
public:
    virtual ~RasterSamples() = default;

    /// How the samples are packed: packing them again loses nothing.
    virtual const SamplePacking& packing() const = 0;
    /// Upper bound of the vertical distance between the surfaces of these samples and of the file's, metres. 0 if
    /// no sample was rounded and doubles resolve the heights to a small fraction of a nanometre.
    virtual double rounding() const = 0;
    /// Reads a window of samples. Beyond the raster the nearest sample is repeated.
    ///
    /// @param heights_out [rows * columns] metres from the base of packing(), from the south-west
    ///
    /// Fails:   io; bad_data
    /// Threads: any
    virtual Result<void> read(std::int64_t column, std::int64_t row, int columns, int rows,
                              std::span<double> heights_out) const = 0;

    double base() const { return packing().base(); }
};

/// Reads `count` samples of one row of a raster, from a column inside it.
using ReadRun =
    std::function<Result<void>(std::int64_t column, std::int64_t row, int count, double* out)>;

/// RasterSamples::read() of a raster whose rows are read by runs.
///
/// @param raster_columns, raster_rows of the raster
Result<void> read_window(int raster_columns, int raster_rows, std::int64_t column, std::int64_t row,
                         int columns, int rows, std::span<double> heights_out, const ReadRun& read);

/// Parts of a raster that are loaded when they are needed. The ones used last are kept.
/// Threads: any number at once.
template <typename Tile>
class TileCache {
public:
    using Load = std::function<Result<std::shared_ptr<const Tile>>(int x, int y)>;

    /// @param most_tiles that the cache keeps
    /// @param load       may be called by several threads at once
    TileCache(std::size_t most_tiles, Load load)
        : most_tiles_(most_tiles), load_(std::move(load)) {}

    /// A tile that the cache holds; null if it does not.
    std::shared_ptr<const Tile> find(int x, int y) const {
        const std::lock_guard lock(mutex_);
        const auto found = tiles_.find(name_of(x, y));
        if (found == tiles_.end()) return nullptr;
        recent_.splice(recent_.begin(), recent_, found->second.place);
        return found->second.tile;
    }

    /// Adds a tile, or returns the one that another thread has added meanwhile.
    std::shared_ptr<const Tile> add(int x, int y, std::shared_ptr<const Tile> tile) const {
        const std::int64_t name = name_of(x, y);
        const std::lock_guard lock(mutex_);
        if (const auto found = tiles_.find(name); found != tiles_.end()) return found->second.tile;
        recent_.push_front(name);
        tiles_.emplace(name, Cached{tile, recent_.begin()});
        while (tiles_.size() > most_tiles_) {
            tiles_.erase(recent_.back());
            recent_.pop_back();
        }
        return tile;
    }

    /// A tile, which is loaded if the cache does not hold it. Fails: as loading it
    Result<std::shared_ptr<const Tile>> get(int x, int y) const {
        if (auto found = find(x, y)) return found;
        TERRANE_TRY(auto loaded, load_(x, y));
        return add(x, y, std::move(loaded));
    }

private:
    struct Cached {
        std::shared_ptr<const Tile> tile;
        std::list<std::int64_t>::iterator place;
    };
    static std::int64_t name_of(int x, int y) { return (static_cast<std::int64_t>(y) << 32) | x; }

    std::size_t most_tiles_;
    Load load_;
    mutable std::mutex mutex_;                ///< guards the cache
    mutable std::list<std::int64_t> recent_;  ///< most recent first
    mutable std::unordered_map<std::int64_t, Cached> tiles_;
};

/// Packed samples of a raster that are loaded by squares: [rows * columns] from the south-west; the last squares of
/// rows and columns may be smaller.
class SquareCache : public TileCache<std::vector<std::uint32_t>> {
public:
    using Square = std::vector<std::uint32_t>;

    /// @param columns of the raster
    /// @param side    samples along the side of a square
    SquareCache(int columns, int side, std::size_t most_squares, Load load)
        : TileCache(most_squares, std::move(load)), columns_(columns), side_(side) {}

    /// As ReadRun.
    Result<void> read_run(const SamplePacking& packing, std::int64_t column, std::int64_t row,
                          int count, double* out) const;

private:
    int columns_, side_;
};

}  // namespace terrane::internal
