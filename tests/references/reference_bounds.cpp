// SPDX-License-Identifier: MIT
//
// Plain loops over every sample of every diamond of every spacing: each level costs two passes over
// the table.
//
// Within a cell the bilinear surface minus a plane has its extremes at the corners, where a
// triangle holds the whole cell. A triangle that cuts a cell does it along the cell's diagonal;
// there the difference is a parabola, and its vertex counts too.
#include "reference_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::test {
namespace {

// Covers the rounding of the deviations: heights below 1e5 m, a dozen operations in double.
constexpr double kSlack = 1e-9;

float round_up(double bound) {
    const double safe = bound > 0.0 ? bound + kSlack : 0.0;
    const auto rounded = static_cast<float>(safe);
    return static_cast<double>(rounded) < safe
               ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
               : rounded;
}

class Deviations {
public:
    explicit Deviations(const HeightTable& table) : table_(table) {}

    /// Of the two triangles of a square, cut between its corners of even index sum.
    double square(int west, int south, int side) const {
        const int east = west + side, north = south + side;
        const double sw = at(west, south), se = at(east, south);
        const double nw = at(west, north), ne = at(east, north);
        const double per_side = 1.0 / side;
        const bool to_north_east = cut_to_north_east(west / side, south / side);
        double worst = 0.0;
        for (int j = 0; j <= side; ++j) {
            const double t = j * per_side;
            if (to_north_east) {
                worst = std::max(worst, row(west + j, south + j, side - j + 1, sw + t * (ne - sw),
                                            (se - sw) * per_side));
                worst = std::max(
                    worst, row(west, south + j, j + 1, sw + t * (nw - sw), (ne - nw) * per_side));
            } else {
                worst = std::max(worst, row(west, south + j, side - j + 1, sw + t * (nw - sw),
                                            (se - sw) * per_side));
                worst = std::max(worst, row(east - j, south + j, j + 1, se + t * (nw - se),
                                            (ne - nw) * per_side));
            }
        }
        return std::max(worst, to_north_east ? diagonal(west, south, 1, side)
                                             : diagonal(east, south, -1, side));
    }

    /// Of the two triangles around an edge along x of length 2 s.
    double diamond_along_x(int x, int y, int s) const {
        const double west = at(x - s, y), east = at(x + s, y);
        const double middle = 0.5 * (west + east);
        const double slope = (east - west) / (2.0 * s);
        double worst = 0.0;
        for (const int up : {-1, 1}) {
            if (y + up * s < 0 || y + up * s >= table_.rows) continue;
            const double rise = (at(x, y + up * s) - middle) / s;
            for (int j = 0; j <= s; ++j) {
                const int half = s - j;
                worst = std::max(worst, row(x - half, y + up * j, 2 * half + 1,
                                            middle + j * rise - half * slope, slope));
            }
        }
        return std::max(worst, rim(x, y, s));
    }

    double diamond_along_y(int x, int y, int s) const {
        const double south = at(x, y - s), north = at(x, y + s);
        const double middle = 0.5 * (south + north);
        const double slope = (north - south) / (2.0 * s);
        double worst = 0.0;
        for (int j = -s; j <= s; ++j) {
            const int half = s - std::abs(j);
            const double here = middle + j * slope;
            if (x - s >= 0) {
                const double rise = (middle - at(x - s, y)) / s;
                worst = std::max(worst, row(x - half, y + j, half + 1, here - half * rise, rise));
            }
            if (x + s < table_.columns) {
                const double rise = (at(x + s, y) - middle) / s;
                worst = std::max(worst, row(x, y + j, half + 1, here, rise));
            }
        }
        return std::max(worst, rim(x, y, s));
    }

private:
    double at(int x, int y) const { return static_cast<double>(table_.at(x, y)); }

    /// Largest distance of a row of samples from start + i * slope.
    double row(int x, int y, int count, double start, double slope) const {
        const float* samples = &table_.heights[table_.index(x, y)];
        double worst = 0.0;
        for (int i = 0; i < count; ++i) {
            const double off = std::abs(static_cast<double>(samples[i]) - (start + i * slope));
            worst = off > worst ? off : worst;
        }
        return worst;
    }

    /// Largest distance of the surface from the line between the ends of a diagonal, between
    /// samples.
    ///
    /// @param toward  1: to the north-east, -1: to the north-west
    double diagonal(int x, int y, int toward, int count) const {
        const double start = at(x, y);
        const double slope = (at(x + toward * count, y + count) - start) / count;
        double worst = 0.0, from = 0.0;
        for (int k = 0; k < count; ++k, x += toward, ++y) {
            const double to = at(x + toward, y + 1) - (start + (k + 1) * slope);
            const double bend = at(x, y) - at(x + toward, y) - at(x, y + 1) + at(x + toward, y + 1);
            // from + t (to - from) - bend t (1 - t)
            if (std::abs(to - from) < std::abs(bend)) {
                const double t = 0.5 * (1.0 - (to - from) / bend);
                worst = std::max(worst, std::abs(from + t * (to - from) - bend * t * (1.0 - t)));
            }
            from = to;
        }
        return worst;
    }

    /// The four sides of a midpoint's diamond.
    double rim(int x, int y, int s) const {
        const bool has_west = x - s >= 0, has_east = x + s < table_.columns;
        const bool has_south = y - s >= 0, has_north = y + s < table_.rows;
        double worst = 0.0;
        if (has_west && has_north) worst = std::max(worst, diagonal(x - s, y, 1, s));
        if (has_east && has_north) worst = std::max(worst, diagonal(x + s, y, -1, s));
        if (has_south && has_east) worst = std::max(worst, diagonal(x, y - s, 1, s));
        if (has_south && has_west) worst = std::max(worst, diagonal(x, y - s, -1, s));
        return worst;
    }

    const HeightTable& table_;
};

}  // namespace

DiamondBounds make_diamond_bounds(const HeightTable& table, int root_cells) {
    const Deviations deviations(table);
    DiamondBounds bounds;
    bounds.own.assign(table.heights.size(), 0.0f);
    bounds.nested.assign(table.heights.size(), 0.0f);
    const auto below = [&](float& bound, int x, int y) {
        if (x < 0 || y < 0 || x >= table.columns || y >= table.rows) return;
        bound = std::max(bound, bounds.nested[table.index(x, y)]);
    };
    for (int s = 1; 2 * s <= root_cells; s *= 2) {
        for (int y = 0; y < table.rows; y += s) {
            const bool odd_row = ((y / s) & 1) != 0;
            for (int x = odd_row ? 0 : s; x < table.columns; x += 2 * s) {  // midpoints
                const std::size_t i = table.index(x, y);
                bounds.own[i] = round_up(odd_row ? deviations.diamond_along_y(x, y, s)
                                                 : deviations.diamond_along_x(x, y, s));
                bounds.nested[i] = bounds.own[i];
                if (s == 1) continue;
                const int half = s / 2;
                for (const int dx : {-half, half}) {
                    for (const int dy : {-half, half}) below(bounds.nested[i], x + dx, y + dy);
                }
            }
        }
        for (int y = s; y < table.rows; y += 2 * s) {
            for (int x = s; x < table.columns; x += 2 * s) {  // centres
                const std::size_t i = table.index(x, y);
                bounds.own[i] = round_up(deviations.square(x - s, y - s, 2 * s));
                bounds.nested[i] = bounds.own[i];
                for (const int step : {-s, s}) {
                    below(bounds.nested[i], x + step, y);
                    below(bounds.nested[i], x, y + step);
                }
            }
        }
    }
    return bounds;
}

}  // namespace terrane::test
