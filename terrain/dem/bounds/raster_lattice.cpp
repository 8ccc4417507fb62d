// SPDX-License-Identifier: MIT
#include "bounds/raster_lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace terrane::internal {
namespace {

constexpr int kMostRoots = 4;
constexpr int kFinestLevel = 24;

std::string in_metres(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%g m", value);
    return text;
}

/// The largest number with eight significant bits that is at most `value`: it is less than 1 % smaller, and its
/// multiples are exact.
double round_down_to_eight_bits(double value) {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    return std::ldexp(std::floor(mantissa * 256.0), exponent - 8);
}

/// The finest quantum for which all heights, with a reserve for detail, fit in 32 bits; at least 2^-12 m, or a 4096th
/// of spacings below 2^-7 m (8 mm).
double choose_quantum(const DemInfo& info, double spacing) {
    constexpr double kFinestQuantum = 0x1p-12, kSmallSpacing = 0x1p-7;
    constexpr double kMostDetail = 1e4, kDetailPerSpacing = 1e5;
    double quantum = kFinestQuantum;
    while (spacing < kSmallSpacing && quantum > 0x1p-12 * spacing) quantum *= 0.5;
    const double margin = std::min(kMostDetail, kDetailPerSpacing * spacing);
    const double reach = 2.0 * std::max(std::fabs(info.min_m), std::fabs(info.max_m)) + margin;
    while (reach > kMostQuanta * quantum) quantum *= 2.0;
    return quantum;
}

/// Number of root squares along an axis; lengths in finest spacings.
std::int64_t roots_along(std::int64_t length, std::int64_t root) {
    return (length + root - 1) / root;
}

}  // namespace

Result<BilinearGrid> make_grid(const DemInfo& info, double finest_spacing,
                               double spacing_tolerance) {
    if (!(finest_spacing >= 0.0 && std::isfinite(finest_spacing))) {
        return fail(ErrorCode::invalid_argument,
                    "finest_spacing must be 0 or more metres, got " + in_metres(finest_spacing));
    }
    BilinearGrid grid;
    grid.columns = info.columns;
    grid.rows = info.rows;
    grid.cell_x = info.cell_x;
    grid.cell_y = info.cell_y;
    grid.west = (0.5 - 0.5 * info.columns) * info.cell_x;
    grid.south = (0.5 - 0.5 * info.rows) * info.cell_y;
    grid.aligned = info.cell_x == info.cell_y;

    const double shorter = std::min(info.cell_x, info.cell_y);
    double base = shorter;
    const Error too_fine{ErrorCode::invalid_argument,
                         "finest_spacing " + in_metres(finest_spacing) +
                             " is too fine for a raster of " + std::to_string(info.columns) +
                             " x " + std::to_string(info.rows) + " cells of " + in_metres(shorter) +
                             ", more than 24 levels"};
    if (!grid.aligned) {
        base = finest_spacing > 0.0 ? finest_spacing : round_down_to_eight_bits(shorter);
        while (base > shorter) base *= 0.5;
        for (int doublings = 0; 2.0 * base <= shorter; ++doublings) {
            if (doublings > kFinestLevel) return tl::unexpected(too_fine);
            base *= 2.0;
        }
    }
    double spacing = base;
    const double longest = finest_spacing * (grid.aligned ? spacing_tolerance : 1.0);
    while (finest_spacing > 0.0 && spacing > longest) {
        spacing *= 0.5;
        if (++grid.cell_log2 > kFinestLevel) return tl::unexpected(too_fine);
    }

    // Lengths in finest spacings. If aligned, the lattice starts one sample beyond the south-western one, so that every
    // sample is a lattice point and the outer edges are covered.
    const std::int64_t step = grid.base_step();
    const auto spacings = [&](int count, double cell) {
        if (grid.aligned) return count * step + (step + 1) / 2;
        return static_cast<std::int64_t>(std::ceil(count * cell / spacing));
    };
    const std::int64_t width = spacings(info.columns, info.cell_x);
    const std::int64_t height = spacings(info.rows, info.cell_y);
    int level = 0;
    std::int64_t root = kChunkCells;
    while (roots_along(std::max(width, height), root) > kMostRoots) {
        root *= 2;
        if (++level > kFinestLevel) return tl::unexpected(too_fine);
    }
    Lattice& lattice = grid.lattice;
    lattice.spacing = spacing;
    lattice.finest_level = level;
    lattice.root_count_x = static_cast<std::int32_t>(roots_along(width, root));
    lattice.root_count_y = static_cast<std::int32_t>(roots_along(height, root));

    const std::int64_t spare_x = root * lattice.root_count_x - width;
    const std::int64_t spare_y = root * lattice.root_count_y - height;
    if (grid.aligned) {
        // Centres the raster, rounded to whole cells.
        grid.first = {step * (1 + spare_x / (2 * step)), step * (1 + spare_y / (2 * step))};
        lattice.origin_x = grid.west - spacing * static_cast<double>(grid.first.x);
        lattice.origin_y = grid.south - spacing * static_cast<double>(grid.first.y);
    } else {
        lattice.origin_x = -0.5 * lattice.root_size() * lattice.root_count_x;
        lattice.origin_y = -0.5 * lattice.root_size() * lattice.root_count_y;
    }
    lattice.quantum = choose_quantum(info, spacing);
    return grid;
}

}  // namespace terrane::internal
