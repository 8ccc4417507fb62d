// SPDX-License-Identifier: MIT
#pragma once

#include "source/noise/noise_kernels.h"

#include <terrane/terrain/fractal_heights.h>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane {

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

}  // namespace terrane
