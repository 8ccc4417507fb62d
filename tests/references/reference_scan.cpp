// SPDX-License-Identifier: MIT
#include "reference_scan.h"

#include "reference_meshes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace terrane::test {
namespace {

std::int64_t floor_divide(std::int64_t a, std::int64_t positive) {
    return a >= 0 ? a / positive : -((-a + positive - 1) / positive);
}

}  // namespace

Worst find_worst(const HeightTable& table, const std::array<Place, 3>& corners) {
    const auto& [a, b, c] = corners;
    const auto doubled = static_cast<double>(cross(a, b, c));
    const double za = static_cast<double>(table.at(a[0], a[1]));
    const double rise_b = static_cast<double>(table.at(b[0], b[1])) - za;
    const double rise_c = static_cast<double>(table.at(c[0], c[1])) - za;
    const double slope_x = (rise_b * (c[1] - a[1]) - rise_c * (b[1] - a[1])) / doubled;
    const double slope_y = (rise_c * (b[0] - a[0]) - rise_b * (c[0] - a[0])) / doubled;
    Worst worst;
    const auto [south, north] = std::minmax({a[1], b[1], c[1]});
    const auto [west, east] = std::minmax({a[0], b[0], c[0]});
    for (int y = south; y <= north; ++y) {
        // left of each edge: (b - a) x (p - a) >= 0, a condition on p's column
        std::int64_t first = west, last = east;
        for (std::size_t k = 0; k < 3; ++k) {
            const Place& from = corners[k];
            const Place& to = corners[(k + 1) % 3];
            const std::int64_t dy = to[1] - from[1];
            const std::int64_t rest = std::int64_t{to[0] - from[0]} * (y - from[1]);
            if (dy > 0) last = std::min(last, from[0] + floor_divide(rest, dy));
            if (dy < 0) first = std::max(first, from[0] - floor_divide(rest, -dy));
        }
        const double row = za + (y - a[1]) * slope_y;
        const float* samples = &table.heights[table.index(0, y)];
        for (std::int64_t x = first; x <= last; ++x) {
            const double plane = row + static_cast<double>(x - a[0]) * slope_x;
            const double error = std::abs(static_cast<double>(samples[x]) - plane);
            if (error > worst.error) worst = {error, {static_cast<int>(x), y}};
        }
    }
    return worst;
}

double measure_error(const HeightTable& table, const TableMesh& mesh) {
    double worst = 0.0;
    std::int64_t doubled = 0;
    for (const auto& triangle : mesh.triangles) {
        const std::array<Place, 3> corners{mesh.vertices[triangle[0]], mesh.vertices[triangle[1]],
                                           mesh.vertices[triangle[2]]};
        const std::int64_t area = cross(corners[0], corners[1], corners[2]);
        if (area <= 0) return std::numeric_limits<double>::infinity();
        doubled += area;
        worst = std::max(worst, find_worst(table, corners).error);
    }
    const std::int64_t whole = std::int64_t{2} * (table.columns - 1) * (table.rows - 1);
    return doubled == whole ? worst : std::numeric_limits<double>::infinity();
}

}  // namespace terrane::test
