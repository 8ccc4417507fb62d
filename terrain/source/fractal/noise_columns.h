// SPDX-License-Identifier: MIT
#pragma once

#include "source/noise/noise.h"
#include "source/noise/noise_kernels.h"

#include <cstdint>
#include <span>

namespace terrane {

/// Columns of a grid on one octave of noise, and a row of samples across them: the same bits as
/// noise() at every level. Large and without pointers: lives on the stack, allocates nothing.
///
/// assign() the columns, then for each row find_row() and one of the sums. Find a row before adding
/// the one before it: see NoiseRow.
class NoiseColumns {
public:
    explicit NoiseColumns(const internal::NoiseKernels& kernels) : kernels_(kernels) {}

    /// Columns that sums must have room for: `count` rounded up to whole groups.
    static constexpr int padded(int count) {
        return (count + internal::kNoiseGroup - 1) / internal::kNoiseGroup * internal::kNoiseGroup;
    }

    /// Columns at `first`, `first + step`, ... units.
    ///
    /// @param count  1 to kMaxNoiseColumns
    void assign(const internal::NoiseAxis& axis, std::uint64_t first, std::uint64_t step,
                int count);

    /// Columns anywhere.
    ///
    /// @param cell_mask    as noise_place() takes it
    /// @param coordinates  1 to kMaxNoiseColumns
    void assign(std::uint64_t axis_key, std::uint64_t cell_mask,
                std::span<const NoiseCoordinate> coordinates);

    /// Nodes as a row of samples at y sees them. Rows in order are cheapest.
    void find_row(std::uint64_t axis_key, std::uint64_t cell_mask, NoiseCoordinate y,
                  internal::NoiseRow& row_out);

    /// Adds amplitude * noise to sums of a row.
    ///
    /// @param sums [padded(count)] 64-byte aligned
    void add(const internal::NoiseRow& row, double amplitude, double* sums) const {
        kernels_.add(data_, row, amplitude, sums);
    }
    /// Adds an octave of a multifractal and goes on to the weights of the next.
    ///
    /// @param weights [padded(count)] 64-byte aligned
    void add_ridged(const internal::NoiseRow& row, double amplitude,
                    const internal::MultifractalShape& shape, double* weights, double* sums) const {
        kernels_.add_ridged(data_, row, amplitude, shape, weights, sums);
    }
    void add_hybrid(const internal::NoiseRow& row, double amplitude,
                    const internal::MultifractalShape& shape, double* weights, double* sums) const {
        kernels_.add_hybrid(data_, row, amplitude, shape, weights, sums);
    }

private:
    const internal::NoiseKernels& kernels_;
    std::uint64_t row_cell_ = 0;
    bool has_row_ = false;
    int low_ = 0;  ///< which of data_.nodes lies below the row
    internal::NoiseColumnData data_;
};

}  // namespace terrane
