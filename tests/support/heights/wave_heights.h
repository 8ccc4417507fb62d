// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

namespace terrane::test {

/// Smooth periodic hills and hollows with bounds by their formula: z = A w(x / L) w(y / L), where w is a wave of
/// parabolas. For tests of users of a source, with hooks to delay it or make it fail.
class WaveHeights final : public HeightSource {
public:
    WaveHeights(const Lattice& lattice, double amplitude, double wavelength);

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;

    mutable std::atomic<int> sample_count{0};
    std::atomic<int> delay_ms{0};        ///< of each sample()
    std::atomic<bool> is_held{false};    ///< sample() does not return while it is set
    std::atomic<bool> is_broken{false};  ///< sample() fails
    std::atomic<bool> gives_nan{false};  ///< sample() gives NaN

private:
    double bound(double longest_edge) const;

    double amplitude_;
    double wavelength_;
};

/// The whole extent of a lattice's root squares.
WorldRect whole_extent(const Lattice& lattice);

/// Two by two roots around the origin, `finest_level` levels below them, at `spacing` metres.
Lattice small_world(int finest_level, double spacing);

}  // namespace terrane::test
