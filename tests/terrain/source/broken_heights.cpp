// SPDX-License-Identifier: MIT
#include "broken_heights.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <thread>

namespace terrane::test {
namespace {

constexpr double kCurvature = 1e-4;  // 1 / m
constexpr double kHalfWorld = 65536.0;

Lattice make_lattice(Breach breach) {
    Lattice lattice;
    lattice.finest_level = 9;
    lattice.first_root_x = lattice.first_root_y = -1;
    lattice.root_count_x = lattice.root_count_y = 2;
    lattice.quantum = breach == Breach::bad_quantum ? 0.3 : 0x1p-10;  // holds 430 km in the corners
    return lattice;
}

WorldRect make_extent(Breach breach) {
    if (breach == Breach::no_extent) return {0.0, 0.0, 0.0, 0.0};
    return {-kHalfWorld, -kHalfWorld, kHalfWorld, kHalfWorld};
}

std::uint64_t this_thread() { return std::hash<std::thread::id>()(std::this_thread::get_id()); }

// Outward, with room for the rounding of the formula.
float round_up(double bound) {
    return std::nextafter(static_cast<float>(bound), std::numeric_limits<float>::infinity());
}

}  // namespace

BrokenHeights::BrokenHeights(Breach breach, double factor)
    : HeightSource(make_lattice(breach), make_extent(breach)),
      breach_(breach),
      factor_(factor),
      maker_(this_thread()) {}

double BrokenHeights::height(double x, double y) const {
    const double z = 0.5 * kCurvature * (x * x + y * y);
    if (breaks(Breach::single_precision) && std::max(std::abs(x), std::abs(y)) > 50'000.0) {
        return static_cast<double>(static_cast<float>(z));
    }
    return breaks(Breach::too_high) ? z + 1e6 : z;
}

bool BrokenHeights::was_asked(const SampleGrid& grid) const {
    const std::lock_guard lock(mutex_);
    return !asked_.insert({grid.corner.x, grid.corner.y, grid.step, grid.columns}).second;
}

Result<void> BrokenHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    const bool is_far = lattice().x(grid.corner.x) > 30'000.0;
    if (is_far && breaks(Breach::read_error)) return fail(ErrorCode::io, "the disk is gone");
    if (is_far && breaks(Breach::exception)) throw std::runtime_error("no such tile");
    const bool has_other_bits = (breaks(Breach::wide_windows) && grid.columns > 12) ||
                                (breaks(Breach::coarse_levels) && grid.step >= 16) ||
                                (breaks(Breach::second_time) && was_asked(grid)) ||
                                (breaks(Breach::other_threads) && maker_ != this_thread());
    const std::int64_t shift = breaks(Breach::neighbour) ? grid.step : 0;
    std::size_t i = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++i) {
            heights_out[i] = height(lattice().x(grid.corner.x + column * grid.step + shift),
                                    lattice().y(grid.corner.y + row * grid.step));
            if (has_other_bits) heights_out[i] = std::nextafter(heights_out[i], 1e9);
        }
    }
    if (is_far && breaks(Breach::nan_sample)) heights_out[i / 2] = std::nan("");
    return {};
}

double BrokenHeights::factor_at(const SampleGrid& grid, int column, int row) const {
    if (breach_ != Breach::bounds_in_a_patch) return 1.0;
    const double x = lattice().x(grid.corner.x + column * grid.step);
    const double y = lattice().y(grid.corner.y + row * grid.step);
    return WorldRect{1000.0, 1000.0, 3000.0, 3000.0}.contains(x, y) ? factor_ : 1.0;
}

Result<void> BrokenHeights::vertex_bounds(const SampleGrid& grid,
                                          std::span<float> bounds_out) const {
    const auto s = static_cast<double>(grid.step);
    std::size_t i = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++i) {
            const bool is_centre = (column & row & 1) != 0;
            // the surface is furthest from the split edge at its middle: curvature / 8 edge^2
            double bound = (is_centre ? 1.0 : 0.5) * kCurvature * s * s + 2e-9;
            if (breaks(Breach::vertex_bounds)) bound *= factor_;
            if (breaks(Breach::midpoint_bounds) && !is_centre) bound *= factor_;
            if (breaks(Breach::one_spacing) && grid.step == 8) bound *= factor_;
            if (breaks(Breach::nan_bound) && i == 5) bound = std::nan("");
            bound *= factor_at(grid, column, row);
            const bool is_vertex = ((column | row) & 1) != 0;
            bounds_out[i] = is_vertex || breaks(Breach::corner_bounds) ? round_up(bound) : 0.0f;
        }
    }
    return {};
}

Result<void> BrokenHeights::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const auto s = static_cast<double>(grid.step);
    std::size_t i = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column, ++i) {
            double bound = 0.25 * kCurvature * s * s + 1e-9;
            if (breaks(Breach::cell_bounds)) bound *= factor_;
            bounds_out[i] = round_up(bound * factor_at(grid, column, row));
        }
    }
    return {};
}

Result<void> BrokenHeights::mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                        std::span<float> cell_bounds_out) const {
    const Result<void> made = HeightSource::mesh_bounds(grid, vertex_bounds_out, cell_bounds_out);
    if (made && breaks(Breach::mesh_bounds)) {
        vertex_bounds_out[1] = std::nextafter(vertex_bounds_out[1], 1e9f);
    }
    return made;
}

HeightInterval BrokenHeights::interval(const WorldRect& rect) const {
    const auto square = [](double value) { return value * value; };
    const double near_x = std::clamp(0.0, rect.west, rect.east);
    const double near_y = std::clamp(0.0, rect.south, rect.north);
    const double far_x = std::max(std::abs(rect.west), std::abs(rect.east));
    const double far_y = std::max(std::abs(rect.south), std::abs(rect.north));
    const double low = 0.5 * kCurvature * (square(near_x) + square(near_y));
    const double high = 0.5 * kCurvature * (square(far_x) + square(far_y));
    const double raised = breaks(Breach::too_high) ? 1e6 : 0.0;
    if (breaks(Breach::interval_upside_down)) return {high, low};
    // rounding to float is within 1 / 2^24
    const double slack = breaks(Breach::single_precision) ? 0.1 : 0.0;
    return {low + raised - slack,
            raised + slack + (breaks(Breach::interval) ? low + factor_ * (high - low) : high)};
}

double BrokenHeights::rise_bound(double distance) const {
    const double steepest = kCurvature * kHalfWorld * std::sqrt(2.0);
    if (breaks(Breach::rise_falls)) return steepest * 1e6 / distance;
    const double rounding = breaks(Breach::single_precision) ? 0.1 : 1e-9;
    return (breaks(Breach::rise) ? factor_ : 1.0) * steepest * distance + rounding;
}

}  // namespace terrane::test
