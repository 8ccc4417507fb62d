// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>

#include <atomic>
#include <chrono>
#include <functional>
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

/// Position and lattice of a test ground.
struct TableGroundSettings {
    double spacing = 1.0;         ///< between samples, metres
    int roots = 1;                ///< root squares along a side; their 128 cells are the chunks
    double origin_x = 0.0;        ///< world x of lattice point (0, 0), metres
    double origin_y = 0.0;        ///< world y of lattice point (0, 0), metres
    std::int32_t first_root = 0;  ///< x and y of the south-western root square's key
    double quantum = 0x1p-12;     ///< metres
    float bound = 0.0f;           ///< every bound of the source
    std::function<bool(double, double)> is_outside{};  ///< of a cell's centre; none: all is ground
    std::function<bool(int, int)> is_resident{};  ///< of a root by column and row; none: all are
    std::shared_ptr<const SurfaceMap> surface{};  ///< null: none
    std::function<std::shared_ptr<const SolidSurface>(const Chunk&)>
        solid{};  ///< of a chunk; none: the heightfield alone
};

/// Ground over an analytic height, every chunk resident unless the settings say otherwise. Level 0
/// is the contact level; the samples are `height` at the lattice, rounded to quanta.
Ground make_test_ground(std::function<double(double, double)> height,
                        const TableGroundSettings& settings = {});

/// The same with the two settings that most tests use.
Ground make_test_ground(std::function<double(double, double)> height, double spacing, int roots);

}  // namespace terrane::test
