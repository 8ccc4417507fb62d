// SPDX-License-Identifier: MIT
#pragma once

#include "source/bounds/cell_deviation.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace terrane {

/// Rows of numbers, de-interleaved into kParts runs with stride kParts, with padding for a group of cells
/// read past their end.
template <unsigned kParts>
class SplitRows {
public:
    SplitRows(int columns, int rows)
        : width_(static_cast<std::size_t>(columns) / kParts + 1 + internal::kCellGroup),
          values_(width_ * kParts * static_cast<std::size_t>(rows)) {}

    /// Columns `column`, `column + kParts`, ... of a row.
    double* from(int column, int row) {
        const auto at = static_cast<unsigned>(column);
        return &values_[(static_cast<std::size_t>(row) * kParts + at % kParts) * width_ +
                        at / kParts];
    }
    double& at(int column, int row) { return *from(column, row); }

    void assign(int row, std::span<const double> values) {
        for (unsigned part = 0; part < kParts; ++part) {
            double* const out = from(static_cast<int>(part), row);
            for (std::size_t i = 0, k = part; k < values.size(); ++i, k += kParts) {
                out[i] = values[k];
            }
        }
    }

    /// To the first row.
    void copy_last_row() {
        const auto row = static_cast<std::ptrdiff_t>(kParts * width_);
        std::copy_n(values_.end() - row, row, values_.begin());
    }

private:
    std::size_t width_;
    std::vector<double> values_;
};

}  // namespace terrane
