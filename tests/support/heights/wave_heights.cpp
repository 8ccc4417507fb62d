// SPDX-License-Identifier: MIT
#include "wave_heights.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace terrane::test {
namespace {

// Period 1, range [-1, 1], |slope| <= 8, |second derivative| <= 32.
double wave(double t) {
    t -= std::floor(t);
    const double u = t < 0.5 ? t : t - 0.5;
    const double hump = 16.0 * u * (0.5 - u);
    return t < 0.5 ? hump : -hump;
}

float round_up(double value) {
    return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

}  // namespace

WaveHeights::WaveHeights(const Lattice& lattice, double amplitude, double wavelength)
    : HeightSource(lattice, whole_extent(lattice)),
      amplitude_(amplitude),
      wavelength_(wavelength) {}

double WaveHeights::height(double x, double y) const {
    return amplitude_ * wave(x / wavelength_) * wave(y / wavelength_);
}

Result<void> WaveHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    ++sample_count;
    if (delay_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms.load()));
    is_held.wait(true);
    if (is_broken) return fail(ErrorCode::io, "the source is broken on purpose");
    std::size_t i = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++i) {
            heights_out[i] = height(lattice().x(grid.corner.x + column * grid.step),
                                    lattice().y(grid.corner.y + row * grid.step));
        }
    }
    if (gives_nan) heights_out[i / 2] = std::numeric_limits<double>::quiet_NaN();
    return {};
}

// A right triangle of hypotenuse l leaves a surface by at most M l^2 / 8, where M bounds the second
// derivative in any direction: 32 along an axis and 2 * 64 / 2 across, times amplitude / wavelength^2.
double WaveHeights::bound(double longest_edge) const {
    const double second = 96.0 * amplitude_ / (wavelength_ * wavelength_);
    return std::min(2.0 * amplitude_, second * longest_edge * longest_edge / 8.0);
}

Result<void> WaveHeights::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const double spacing = lattice().spacing * static_cast<double>(grid.step);
    std::size_t i = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++i) {
            const bool is_odd_row = row % 2 != 0;
            const bool is_odd_column = column % 2 != 0;
            const double edge = is_odd_row && is_odd_column ? 2.0 * std::sqrt(2.0) : 2.0;
            bounds_out[i] = is_odd_row || is_odd_column ? round_up(bound(edge * spacing)) : 0.0f;
        }
    }
    return {};
}

Result<void> WaveHeights::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const double spacing = lattice().spacing * static_cast<double>(grid.step);
    std::fill(bounds_out.begin(), bounds_out.end(), round_up(bound(std::sqrt(2.0) * spacing)));
    return {};
}

HeightInterval WaveHeights::interval(const WorldRect&) const { return {-amplitude_, amplitude_}; }

double WaveHeights::rise_bound(double distance) const {
    return std::min(2.0 * amplitude_, std::sqrt(2.0) * 8.0 * amplitude_ / wavelength_ * distance);
}

WorldRect whole_extent(const Lattice& lattice) {
    return {lattice.x(lattice.west()), lattice.y(lattice.south()), lattice.x(lattice.east()),
            lattice.y(lattice.north())};
}

Lattice small_world(int finest_level, double spacing) {
    Lattice lattice;
    lattice.finest_level = finest_level;
    lattice.spacing = spacing;
    lattice.first_root_x = lattice.first_root_y = -1;
    lattice.root_count_x = lattice.root_count_y = 2;
    return lattice;
}

}  // namespace terrane::test
