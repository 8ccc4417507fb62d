// SPDX-License-Identifier: MIT
#include "support/grounds.h"

#include <terrane/terrain/fractal_heights.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

namespace terrane::test {
namespace {

float round_up(double value) {
    return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

}  // namespace

double wave(double t) {
    t -= std::floor(t);
    const double u = t < 0.5 ? t : t - 0.5;
    const double hump = 16.0 * u * (0.5 - u);
    return t < 0.5 ? hump : -hump;
}

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

// Over a right triangle with hypotenuse l a surface deviates from its interpolation by at most M l^2 / 8, where M
// bounds the second derivative in any direction: 32 along an axis and 2 * 64 / 2 diagonally, times amplitude /
// wavelength^2.
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

std::shared_ptr<const HeightSource> fractal_hills() {
    return FractalHeights::create({.seed = 3,
                                   .octave_count = 8,
                                   .amplitude = 60.0,
                                   .wavelength_log2 = 9,
                                   .root_size_log2 = 11})
        .value();
}

WorldRect whole_extent(const Lattice& lattice) {
    return {lattice.x(lattice.west()), lattice.y(lattice.south()), lattice.x(lattice.east()),
            lattice.y(lattice.north())};
}

Lattice small_world(int finest_level, double spacing) {
    Lattice lattice{.spacing = spacing, .finest_level = finest_level};
    lattice.first_root_x = lattice.first_root_y = -1;
    lattice.root_count_x = lattice.root_count_y = 2;
    return lattice;
}

std::vector<std::shared_ptr<const Chunk>> all_chunks(const HeightSource& source) {
    const Lattice& lattice = source.lattice();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (std::uint8_t level = 0; level <= lattice.finest_level; ++level) {
        for (std::int32_t y = 0; y < lattice.root_count_y << level; ++y) {
            for (std::int32_t x = 0; x < lattice.root_count_x << level; ++x) {
                const ChunkKey key{(lattice.first_root_x << level) + x,
                                   (lattice.first_root_y << level) + y, level};
                chunks.push_back(make_chunk(source, key).value());
            }
        }
    }
    return chunks;
}

namespace {

class TableHeights final : public HeightSource {
public:
    TableHeights(const Lattice& lattice, const WorldRect& extent,
                 std::function<double(double, double)> height, const TableGroundSettings& settings)
        : HeightSource(lattice, extent), height_(std::move(height)), settings_(settings) {}

    // Interpolates the triangles of the only level, so that a bound of 0 is correct.
    double height(double x, double y) const override {
        const double u = (x - lattice().origin_x) / lattice().spacing;
        const double v = (y - lattice().origin_y) / lattice().spacing;
        const double column = std::floor(u), row = std::floor(v);
        const double fx = u - column, fy = v - row;
        const auto i = static_cast<std::int64_t>(column), j = static_cast<std::int64_t>(row);
        const auto at = [&](int dx, int dy) {
            return height_(lattice().x(i + dx), lattice().y(j + dy));
        };
        const double sw = at(0, 0), se = at(1, 0), nw = at(0, 1), ne = at(1, 1);
        if (cut_to_north_east(i, j)) {
            return fx >= fy ? sw + fx * (se - sw) + fy * (ne - se)
                            : sw + fy * (nw - sw) + fx * (ne - nw);
        }
        return fx + fy <= 1.0 ? sw + fx * (se - sw) + fy * (nw - sw)
                              : ne + (1.0 - fx) * (nw - ne) + (1.0 - fy) * (se - ne);
    }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                heights_out[static_cast<std::size_t>(row * grid.columns + column)] =
                    height_(lattice().x(grid.corner.x + column * grid.step),
                            lattice().y(grid.corner.y + row * grid.step));
            }
        }
        return {};
    }

    // The range of all heights: contact does not use bounds of vertices.
    Result<void> vertex_bounds(const SampleGrid&, std::span<float> bounds_out) const override {
        std::fill(bounds_out.begin(), bounds_out.end(), static_cast<float>(rise_bound(0.0)));
        return {};
    }

    Result<void> cell_bounds(const SampleGrid&, std::span<float> bounds_out) const override {
        std::fill(bounds_out.begin(), bounds_out.end(), settings_.bound);
        return {};
    }

    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        const double half = 0.5 * lattice().spacing * static_cast<double>(grid.step);
        for (int row = 0; row + 1 < grid.rows; ++row) {
            for (int column = 0; column + 1 < grid.columns; ++column) {
                const double x = lattice().x(grid.corner.x + column * grid.step) + half;
                const double y = lattice().y(grid.corner.y + row * grid.step) + half;
                const bool outside = settings_.is_outside && settings_.is_outside(x, y);
                flags_out[static_cast<std::size_t>(row * (grid.columns - 1) + column)] =
                    outside ? cell_outside : cell_ground;
            }
        }
        return {};
    }

    HeightInterval interval(const WorldRect&) const override {
        const double largest = 0x1p31 * lattice().quantum;
        return {-largest, largest};
    }

    double rise_bound(double) const override { return 0x1p32 * lattice().quantum; }

private:
    std::function<double(double, double)> height_;
    TableGroundSettings settings_;
};

}  // namespace

Ground make_test_ground(std::function<double(double, double)> height,
                        const TableGroundSettings& settings) {
    Lattice lattice{.origin_x = settings.origin_x,
                    .origin_y = settings.origin_y,
                    .spacing = settings.spacing,
                    .quantum = settings.quantum};
    lattice.first_root_x = lattice.first_root_y = settings.first_root;
    lattice.root_count_x = lattice.root_count_y = settings.roots;
    const WorldRect extent = settings.extent.value_or(whole_extent(lattice));
    const TableHeights source(lattice, extent, std::move(height), settings);
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (int row = 0; row < settings.roots; ++row) {
        for (int column = 0; column < settings.roots; ++column) {
            if (settings.is_resident && !settings.is_resident(column, row)) continue;
            Result<std::shared_ptr<const Chunk>> chunk = make_chunk(
                source, {settings.first_root + column, settings.first_root + row, std::uint8_t{0}});
            if (!chunk) {
                std::fprintf(stderr, "test ground: %s\n", chunk.error().message.c_str());
                std::abort();
            }
            chunks.push_back(*chunk);
            if (!settings.solid) continue;
            auto joined = std::make_shared<Chunk>(**chunk);
            joined->solid = settings.solid(*joined);
            chunks.back() = std::move(joined);
        }
    }
    return Ground(std::make_shared<const ResidentSet>(lattice, extent, std::move(chunks), 1), 0,
                  settings.surface);
}

Ground make_test_ground(std::function<double(double, double)> height, double spacing, int roots) {
    TableGroundSettings settings{.spacing = spacing, .roots = roots};
    return make_test_ground(std::move(height), settings);
}

std::vector<CornerTriangle> triangles_of(const Ground& ground, const CellRange& cells) {
    std::vector<CornerTriangle> triangles;
    for (std::int64_t row = cells.south; row <= cells.north; ++row) {
        for (std::int64_t column = cells.west; column <= cells.east; ++column) {
            const GroundCell cell = ground.cell(column, row);
            if (cell.status != QueryStatus::ok) continue;
            const auto corner = [&](int i, int j, std::int32_t height) {
                return Eigen::Vector3d(ground.cell_x(column + i), ground.cell_y(row + j),
                                       ground.lattice().quantum * height);
            };
            const Eigen::Vector3d sw = corner(0, 0, cell.south_west);
            const Eigen::Vector3d se = corner(1, 0, cell.south_east);
            const Eigen::Vector3d nw = corner(0, 1, cell.north_west);
            const Eigen::Vector3d ne = corner(1, 1, cell.north_east);
            const bool cut = cell.cut_to_north_east;
            const SolidSurface* const solid = ground.solid(column, row);
            const std::size_t index = cell_index(static_cast<int>(column & (kChunkCells - 1)),
                                                 static_cast<int>(row & (kChunkCells - 1)));
            if (!solid || !solid->is_replaced(index, false)) {
                triangles.push_back({sw, se, cut ? ne : nw});
            }
            if (!solid || !solid->is_replaced(index, true)) {
                triangles.push_back({nw, cut ? sw : se, ne});
            }
        }
    }
    return triangles;
}

std::optional<double> first_hit(const std::vector<CornerTriangle>& triangles, const WorldPos& from,
                                const WorldPos& to) {
    std::optional<double> best;
    const Eigen::Vector3d displacement = to - from;
    for (const auto& [a, b, c] : triangles) {
        const Eigen::Vector3d e1 = b - a, e2 = c - a, s = from - a;
        const Eigen::Vector3d p = displacement.cross(e2), q = s.cross(e1);
        const double determinant = e1.dot(p);
        if (std::abs(determinant) < 1e-14) continue;
        const double u = s.dot(p) / determinant, v = displacement.dot(q) / determinant;
        const double fraction = e2.dot(q) / determinant;
        const bool is_inside = u >= -1e-10 && v >= -1e-10 && u + v <= 1.0 + 1e-10;
        if (is_inside && fraction >= 0.0 && fraction <= best.value_or(1.0)) best = fraction;
    }
    return best;
}

std::shared_ptr<const HeightSource> rolling_hills() {
    return FractalHeights::create({.seed = 3,
                                   .octave_count = 6,
                                   .amplitude = 12.0,
                                   .wavelength_log2 = 8,
                                   .root_size_log2 = 11})
        .value();
}

}  // namespace terrane::test
