// SPDX-License-Identifier: MIT
//
// Positions are integers in units of 2^-24 m, modulo 2^64: at 10^9 m from the origin an octave's
// fraction has as many bits as beside it. Beyond 2^39 m the ground repeats itself.
#include "mesh_bounds.h"
#include "noise.h"
#include "octave_bounds.h"
#include "settings_check.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/fractal_heights.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace terrane {
namespace {

constexpr int kUnitLog2 = -24;
/// The world's edges must lie within 2^38 m: half of what 64 bits hold, so that margins fit too.
constexpr int kMaxExtentLog2 = 38;

/// A coordinate in units, and what is left of it, 0 to 1.
struct FixedCoordinate {
    std::uint64_t units = 0;
    double rest = 0.0;
};

FixedCoordinate to_fixed(double metres) {
    double wrapped = metres;
    if (std::abs(metres) >= 0x1p39) {
        wrapped = std::fmod(metres, 0x1p40);
        if (wrapped >= 0x1p39) wrapped -= 0x1p40;
        if (wrapped < -0x1p39) wrapped += 0x1p40;
    }
    const double units = wrapped * 0x1p24;
    const double whole = std::floor(units);
    return {static_cast<std::uint64_t>(static_cast<std::int64_t>(whole)), units - whole};
}

/// An octave of the fractal and how it lies over the units.
struct Octave {
    double amplitude = 0.0;
    int shift = 0;  ///< a cell has 2^shift units
    double cells_per_unit = 0.0;
    std::uint64_t offset_x = 0, offset_y = 0;
    NoiseKeys keys;

    std::uint64_t cell_mask() const { return ~std::uint64_t{0} >> shift; }

    NoiseCoordinate coordinate(std::uint64_t units, double rest, std::uint64_t offset) const {
        const std::uint64_t shifted = units + offset;
        const std::uint64_t inside = shifted & ((std::uint64_t{1} << shift) - 1);
        const double fraction =
            (static_cast<double>(static_cast<std::int64_t>(inside)) + rest) * cells_per_unit;
        return {shifted >> shift, fraction};
    }

    NoisePlace place_x(const FixedCoordinate& x) const {
        return noise_place(keys.x, cell_mask(), coordinate(x.units, x.rest, offset_x));
    }
    NoisePlace place_y(const FixedCoordinate& y) const {
        return noise_place(keys.y, cell_mask(), coordinate(y.units, y.rest, offset_y));
    }
};

/// Shifts an octave by any number of cells and a fraction between 1/4 and 3/4: at 0 and 1 all samples
/// of a lattice coarser than the octave would be nodes, where noise is zero.
std::uint64_t make_offset(std::uint64_t hash, int shift) {
    const std::uint64_t half = std::uint64_t{1} << (shift - 1), quarter = half >> 1;
    return (hash & half) != 0 ? hash & ~quarter : hash | quarter;
}

std::vector<Octave> make_octaves(const FractalSettings& settings) {
    std::vector<Octave> octaves;
    double amplitude = settings.amplitude;
    for (int index = 0; index < settings.octave_count; ++index) {
        Octave octave;
        octave.amplitude = amplitude;
        octave.shift = settings.wavelength_log2 - index - kUnitLog2;
        octave.cells_per_unit = std::ldexp(1.0, -octave.shift);
        octave.keys = NoiseKeys::make(settings.seed, index);
        octave.offset_x = make_offset(mix64(octave.keys.x), octave.shift);
        octave.offset_y = make_offset(mix64(octave.keys.y), octave.shift);
        octaves.push_back(octave);
        amplitude *= settings.gain;
    }
    return octaves;
}

std::vector<OctaveScale> make_scales(const std::vector<Octave>& octaves) {
    std::vector<OctaveScale> scales;
    for (const Octave& octave : octaves) {
        scales.push_back({octave.amplitude, std::ldexp(1.0, octave.shift + kUnitLog2)});
    }
    return scales;
}

class Fractal final : public HeightSource {
public:
    Fractal(const Lattice& lattice, const WorldRect& extent, std::vector<Octave> octaves,
            int spacing_log2)
        : HeightSource(lattice, extent),
          octaves_(std::move(octaves)),
          bounds_(make_scales(octaves_)),
          half_spacing_shift_(spacing_log2 - 1 - kUnitLog2) {}

    double height(double x, double y) const override {
        const FixedCoordinate fixed_x = to_fixed(x), fixed_y = to_fixed(y);
        double sum = 0.0;
        for (const Octave& octave : octaves_) {
            sum += octave.amplitude * noise(octave.place_x(fixed_x), octave.place_y(fixed_y));
        }
        return sum;
    }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        TERRANE_ASSERT(heights_out.size() >= grid.size(), "room for every height");
        SampleGrid halves = grid;
        halves.corner = {2 * grid.corner.x, 2 * grid.corner.y};
        halves.step = 2 * grid.step;
        sample_halves(halves, heights_out);
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        compute_vertex_bounds(grid, sample_halves(vertex_support(grid)), spacing_bounds(grid),
                              bounds_out);
        return {};
    }

    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        compute_cell_bounds(grid, sample_halves(cell_support(grid)), spacing_bounds(grid),
                            bounds_out);
        return {};
    }

    HeightInterval interval(const WorldRect& rect) const override {
        const double middle_x = 0.5 * (rect.west + rect.east);
        const double middle_y = 0.5 * (rect.south + rect.north);
        const double half_x = std::max(middle_x - rect.west, rect.east - middle_x);
        const double half_y = std::max(middle_y - rect.south, rect.north - middle_y);
        const double middle = height(middle_x, middle_y);
        const double rise =
            rise_bound(std::sqrt(half_x * half_x + half_y * half_y) * (1.0 + 0x1p-50));
        return {std::max(middle - rise, -bounds_.sup()), std::min(middle + rise, bounds_.sup())};
    }

    double rise_bound(double distance) const override { return bounds_.rise(distance); }

private:
    SpacingBounds spacing_bounds(const SampleGrid& grid) const {
        return SpacingBounds::make(bounds_, lattice().spacing * static_cast<double>(grid.step));
    }

    std::vector<double> sample_halves(const SampleGrid& grid) const {
        std::vector<double> heights(grid.size());
        sample_halves(grid, heights);
        return heights;
    }

    /// Samples a grid that is addressed in halves of the finest spacing.
    void sample_halves(const SampleGrid& grid, std::span<double> heights_out) const {
        const auto units = [this](std::int64_t corner, std::int64_t step, int index) {
            return static_cast<std::uint64_t>(corner + step * index) << half_spacing_shift_;
        };
        const std::size_t column_count = static_cast<std::size_t>(grid.columns);
        std::ranges::fill(heights_out.first(grid.size()), 0.0);
        std::vector<NoiseCoordinate> coordinates(column_count);
        NoiseColumns columns;
        for (const Octave& octave : octaves_) {
            for (int column = 0; column < grid.columns; ++column) {
                coordinates[static_cast<std::size_t>(column)] = octave.coordinate(
                    units(grid.corner.x, grid.step, column), 0.0, octave.offset_x);
            }
            columns.assign(octave.keys.x, octave.cell_mask(), coordinates);
            for (int row = 0; row < grid.rows; ++row) {
                const FixedCoordinate y{units(grid.corner.y, grid.step, row), 0.0};
                columns.add_row(octave.place_y(y), octave.amplitude,
                                heights_out.subspan(static_cast<std::size_t>(row) * column_count,
                                                    column_count));
            }
        }
    }

    std::vector<Octave> octaves_;
    OctaveBounds bounds_;
    int half_spacing_shift_;
};

Result<void> check(const FractalSettings& settings) {
    if (auto ok = check_octaves(settings.octave_count, settings.gain); !ok) return ok;
    if (auto ok = check_range("amplitude", settings.amplitude, 0.0, 1e5); !ok) return ok;
    if (auto ok = check_range("wavelength_log2", settings.wavelength_log2, 0, 24); !ok) return ok;
    const int last_wavelength_log2 = settings.wavelength_log2 - settings.octave_count + 1;
    if (last_wavelength_log2 < -20) {
        return fail(ErrorCode::invalid_argument,
                    "octave_count must keep the last octave's wavelength at 2^-20 m or more, got " +
                        std::to_string(settings.octave_count) + " octaves below 2^" +
                        std::to_string(settings.wavelength_log2) + " m");
    }
    if (auto ok = check_range("finest_spacing_log2", settings.finest_spacing_log2, -16, 16); !ok) {
        return ok;
    }
    return check_range("root_size_log2", settings.root_size_log2, settings.finest_spacing_log2 + 7,
                       std::min(settings.finest_spacing_log2 + 31, kMaxExtentLog2));
}

/// Heights are 32-bit multiples of the quantum: the finest that leaves room above the fractal's
/// supremum, but no finer than a 4096th of the spacing or 2^-12 m, whichever is less.
double make_quantum(double sup, int spacing_log2) {
    double quantum = std::ldexp(1.0, std::min(spacing_log2, 0) - 12);
    while (sup > 0x1p30 * quantum) quantum *= 2.0;
    return quantum;
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> FractalHeights::create(
    const FractalSettings& settings) {
    if (const auto ok = check(settings); !ok) return tl::unexpected(ok.error());
    std::vector<Octave> octaves = make_octaves(settings);

    Lattice lattice;
    lattice.spacing = std::ldexp(1.0, settings.finest_spacing_log2);
    lattice.quantum =
        make_quantum(OctaveBounds(make_scales(octaves)).sup(), settings.finest_spacing_log2);
    lattice.finest_level = settings.root_size_log2 - settings.finest_spacing_log2 - 7;
    lattice.first_root_x = settings.first_root_x;
    lattice.first_root_y = settings.first_root_y;
    lattice.root_count_x = settings.root_count_x;
    lattice.root_count_y = settings.root_count_y;
    if (const auto ok = terrane::check(lattice); !ok) return tl::unexpected(ok.error());

    const WorldRect extent = {lattice.x(lattice.west()), lattice.y(lattice.south()),
                              lattice.x(lattice.east()), lattice.y(lattice.north())};
    const double reach = std::max({std::abs(extent.west), std::abs(extent.south),
                                   std::abs(extent.east), std::abs(extent.north)});
    if (reach > std::ldexp(1.0, kMaxExtentLog2)) {
        return fail(ErrorCode::invalid_argument,
                    "root squares must lie within 2^" + std::to_string(kMaxExtentLog2) +
                        " m of the origin, got " + std::to_string(reach) + " m");
    }
    return std::make_shared<const Fractal>(lattice, extent, std::move(octaves),
                                           settings.finest_spacing_log2);
}

}  // namespace terrane
