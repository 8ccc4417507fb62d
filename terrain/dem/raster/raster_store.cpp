// SPDX-License-Identifier: MIT
#include "raster/raster_store.h"

#include "raster/raster_checks.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace terrane::internal {
namespace {

constexpr std::int32_t kNoData = std::numeric_limits<std::int32_t>::min();
constexpr double kMostNumber = 0x1p31 - 1.0;
/// Log2 of the finest step, metres: far below every quantum.
constexpr int kFinestStepLog2 = -50;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double unpack_integer(std::uint32_t packed, double step) {
    const auto number = static_cast<std::int32_t>(packed);
    return number == kNoData ? kNaN : step * static_cast<double>(number);
}

double unpack_float(std::uint32_t packed, double step) {
    return step * static_cast<double>(std::bit_cast<float>(packed));
}

}  // namespace

SamplePacking SamplePacking::of_floats(double scale, double offset) {
    SamplePacking packing;
    if (std::isfinite(scale) && scale != 0.0) packing.step_ = scale;
    if (std::isfinite(offset)) packing.base_ = offset;
    return packing;
}

SamplePacking SamplePacking::of_range(double low, double high) {
    SamplePacking packing;
    packing.is_integer_ = true;
    const double range = high - low;
    // Near 0 a base has no benefit, and integers stay exact.
    const bool is_far = std::max(std::fabs(low), std::fabs(high)) > 2.0 * range;
    if (is_far) packing.base_ = low + 0.5 * range;
    const double reach = std::max(high - packing.base_, packing.base_ - low);
    packing.step_ = std::ldexp(1.0, kFinestStepLog2);
    while (reach > (kMostNumber - 1.0) * packing.step_) packing.step_ *= 2.0;
    // The base is a multiple of the step, and so an integer if the step is an integer.
    if (is_far) packing.base_ = std::floor(packing.base_ / packing.step_) * packing.step_;
    return packing;
}

std::uint32_t SamplePacking::pack_relative(double height) const {
    const double number = height / step_;
    if (!is_integer_) return std::bit_cast<std::uint32_t>(static_cast<float>(number));
    if (std::isnan(number)) return static_cast<std::uint32_t>(kNoData);
    const double nearest = std::clamp(std::floor(number + 0.5), -kMostNumber, kMostNumber);
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(nearest));
}

double SamplePacking::unpack(std::uint32_t packed) const {
    return is_integer_ ? unpack_integer(packed, step_) : unpack_float(packed, step_);
}

void SamplePacking::unpack(std::span<const std::uint32_t> packed, double* heights_out) const {
    const double step = step_;
    if (is_integer_) {
        for (std::size_t i = 0; i < packed.size(); ++i) {
            heights_out[i] = unpack_integer(packed[i], step);
        }
    } else {
        for (std::size_t i = 0; i < packed.size(); ++i) {
            heights_out[i] = unpack_float(packed[i], step);
        }
    }
}

int strip_rows(int columns) {
    constexpr int kSamplesAtOnce = 1 << 22;
    return std::clamp(kSamplesAtOnce / columns / kBlockSide * kBlockSide, kBlockSide,
                      32 * kBlockSide);
}

RasterStore::RasterStore(std::shared_ptr<const HeightReader> reader, const StoreSettings& settings,
                         double needed_bytes)
    : reader_(std::move(reader)),
      settings_(settings),
      needed_bytes_(needed_bytes),
      calls_(std::make_unique<GuardedCalls>(settings.patience_s)),
      info_(reader_->info()),
      voids_(info_.columns, info_.rows, !reader_->rows_go_north()),
      packing_(SamplePacking::of_floats(reader_->scale(), reader_->offset())) {}

Result<std::unique_ptr<RasterStore>> RasterStore::open(std::shared_ptr<const HeightReader> reader,
                                                       const StoreSettings& settings,
                                                       double needed_bytes,
                                                       OpeningProgress& progress) {
    std::unique_ptr<RasterStore> store(new RasterStore(std::move(reader), settings, needed_bytes));
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
    fill_.emplace(info_.columns, info_.rows);

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

Result<std::shared_ptr<const RasterStore::Square>> RasterStore::read_square(int square_x,
                                                                            int square_y) const {
    const int west = square_x * kSquareSide, south = square_y * kSquareSide;
    const int columns = std::min(kSquareSide, info_.columns - west);
    const int rows = std::min(kSquareSide, info_.rows - south);
    std::vector<double> heights(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    TERRANE_TRY(read_file(west, south, columns, rows, heights));
    auto square = std::make_shared<Square>(heights.size());
    std::size_t at = 0;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column, ++at) {
            (*square)[at] = fill_ && std::isnan(heights[at]) ? filled(west + column, south + row)
                                                             : packing_.pack(heights[at]);
        }
    }
    return square;
}

Result<std::shared_ptr<const RasterStore::Square>> RasterStore::square(int square_x,
                                                                       int square_y) const {
    const std::int64_t name = (static_cast<std::int64_t>(square_y) << 32) | square_x;
    {
        const std::lock_guard lock(mutex_);
        if (const auto found = squares_.find(name); found != squares_.end()) {
            recent_.splice(recent_.begin(), recent_, found->second.place);
            return found->second.square;
        }
    }
    TERRANE_TRY(auto loaded, read_square(square_x, square_y));
    const std::lock_guard lock(mutex_);
    // If another thread has read the square meanwhile, its result is kept.
    if (const auto found = squares_.find(name); found != squares_.end()) {
        return found->second.square;
    }
    recent_.push_front(name);
    squares_.emplace(name, Cached{loaded, recent_.begin()});
    constexpr std::size_t kSquareBytes = sizeof(std::uint32_t) * kSquareSide * kSquareSide;
    while (squares_.size() > std::max<std::size_t>(settings_.cache_bytes / kSquareBytes, 4)) {
        squares_.erase(recent_.back());
        recent_.pop_back();
    }
    return loaded;
}

Result<void> RasterStore::read(std::int64_t column, std::int64_t row, int columns, int rows,
                               std::span<double> heights_out) const {
    const std::int64_t last_column = info_.columns - 1, last_row = info_.rows - 1;
    const std::size_t width = static_cast<std::size_t>(columns);
    // Columns of the window inside the raster; elsewhere the edge is repeated.
    const int inside_begin = static_cast<int>(std::clamp<std::int64_t>(-column, 0, columns));
    const int inside_end =
        static_cast<int>(std::clamp<std::int64_t>(last_column + 1 - column, inside_begin, columns));
    for (int r = 0; r < rows; ++r) {
        const std::int64_t source_row = std::clamp<std::int64_t>(row + r, 0, last_row);
        double* line = heights_out.data() + static_cast<std::size_t>(r) * width;
        if (r > 0 && source_row == std::clamp<std::int64_t>(row + r - 1, 0, last_row)) {
            std::copy_n(line - width, width, line);
            continue;
        }
        const auto copy = [&](int begin, int end) -> Result<void> {
            const std::int64_t from = std::clamp<std::int64_t>(column + begin, 0, last_column);
            if (in_memory()) {
                const std::uint32_t* source =
                    samples_.data() + source_row * (last_column + 1) + from;
                packing_.unpack({source, static_cast<std::size_t>(end - begin)}, line + begin);
                return {};
            }
            for (int done = begin; done < end;) {
                const int at = static_cast<int>(from) + done - begin;
                const int square_x = at / kSquareSide;
                const int square_y = static_cast<int>(source_row) / kSquareSide;
                TERRANE_TRY(const auto samples_of_square, square(square_x, square_y));
                const int square_columns =
                    std::min(kSquareSide, info_.columns - square_x * kSquareSide);
                const int in_square = at - square_x * kSquareSide;
                const int count = std::min(end - done, square_columns - in_square);
                const int square_row = static_cast<int>(source_row) - square_y * kSquareSide;
                const std::uint32_t* source =
                    samples_of_square->data() + square_row * square_columns + in_square;
                packing_.unpack({source, static_cast<std::size_t>(count)}, line + done);
                done += count;
            }
            return {};
        };
        if (inside_begin < inside_end) {
            TERRANE_TRY(copy(inside_begin, inside_end));
            std::fill(line, line + inside_begin, line[inside_begin]);
            std::fill(line + inside_end, line + columns, line[inside_end - 1]);
        } else {
            // Entirely west or east of the raster.
            TERRANE_TRY(copy(0, 1));
            std::fill(line + 1, line + columns, line[0]);
        }
    }
    return {};
}

}  // namespace terrane::internal
