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

/// Computes one octave of noise for the columns of a grid, row by row; bit-identical to noise() at every SIMD level.
/// The object is large and contains no pointers to heap memory: it is meant for the stack and allocates nothing.
///
/// Call assign() for the columns, then for each row find_row() and one of the add functions. Find the next row before
/// adding the current one: see NoiseRow.
class NoiseColumns {
public:
    explicit NoiseColumns(const internal::NoiseKernels& kernels) : kernels_(kernels) {}

    /// Length that arrays of sums must have: `count` rounded up to whole groups.
    static constexpr int padded(int count) {
        return (count + internal::kNoiseGroup - 1) / internal::kNoiseGroup * internal::kNoiseGroup;
    }

    /// Sets the columns to `first`, `first + step`, ... units.
    ///
    /// @param count  1 to kMaxNoiseColumns
    void assign(const internal::NoiseAxis& axis, std::uint64_t first, std::uint64_t step,
                int count);

    /// Sets the columns to arbitrary coordinates.
    ///
    /// @param cell_mask    as in noise_place()
    /// @param coordinates  1 to kMaxNoiseColumns
    void assign(std::uint64_t axis_key, std::uint64_t cell_mask,
                std::span<const NoiseCoordinate> coordinates);

    /// Computes the nodes' contributions to a row of samples at y. Cheapest if rows are found from south to north.
    void find_row(std::uint64_t axis_key, std::uint64_t cell_mask, NoiseCoordinate y,
                  internal::NoiseRow& row_out);

    /// Adds amplitude * noise to the sums of a row.
    ///
    /// @param sums [padded(count)] 64-byte aligned
    void add(const internal::NoiseRow& row, double amplitude, double* sums) const {
        kernels_.add(data_, row, amplitude, sums);
    }
    /// Adds an octave of a multifractal and updates the weights for the next octave.
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
    int low_ = 0;  ///< index in data_.nodes of the row of nodes below
    internal::NoiseColumnData data_;
};

/// Positions are integers in units of 2^-24 m, modulo 2^64: an octave's fraction has as many bits at 10^9 m from the
/// origin as at the origin. The ground repeats itself beyond 2^39 m.
inline constexpr int kUnitLog2 = -24;

/// A grid of positions, `step` units apart.
struct UnitGrid {
    std::uint64_t x = 0, y = 0;  ///< south-western position
    std::uint64_t step = 1;
    int columns = 0;
    int rows = 0;
};

/// The height function of FractalSettings, without a lattice.
///
/// fbm:     h = sum a_i n_i
/// warped:  the same at (x + wx, y + wy), where wx and wy are sums of kWarpOctaves octaves
/// ridged:  h = sum a_i v_i, v_i = w_i s(n_i), w_0 = 1, w_(i+1) = 1 - k + k v_i,
///          where k is the heterogeneity,
///          s(n) = 1 - m(sqrt2 n), m(t) = |t| - c / 2 for |t| >= c, t^2 / (2 c) otherwise, with the crest rounding c
/// hybrid:  the same with s(n) = 1/2 + n / sqrt2
class FractalSurface {
public:
    static constexpr int kWarpOctaves = 2;

    /// Requires settings that were checked.
    explicit FractalSurface(const FractalSettings& settings);

    FractalKind kind() const { return kind_; }
    std::span<const internal::NoiseOctave> octaves() const { return octaves_; }
    /// Octaves of the warp to the east and to the north, metres; empty without a warp.
    std::span<const internal::NoiseOctave> warp_x() const { return warp_x_; }
    std::span<const internal::NoiseOctave> warp_y() const { return warp_y_; }
    const internal::MultifractalShape& shape() const { return shape_; }

    /// The height at finite coordinates, metres.
    double height(double x, double y) const;

    /// Heights of a grid, row-major from the south-west: bit-identical to height() at every SIMD level. Allocates
    /// nothing; uses about 250 KiB of stack.
    void sample(const UnitGrid& grid, internal::SimdLevel level,
                std::span<double> heights_out) const;

    /// Adds the octaves `first` to `last` - 1 to the sums of the previous octaves. If all octaves are added, in any
    /// number of pieces, to sums of 0 and with weights of 1 at the start, the heights are bit-identical.
    ///
    /// @param weights  weights of octave `first` on input, of octave `last` on output. May be empty if the kind has
    ///                 none, or if `first` is 0 and the weights are not needed
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

/// Samples the bounds of heights that are computed from a fractal's head: see FractalHead.
class HeadSamples {
public:
    /// @param surface  must outlive this object
    HeadSamples(const FractalSurface& surface, const FractalHead& head, internal::SimdLevel level)
        : surface_(surface), head_(head), level_(level) {}

    /// Whether radii vary; otherwise all are FractalHead::radius.
    bool has_radii() const { return surface_.has_weights(); }

    /// Centres and radii at the points of a grid, row-major: pure functions of position and of step, a power of two.
    ///
    /// @param radii_out  empty if has_radii() is false
    void sample(const UnitGrid& grid, std::span<double> centres_out, std::span<double> radii_out);

private:
    const FractalSurface& surface_;
    FractalHead head_;
    internal::SimdLevel level_;
    std::vector<double> sums_, weights_;  ///< of the samples at twice the step
};

}  // namespace terrane
