// SPDX-License-Identifier: MIT
#include "bilinear/raster_samples.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

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

SamplePacking SamplePacking::of_parts(double base, double step, bool is_integer) {
    SamplePacking packing;
    packing.base_ = base;
    packing.step_ = step;
    packing.is_integer_ = is_integer;
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

Result<void> read_window(int raster_columns, int raster_rows, std::int64_t column, std::int64_t row,
                         int columns, int rows, std::span<double> heights_out,
                         const ReadRun& read) {
    const std::int64_t last_column = raster_columns - 1, last_row = raster_rows - 1;
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
        } else if (inside_begin < inside_end) {
            TERRANE_TRY(read(column + inside_begin, source_row, inside_end - inside_begin,
                             line + inside_begin));
            std::fill(line, line + inside_begin, line[inside_begin]);
            std::fill(line + inside_end, line + columns, line[inside_end - 1]);
        } else {
            // Entirely west or east of the raster.
            TERRANE_TRY(
                read(std::clamp<std::int64_t>(column, 0, last_column), source_row, 1, line));
            std::fill(line + 1, line + columns, line[0]);
        }
    }
    return {};
}

Result<void> SquareCache::read_run(const SamplePacking& packing, std::int64_t column,
                                   std::int64_t row, int count, double* out) const {
    const auto square_y = static_cast<int>(row / side_);
    const auto square_row = static_cast<std::ptrdiff_t>(row % side_);
    for (int done = 0; done < count;) {
        const auto at = static_cast<int>(column) + done;
        const int square_x = at / side_, in_square = at % side_;
        TERRANE_TRY(const auto samples, get(square_x, square_y));
        const int square_columns = std::min(side_, columns_ - square_x * side_);
        const int run = std::min(count - done, square_columns - in_square);
        const std::uint32_t* source = samples->data() + square_row * square_columns + in_square;
        packing.unpack({source, static_cast<std::size_t>(run)}, out + done);
        done += run;
    }
    return {};
}

}  // namespace terrane::internal
