// SPDX-License-Identifier: MIT
#include "raster/raster_store.h"

#include "raster/raster_checks.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace terrane::internal {

int strip_rows(int columns) {
    constexpr int kSamplesAtOnce = 1 << 22;
    return std::clamp(kSamplesAtOnce / columns / kBlockSide * kBlockSide, kBlockSide,
                      32 * kBlockSide);
}

namespace {

/// Squares of flags that a reopened raster keeps in memory.
constexpr std::size_t kFlagSquares = 64;

}  // namespace

RasterStore::RasterStore(std::shared_ptr<const HeightReader> reader, const StoreSettings& settings,
                         double needed_bytes, std::shared_ptr<ScratchMemory> scratch)
    : reader_(std::move(reader)),
      settings_(settings),
      needed_bytes_(needed_bytes),
      calls_(std::make_unique<GuardedCalls>(settings.patience_s)),
      info_(reader_->info()),
      scratch_(std::move(scratch)),
      voids_(info_.columns, info_.rows, !reader_->rows_go_north(), memory()),
      packing_(SamplePacking::of_floats(reader_->scale(), reader_->offset())),
      squares_(info_.columns, kSquareSide,
               std::max<std::size_t>(
                   settings_.cache_bytes / (sizeof(std::uint32_t) * kSquareSide * kSquareSide), 4),
               [this](int x, int y) { return read_square(x, y); }),
      flag_squares_(info_.columns, kSquareSide, kFlagSquares,
                    [this](int x, int y) { return read_flags(x, y); }) {}

Result<std::unique_ptr<RasterStore>> RasterStore::open(std::shared_ptr<const HeightReader> reader,
                                                       const StoreSettings& settings,
                                                       double needed_bytes,
                                                       std::shared_ptr<ScratchMemory> scratch,
                                                       OpeningProgress& progress) {
    std::unique_ptr<RasterStore> store(
        new RasterStore(std::move(reader), settings, needed_bytes, std::move(scratch)));
    TERRANE_TRY(store->choose_packing(progress));
    TERRANE_TRY(store->first_pass(progress));
    if (store->voids_.empty()) {
        store->fill_.reset();
        return store;
    }
    store->fill_->make_field();
    const std::size_t nodata_bytes = store->voids_.run_bytes() + store->fill_->rim_bytes();
    TERRANE_TRY(store->check_nodata_bytes(nodata_bytes));
    store->fill_->begin_rim();
    TERRANE_TRY(store->rim_pass());
    store->fill_->relax();
    if (store->in_memory()) store->fill_memory();
    return store;
}

std::unique_ptr<RasterStore> RasterStore::reopen(std::shared_ptr<const HeightReader> reader,
                                                 const StoreSettings& settings,
                                                 std::shared_ptr<const ScannedSamples> scan) {
    std::unique_ptr<RasterStore> store(new RasterStore(std::move(reader), settings, 0.0, nullptr));
    const ScannedSamples::Summary& summary = scan->summary();
    store->info_.min_m = summary.min_m;
    store->info_.max_m = summary.max_m;
    store->info_.nodata_share = summary.nodata_share;
    store->info_.filled_share = summary.filled_share;
    store->packing_ = SamplePacking::of_parts(summary.base, summary.step, summary.is_integer);
    store->rounding_ = summary.rounding;
    store->scan_ = std::move(scan);
    return store;
}

Result<void> RasterStore::check_all(OpeningProgress& progress) const {
    progress.begin(0.9, (info_.rows + kSquareSide - 1) / kSquareSide);
    for (int y = 0; y * kSquareSide < info_.rows; ++y) {
        for (int x = 0; x * kSquareSide < info_.columns; ++x) {
            TERRANE_TRY(read_square(x, y));
        }
        TERRANE_TRY(progress.step());
    }
    return {};
}

Result<void> RasterStore::write(SealedWriter& file, ByteWriter& directory) const {
    const auto get_square = [this](int x, int y) -> Result<ScannedSquare> {
        const int west = x * kSquareSide, south = y * kSquareSide;
        const int columns = std::min(kSquareSide, info_.columns - west);
        const int rows = std::min(kSquareSide, info_.rows - south);
        const std::size_t size = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
        std::vector<double> heights(size);
        TERRANE_TRY(read(west, south, columns, rows, heights));
        ScannedSquare square;
        for (const double height : heights) square.packed.push_back(packing_.pack_relative(height));
        if (voids_.flags(west, south, west + columns - 1, south + rows - 1) == 0) return square;
        for (int row = 0; row < rows; ++row) {
            for (int column = 0; column < columns; ++column) {
                square.flags.push_back(voids_.flags(west + column, south + row));
            }
        }
        return square;
    };
    return ScannedSamples::write(
        info_.columns, info_.rows,
        {info_.min_m, info_.max_m, info_.nodata_share, info_.filled_share, packing_.base(),
         packing_.step(), packing_.is_integer(), rounding_},
        get_square, file, directory);
}

Result<std::uint8_t> RasterStore::flags(int west, int south, int east, int north) const {
    if (!scan_) return voids_.flags(west, south, east, north);
    std::uint8_t flags = 0;
    for (int y = south / kSquareSide; y <= north / kSquareSide; ++y) {
        for (int x = west / kSquareSide; x <= east / kSquareSide; ++x) {
            TERRANE_TRY(const bool has_nodata, scan_->has_nodata(x, y));
            if (!has_nodata) continue;
            TERRANE_TRY(const auto square, flag_squares_.get(x, y));
            const int columns = std::min(kSquareSide, info_.columns - x * kSquareSide);
            const int first = std::max(west - x * kSquareSide, 0);
            const int last = std::min(east - x * kSquareSide, columns - 1);
            const int end = std::min(north - y * kSquareSide, kSquareSide - 1);
            for (int row = std::max(south - y * kSquareSide, 0); row <= end; ++row) {
                const std::uint32_t* line = square->data() + std::ptrdiff_t{row} * columns;
                for (int column = first; column <= last; ++column) {
                    flags = static_cast<std::uint8_t>(flags | line[column]);
                }
            }
        }
    }
    return flags;
}

Result<void> RasterStore::check_nodata_bytes(std::size_t bytes) const {
    const double needed = needed_bytes_ + static_cast<double>(bytes);
    return check_memory(reader_->path(), info_.columns, info_.rows, needed, settings_.limit_bytes);
}

Result<void> RasterStore::read_file(int column, int row, int columns, int rows,
                                    std::span<double> heights_out) const {
    // A read that timed out continues, so it owns its buffer.
    struct Job {
        std::shared_ptr<const HeightReader> reader;
        std::vector<double> heights;
        Result<void> done;
    };
    const auto job = std::make_shared<Job>();
    job->reader = reader_;
    job->heights.resize(heights_out.size());
    const bool answered = calls_->run([job, column, row, columns, rows] {
        job->done = job->reader->read(column, row, columns, rows, job->heights);
    });
    if (!answered) return stopped_answering(reader_->path(), calls_->patience_s());
    if (job->done) std::ranges::copy(job->heights, heights_out.begin());
    return job->done;
}

int RasterStore::strip_count() const {
    const int rows = strip_rows(info_.columns);
    return (info_.rows + rows - 1) / rows;
}

template <typename Use>
Result<void> RasterStore::for_each_strip(OpeningProgress& progress, Use&& use) const {
    const int strip = strip_rows(info_.columns), count = strip_count();
    std::vector<double> heights;
    for (int i = 0; i < count; ++i) {
        const int south = (reader_->rows_go_north() ? i : count - 1 - i) * strip;
        const int rows = std::min(strip, info_.rows - south);
        heights.resize(static_cast<std::size_t>(info_.columns) * static_cast<std::size_t>(rows));
        TERRANE_TRY(read_file(0, south, info_.columns, rows, heights));
        use(south, rows, std::span(heights));
        TERRANE_TRY(check_nodata_bytes(voids_.run_bytes()));
        TERRANE_TRY(progress.step());
    }
    return {};
}

Result<void> RasterStore::choose_packing(OpeningProgress& progress) {
    if (reader_->has_float_numbers()) return {};
    if (const std::optional<HeightInterval> range = reader_->range()) {
        packing_ = SamplePacking::of_range(range->low, range->high);
        return {};
    }
    double low = std::numeric_limits<double>::infinity(), high = -low;
    progress.begin(0.5 * settings_.progress_share, strip_count());
    const auto done = for_each_strip(progress, [&](int, int, std::span<const double> strip) {
        for (const double height : strip) {
            if (std::isnan(height)) continue;
            low = std::min(low, height);
            high = std::max(high, height);
        }
    });
    if (done && low <= high) packing_ = SamplePacking::of_range(low, high);
    return done;
}

Result<void> RasterStore::first_pass(OpeningProgress& progress) {
    const std::size_t width = static_cast<std::size_t>(info_.columns);
    const std::size_t size = width * static_cast<std::size_t>(info_.rows);
    if (size * sizeof(std::uint32_t) <= settings_.memory_bytes) samples_.resize(size);
    fill_.emplace(info_.columns, info_.rows, memory());

    double low = std::numeric_limits<double>::infinity(), high = -low;
    double most_off = 0.0;
    ExtremeHeights extremes;
    std::vector<std::uint32_t> packed;
    progress.begin(settings_.progress_share, strip_count());
    TERRANE_TRY(for_each_strip(progress, [&](int south, int rows, std::span<double> strip) {
        packed.resize(strip.size());
        const std::size_t first = width * static_cast<std::size_t>(south);
        for (std::size_t i = 0; i < strip.size(); ++i) {
            const double height = strip[i];
            packed[i] = packing_.pack(height);
            strip[i] = packing_.unpack(packed[i]);
            if (std::isnan(height)) continue;
            low = std::min(low, height);
            high = std::max(high, height);
            extremes.add(height, first + i);
            most_off = std::max(most_off, std::fabs(strip[i] - (height - packing_.base())));
        }
        const auto line = [&](int row) {
            return strip.subspan(width * static_cast<std::size_t>(row), width);
        };
        for (int row = 0; row < rows; ++row) {
            voids_.add_row(line(reader_->rows_go_north() ? row : rows - 1 - row));
            fill_->add_row(south + row, line(row));
        }
        if (!in_memory()) return;
        std::copy(packed.begin(), packed.end(),
                  samples_.begin() + static_cast<std::ptrdiff_t>(first));
    }));
    voids_.finish();
    if (low > high) {
        return fail(ErrorCode::bad_data, named_raster(reader_->path()) +
                                             " has no valid sample, all " + std::to_string(size) +
                                             " are nodata");
    }
    TERRANE_TRY(reader_->check_extremes(extremes));
    info_.min_m = low;
    info_.max_m = high;
    info_.nodata_share = static_cast<double>(voids_.nodata_count()) / static_cast<double>(size);
    info_.filled_share = static_cast<double>(voids_.void_count()) / static_cast<double>(size);
    find_rounding(most_off);
    return {};
}

/// @param of_packing  largest packing error of a sample, metres
void RasterStore::find_rounding(double of_packing) {
    // Bounds are rounded outward by a nanometre, which covers the rounding of sums of doubles for heights below 131 km
    // and a packing error of at most a quarter nanometre.
    constexpr double kSmall = 0x1p17, kPerMetre = 0x1p-48, kNone = 0x1p-32;
    const double largest =
        std::max(std::fabs(info_.min_m), std::fabs(info_.max_m)) + std::fabs(reader_->offset());
    rounding_ =
        (of_packing > kNone ? of_packing : 0.0) + (largest > kSmall ? kPerMetre * largest : 0.0);
}

Result<void> RasterStore::rim_pass() {
    const std::size_t width = static_cast<std::size_t>(info_.columns);
    std::vector<double> strip;
    for (int south = 0; south < info_.rows; south += kBlockSide) {
        if (!fill_->needs_row(south)) continue;
        const int rows = std::min(kBlockSide, info_.rows - south);
        const std::size_t count = width * static_cast<std::size_t>(rows);
        strip.resize(count);
        if (in_memory()) {
            const std::size_t first = width * static_cast<std::size_t>(south);
            packing_.unpack(std::span(samples_).subspan(first, count), strip.data());
        } else {
            TERRANE_TRY(read_file(0, south, info_.columns, rows, strip));
            for (double& height : strip) height = packing_.unpack(packing_.pack(height));
        }
        for (int row = 0; row < rows; ++row) {
            fill_->add_rim_row(south + row, std::span(strip).subspan(
                                                width * static_cast<std::size_t>(row), width));
        }
    }
    return {};
}

std::uint32_t RasterStore::filled(int column, int row) const {
    return packing_.pack_relative(static_cast<double>(fill_->height(column, row)));
}

void RasterStore::fill_memory() {
    std::size_t at = 0;
    for (int row = 0; row < info_.rows; ++row) {
        for (int column = 0; column < info_.columns; ++column, ++at) {
            if (std::isnan(packing_.unpack(samples_[at]))) samples_[at] = filled(column, row);
        }
    }
    fill_.reset();
}

Result<std::shared_ptr<const SquareCache::Square>> RasterStore::read_square(int square_x,
                                                                            int square_y) const {
    const int west = square_x * kSquareSide, south = square_y * kSquareSide;
    const int columns = std::min(kSquareSide, info_.columns - west);
    const int rows = std::min(kSquareSide, info_.rows - south);
    std::vector<double> heights(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    TERRANE_TRY(read_file(west, south, columns, rows, heights));
    auto square = std::make_shared<SquareCache::Square>(heights.size());
    std::size_t at = 0;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column, ++at) {
            std::uint32_t& packed = (*square)[at];
            if (!std::isnan(heights[at])) {
                packed = packing_.pack(heights[at]);
            } else {
                // a raster without nodata that has some now
                const std::uint32_t unknown = scan_ ? scan_->no_data() : packing_.pack(heights[at]);
                packed = fill_ ? filled(west + column, south + row) : unknown;
            }
        }
    }
    if (!scan_) return square;
    TERRANE_TRY(const bool is_same, scan_->is_same(square_x, square_y, *square));
    if (!is_same) {
        return fail(ErrorCode::bad_data,
                    named_raster(reader_->path()) +
                        " does not have the heights that were scanned: columns " +
                        std::to_string(west) + " to " + std::to_string(west + columns - 1) +
                        ", rows " + std::to_string(south) + " to " +
                        std::to_string(south + rows - 1) + " from the south-west");
    }
    TERRANE_TRY(const bool has_nodata, scan_->has_nodata(square_x, square_y));
    if (!has_nodata) return square;
    TERRANE_TRY(auto scanned, scan_->square(square_x, square_y));
    return std::make_shared<const SquareCache::Square>(std::move(scanned.packed));
}

Result<std::shared_ptr<const SquareCache::Square>> RasterStore::read_flags(int square_x,
                                                                           int square_y) const {
    TERRANE_TRY(const auto scanned, scan_->square(square_x, square_y));
    return std::make_shared<const SquareCache::Square>(scanned.flags.begin(), scanned.flags.end());
}

Result<void> RasterStore::read(std::int64_t column, std::int64_t row, int columns, int rows,
                               std::span<double> heights_out) const {
    const auto run = [this](std::int64_t from, std::int64_t of_row, int count,
                            double* out) -> Result<void> {
        if (!in_memory()) return squares_.read_run(packing_, from, of_row, count, out);
        const std::uint32_t* source = samples_.data() + of_row * info_.columns + from;
        packing_.unpack({source, static_cast<std::size_t>(count)}, out);
        return {};
    };
    return read_window(info_.columns, info_.rows, column, row, columns, rows, heights_out, run);
}

}  // namespace terrane::internal
