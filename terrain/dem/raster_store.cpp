// SPDX-License-Identifier: MIT
#include "raster_store.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane::internal {

RasterStore::RasterStore(std::unique_ptr<RasterReader> reader, const StoreSettings& settings)
    : reader_(std::move(reader)),
      settings_(settings),
      info_(reader_->info()),
      voids_(info_.columns, info_.rows) {}

Result<std::unique_ptr<RasterStore>> RasterStore::open(std::unique_ptr<RasterReader> reader,
                                                       const StoreSettings& settings) {
    std::unique_ptr<RasterStore> store(new RasterStore(std::move(reader), settings));
    if (auto done = store->first_pass(); !done) return tl::unexpected(done.error());
    if (store->voids_.empty()) {
        store->fill_.reset();
        return store;
    }
    store->fill_->make_field();
    if (auto done = store->rim_pass(); !done) return tl::unexpected(done.error());
    store->fill_->relax();
    if (store->in_memory()) store->fill_memory();
    return store;
}

int RasterStore::strip_rows() const {
    constexpr int kSamplesAtOnce = 1 << 22;
    return std::clamp(kSamplesAtOnce / info_.columns, 16, 256);
}

Result<void> RasterStore::first_pass() {
    const std::size_t width = static_cast<std::size_t>(info_.columns);
    const std::size_t size = width * static_cast<std::size_t>(info_.rows);
    if (size * sizeof(float) <= settings_.memory_bytes) samples_.resize(size);
    fill_.emplace(info_.columns, info_.rows);

    std::vector<float> strip;
    float low = std::numeric_limits<float>::infinity();
    float high = -low;
    for (int south = 0; south < info_.rows; south += strip_rows()) {
        const int rows = std::min(strip_rows(), info_.rows - south);
        const std::size_t count = width * static_cast<std::size_t>(rows);
        strip.resize(count);
        const std::span<float> target =
            in_memory()
                ? std::span(samples_).subspan(width * static_cast<std::size_t>(south), count)
                : std::span(strip);
        if (auto read = reader_->read(0, south, info_.columns, rows, target); !read) return read;
        for (int row = 0; row < rows; ++row) {
            const auto line = target.subspan(width * static_cast<std::size_t>(row), width);
            voids_.add_row(line);
            fill_->add_row(south + row, line);
        }
        for (const float height : target) {
            if (std::isnan(height)) continue;
            low = std::min(low, height);
            high = std::max(high, height);
        }
    }
    voids_.finish();
    if (low > high) {
        return fail(ErrorCode::bad_data, "raster \"" + reader_->path() +
                                             "\" has no valid sample, " + "all " +
                                             std::to_string(size) + " are nodata");
    }
    info_.min_m = static_cast<double>(low);
    info_.max_m = static_cast<double>(high);
    info_.nodata_share = static_cast<double>(voids_.nodata_count()) / static_cast<double>(size);
    info_.filled_share = static_cast<double>(voids_.void_count()) / static_cast<double>(size);
    return {};
}

Result<void> RasterStore::rim_pass() {
    const std::size_t width = static_cast<std::size_t>(info_.columns);
    std::vector<float> strip;
    for (int south = 0; south < info_.rows; south += kBlockSide) {
        if (!fill_->needs_row(south)) continue;
        const int rows = std::min(kBlockSide, info_.rows - south);
        const std::size_t count = width * static_cast<std::size_t>(rows);
        std::span<const float> source;
        if (in_memory()) {
            source = std::span(samples_).subspan(width * static_cast<std::size_t>(south), count);
        } else {
            strip.resize(count);
            if (auto read = reader_->read(0, south, info_.columns, rows, strip); !read) return read;
            source = strip;
        }
        for (int row = 0; row < rows; ++row) {
            fill_->add_rim_row(south + row,
                               source.subspan(width * static_cast<std::size_t>(row), width));
        }
    }
    return {};
}

void RasterStore::fill_memory() {
    std::size_t at = 0;
    for (int row = 0; row < info_.rows; ++row) {
        for (int column = 0; column < info_.columns; ++column, ++at) {
            if (std::isnan(samples_[at])) samples_[at] = fill_->height(column, row);
        }
    }
    fill_.reset();
}

Result<std::shared_ptr<const RasterStore::Square>> RasterStore::read_square(int square_x,
                                                                            int square_y) const {
    const int west = square_x * kSquareSide, south = square_y * kSquareSide;
    const int columns = std::min(kSquareSide, info_.columns - west);
    const int rows = std::min(kSquareSide, info_.rows - south);
    auto square = std::make_shared<Square>(static_cast<std::size_t>(columns) *
                                           static_cast<std::size_t>(rows));
    if (auto read = reader_->read(west, south, columns, rows, *square); !read) {
        return tl::unexpected(read.error());
    }
    if (!fill_) return square;
    std::size_t at = 0;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column, ++at) {
            float& height = (*square)[at];
            if (std::isnan(height)) height = fill_->height(west + column, south + row);
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
    auto loaded = read_square(square_x, square_y);
    if (!loaded) return loaded;
    const std::lock_guard lock(mutex_);
    // Two threads may have read it: the first to arrive is kept.
    if (const auto found = squares_.find(name); found != squares_.end()) {
        return found->second.square;
    }
    recent_.push_front(name);
    squares_.emplace(name, Cached{*loaded, recent_.begin()});
    constexpr std::size_t kSquareBytes = sizeof(float) * kSquareSide * kSquareSide;
    while (squares_.size() > std::max<std::size_t>(settings_.cache_bytes / kSquareBytes, 4)) {
        squares_.erase(recent_.back());
        recent_.pop_back();
    }
    return loaded;
}

Result<void> RasterStore::read(std::int64_t column, std::int64_t row, int columns, int rows,
                               std::span<float> samples_out) const {
    const std::int64_t last_column = info_.columns - 1, last_row = info_.rows - 1;
    const std::size_t width = static_cast<std::size_t>(columns);
    // Columns of the window that lie inside the raster; before and after them the edge is repeated.
    const int inside_begin = static_cast<int>(std::clamp<std::int64_t>(-column, 0, columns));
    const int inside_end =
        static_cast<int>(std::clamp<std::int64_t>(last_column + 1 - column, inside_begin, columns));
    for (int r = 0; r < rows; ++r) {
        const std::int64_t source_row = std::clamp<std::int64_t>(row + r, 0, last_row);
        float* line = samples_out.data() + static_cast<std::size_t>(r) * width;
        if (r > 0 && source_row == std::clamp<std::int64_t>(row + r - 1, 0, last_row)) {
            std::copy_n(line - width, width, line);
            continue;
        }
        const auto copy = [&](int begin, int end) -> Result<void> {
            const std::int64_t from = std::clamp<std::int64_t>(column + begin, 0, last_column);
            if (in_memory()) {
                const float* source = samples_.data() + source_row * (last_column + 1) + from;
                std::copy_n(source, end - begin, line + begin);
                return {};
            }
            for (int done = begin; done < end;) {
                const int at = static_cast<int>(from) + done - begin;
                const int square_x = at / kSquareSide;
                const int square_y = static_cast<int>(source_row) / kSquareSide;
                const auto held = square(square_x, square_y);
                if (!held) return tl::unexpected(held.error());
                const int square_columns =
                    std::min(kSquareSide, info_.columns - square_x * kSquareSide);
                const int in_square = at - square_x * kSquareSide;
                const int count = std::min(end - done, square_columns - in_square);
                const int square_row = static_cast<int>(source_row) - square_y * kSquareSide;
                std::copy_n((*held)->data() + square_row * square_columns + in_square, count,
                            line + done);
                done += count;
            }
            return {};
        };
        if (inside_begin < inside_end) {
            if (auto done = copy(inside_begin, inside_end); !done) return done;
            std::fill(line, line + inside_begin, line[inside_begin]);
            std::fill(line + inside_end, line + columns, line[inside_end - 1]);
        } else {
            // Entirely west or east of the raster.
            if (auto done = copy(0, 1); !done) return done;
            std::fill(line + 1, line + columns, line[0]);
        }
    }
    return {};
}

}  // namespace terrane::internal
