// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace terrane::test {

/// Paraboloid arcs: period 1, range [-1, 1], |slope| <= 8, |second derivative| <= 32.
double wave(double t);

/// Smooth periodic hills and hollows with closed-form bounds: z = A wave(x / L) wave(y / L). Hooks delay its answers or
/// make them fail.
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
    std::atomic<int> delay_ms{0};        ///< delays each sample()
    std::atomic<bool> is_held{false};    ///< blocks sample() while set
    std::atomic<bool> is_broken{false};  ///< makes sample() fail
    std::atomic<bool> gives_nan{false};  ///< makes sample() return NaN

private:
    double bound(double longest_edge) const;

    double amplitude_;
    double wavelength_;
};

/// Fractal hills over 2 x 2 root squares of 2048 m around the origin; the first octave has 60 m.
std::shared_ptr<const HeightSource> fractal_hills();

/// The whole extent of a lattice's root squares.
WorldRect whole_extent(const Lattice& lattice);

/// 2 x 2 roots around the origin with `finest_level` further levels, `spacing` metres on the finest one.
Lattice small_world(int finest_level, double spacing);

/// All chunks of a world, parents first.
std::vector<std::shared_ptr<const Chunk>> all_chunks(const HeightSource& source);

/// Position, lattice and contents of a test ground.
struct TableGroundSettings {
    double spacing = 1.0;         ///< between samples, metres
    int roots = 1;                ///< root squares along a side, one chunk of 128 x 128 cells each
    double origin_x = 0.0;        ///< world x of lattice point (0, 0), metres
    double origin_y = 0.0;        ///< world y of lattice point (0, 0), metres
    std::int32_t first_root = 0;  ///< key.x and key.y of the south-western root square
    double quantum = 0x1p-12;     ///< metres
    float bound = 0.0f;           ///< every bound that the source returns
    std::optional<WorldRect> extent{};                 ///< none: all root squares
    std::function<bool(double, double)> is_outside{};  ///< by cell centre; none: all is ground
    std::function<bool(int, int)> is_resident{};  ///< by a root's column and row; none: all roots
    std::shared_ptr<const SurfaceMap> surface{};  ///< null: none
    std::function<std::shared_ptr<const SolidSurface>(const Chunk&)>
        solid{};  ///< by chunk; none: only the heightfield
};

/// Ground over an analytic height. Every chunk is resident unless the settings say otherwise. Level 0 is the contact
/// level; samples are `height` at the lattice points, rounded to quanta.
Ground make_test_ground(std::function<double(double, double)> height,
                        const TableGroundSettings& settings = {});

/// As above, with the two settings that most tests change.
Ground make_test_ground(std::function<double(double, double)> height, double spacing, int roots);

using CornerTriangle = std::array<Eigen::Vector3d, 3>;

/// The triangles of the heightfield in a range of cells, without those that volumes replace.
std::vector<CornerTriangle> triangles_of(const Ground& ground, const CellRange& cells);

/// Fraction of a segment at its first intersection with any of the triangles, by brute force.
std::optional<double> first_hit(const std::vector<CornerTriangle>& triangles, const WorldPos& from,
                                const WorldPos& to);

/// Fractal hills of 12 m and wavelengths up to 256 m, on which vehicles drive and characters walk.
std::shared_ptr<const HeightSource> rolling_hills();

}  // namespace terrane::test
