// SPDX-License-Identifier: MIT
#pragma once

#include "base/simd_level.h"
#include "source/fractal/fractal_bounds.h"
#include "source/fractal/noise.h"
#include "source/fractal/noise_kernels.h"

#include <terrane/terrain/fractal_heights.h>

#include <cstdint>
#include <span>
#include <vector>

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

/// Positions are integers in units of 2^-24 m, modulo 2^64: at 10^9 m from the origin an octave's
/// fraction has as many bits as beside it. Beyond 2^39 m the ground repeats itself.
inline constexpr int kUnitLog2 = -24;

/// A grid of positions, `step` units apart.
struct UnitGrid {
    std::uint64_t x = 0, y = 0;  ///< of the south-western one
    std::uint64_t step = 1;
    int columns = 0;
    int rows = 0;
};

/// The height function of FractalSettings, without a lattice.
///
/// fbm:     h = sum a_i n_i
/// warped:  the same at (x + wx, y + wy), both of them sums of kWarpOctaves octaves
/// ridged:  h = sum a_i v_i, v_i = w_i s(n_i), w_0 = 1, w_(i+1) = 1 - k + k v_i,
///          k the heterogeneity,
///          s(n) = 1 - m(sqrt2 n), m(t) = |t| - c / 2 beyond the crest c, t^2 / (2 c) within
/// hybrid:  the same with s(n) = 1/2 + n / sqrt2
class FractalSurface {
public:
    static constexpr int kWarpOctaves = 2;

    /// Requires: checked settings.
    explicit FractalSurface(const FractalSettings& settings);

    FractalKind kind() const { return kind_; }
    std::span<const internal::NoiseOctave> octaves() const { return octaves_; }
    /// Octaves of the warp east and north, metres; empty without a warp.
    std::span<const internal::NoiseOctave> warp_x() const { return warp_x_; }
    std::span<const internal::NoiseOctave> warp_y() const { return warp_y_; }
    const internal::MultifractalShape& shape() const { return shape_; }

    /// At finite coordinates, metres.
    double height(double x, double y) const;

    /// Heights of a grid, row-major from the south-west: the bits of height() at every level.
    /// Allocates nothing, takes about 250 KiB of stack.
    void sample(const UnitGrid& grid, internal::SimdLevel level,
                std::span<double> heights_out) const;

    /// Adds the octaves from `first` up to `last` to the sums of those before them: from zeros and
    /// weights of one, that of all octaves in any number of pieces gives the heights' bits.
    ///
    /// @param weights  of octave `first`, then of octave `last`. May be empty if the kind has
    /// none, and if `first` is 0 and weights are not needed
    void add_octaves(const UnitGrid& grid, int first, int last, internal::SimdLevel level,
                     std::span<double> sums, std::span<double> weights) const;

    bool has_weights() const {
        return kind_ == FractalKind::ridged || kind_ == FractalKind::hybrid;
    }

private:
    FractalKind kind_;
    std::vector<internal::NoiseOctave> octaves_, warp_x_, warp_y_;
    internal::MultifractalShape shape_;
};

/// Samples the bounds of heights by a fractal's head: see FractalHead.
class HeadSamples {
public:
    /// @param surface  must outlive this
    HeadSamples(const FractalSurface& surface, const FractalHead& head, internal::SimdLevel level)
        : surface_(surface), head_(head), level_(level) {}

    /// Whether radii vary; else all are FractalHead::radius.
    bool has_radii() const { return surface_.has_weights(); }

    /// Centres and radii, row-major: pure functions of position and step, a power of two.
    ///
    /// @param radii_out  empty where has_radii() is false
    void sample(const UnitGrid& grid, std::span<double> centres_out, std::span<double> radii_out);

private:
    const FractalSurface& surface_;
    FractalHead head_;
    internal::SimdLevel level_;
    std::vector<double> sums_, weights_;  ///< at twice the step
};

}  // namespace terrane
