// SPDX-License-Identifier: MIT
#include "source/fractal/noise_columns.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cstddef>

namespace terrane {

void NoiseColumns::assign(const internal::NoiseAxis& axis, std::uint64_t first, std::uint64_t step,
                          int count) {
    TERRANE_ASSERT(count >= 1 && count <= internal::kMaxNoiseColumns, "too many columns");
    data_.column_count = count;
    kernels_.place(data_, axis, first, step);
    kernels_.arrange(data_, axis.key);
    has_row_ = false;
}

void NoiseColumns::assign(std::uint64_t axis_key, std::uint64_t cell_mask,
                          std::span<const NoiseCoordinate> coordinates) {
    TERRANE_ASSERT(!coordinates.empty() && coordinates.size() <= internal::kMaxNoiseColumns,
                   "too many columns");
    data_.column_count = static_cast<int>(coordinates.size());
    data_.cell_mask = cell_mask;
    const auto padded_count = static_cast<std::size_t>(padded(data_.column_count));
    for (std::size_t column = 0; column < padded_count; ++column) {
        const NoiseCoordinate& at = coordinates[std::min(column, coordinates.size() - 1)];
        data_.cells[column] = at.cell;
        data_.fractions[column] = at.fraction;
    }
    kernels_.arrange(data_, axis_key);
    has_row_ = false;
}

void NoiseColumns::find_row(std::uint64_t axis_key, std::uint64_t cell_mask, NoiseCoordinate y,
                            internal::NoiseRow& row_out) {
    if (!has_row_ || y.cell != row_cell_) {
        const auto hash = [&](std::uint64_t cell) { return mix64(axis_key + (cell & cell_mask)); };
        if (has_row_ && y.cell == ((row_cell_ + 1) & cell_mask)) {
            low_ = 1 - low_;  // what lay above lies below
        } else {
            kernels_.find_gradients(data_, hash(y.cell), data_.nodes[low_]);
        }
        kernels_.find_gradients(data_, hash(y.cell + 1), data_.nodes[1 - low_]);
        row_cell_ = y.cell;
        has_row_ = true;
    }
    kernels_.blend(data_, data_.nodes[low_], data_.nodes[1 - low_], y.fraction,
                   quintic_fade(y.fraction), row_out);
}

}  // namespace terrane
