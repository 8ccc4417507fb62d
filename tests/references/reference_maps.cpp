// SPDX-License-Identifier: MIT
#include "reference_maps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

namespace terrane::test {
namespace {

constexpr int kOctaves = 10;

std::uint32_t mix(std::uint32_t h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

double fade(double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); }

// One octave along the rows of a map: what does not change within a row is kept.
class NoiseRows {
public:
    NoiseRows(int columns, int octave)
        : octave_(octave), per_metre_(std::ldexp(1.0, octave) / 512.0) {
        places_.reserve(static_cast<std::size_t>(columns));
        for (int x = 0; x < columns; ++x) {
            const double u = x * per_metre_ + 17.31 * octave;
            const double cell = std::floor(u);
            places_.push_back({static_cast<int>(cell), u - cell, fade(u - cell)});
        }
    }

    void add_row(int y, double amplitude, std::span<double> row) {
        const double v = y * per_metre_ + 9.77 * octave_;
        const double cell = std::floor(v);
        const double fy = v - cell, faded = fade(fy);
        move_to(static_cast<int>(cell));
        const int first = places_.front().cell;
        for (std::size_t x = 0; x < places_.size(); ++x) {
            const Place& place = places_[x];
            const auto i = static_cast<std::size_t>(place.cell - first);
            const auto dot = [&](const Gradient& g, double dx, double dy) {
                return g.x * dx + g.y * dy;
            };
            const double fx = place.fraction;
            const double south =
                std::lerp(dot(south_[i], fx, fy), dot(south_[i + 1], fx - 1.0, fy), place.faded);
            const double north = std::lerp(dot(north_[i], fx, fy - 1.0),
                                           dot(north_[i + 1], fx - 1.0, fy - 1.0), place.faded);
            row[x] += amplitude * std::lerp(south, north, faded);
        }
    }

private:
    struct Place {
        int cell;
        double fraction, faded;
    };
    struct Gradient {
        double x, y;
    };

    void move_to(int cell) {
        if (!north_.empty() && cell == row_) return;
        if (!north_.empty() && cell == row_ + 1) {
            std::swap(south_, north_);
        } else {
            south_ = gradients(cell);
        }
        north_ = gradients(cell + 1);
        row_ = cell;
    }

    std::vector<Gradient> gradients(int row) const {
        std::vector<Gradient> made;
        for (int i = places_.front().cell; i <= places_.back().cell + 1; ++i) {
            const std::uint32_t hash = mix((static_cast<std::uint32_t>(i) * 0x8da6b343u) ^
                                           (static_cast<std::uint32_t>(row) * 0xd8163841u) ^
                                           (static_cast<std::uint32_t>(octave_) * 0xcb1ab31fu));
            const double angle = 2.0 * std::numbers::pi * 0x1p-32 * hash;
            made.push_back({std::cos(angle), std::sin(angle)});
        }
        return made;
    }

    int octave_;
    double per_metre_;
    std::vector<Place> places_;
    std::vector<Gradient> south_, north_;
    int row_ = 0;
};

double lattice_value(int x, int y, std::uint32_t octave) {
    const std::uint32_t hash =
        mix(mix(mix(static_cast<std::uint32_t>(x)) + static_cast<std::uint32_t>(y)) + octave);
    return hash * (2.0 / 4294967295.0) - 1.0;
}

double value_noise(double x, double y, std::uint32_t octave) {
    const double column = std::floor(x), row = std::floor(y);
    const int i = static_cast<int>(column), j = static_cast<int>(row);
    const double u = fade(x - column), v = fade(y - row);
    const double south =
        lattice_value(i, j, octave) * (1.0 - u) + lattice_value(i + 1, j, octave) * u;
    const double north =
        lattice_value(i, j + 1, octave) * (1.0 - u) + lattice_value(i + 1, j + 1, octave) * u;
    return south * (1.0 - v) + north * v;
}

}  // namespace

double HeightTable::range() const {
    const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
    return static_cast<double>(*high) - static_cast<double>(*low);
}

HeightTable make_fbm_table(int side) {
    HeightTable table;
    table.columns = table.rows = side;
    std::vector<NoiseRows> octaves;
    for (int octave = 0; octave < kOctaves; ++octave) octaves.emplace_back(side, octave);
    std::vector<double> row(static_cast<std::size_t>(side));
    for (int y = 0; y < side; ++y) {
        std::ranges::fill(row, 0.0);
        for (int octave = 0; octave < kOctaves; ++octave) {
            octaves[static_cast<std::size_t>(octave)].add_row(y, std::ldexp(100.0, -octave), row);
        }
        for (const double height : row) table.heights.push_back(static_cast<float>(height));
    }
    return table;
}

HeightTable make_contact_table(int side, double spacing) {
    HeightTable table;
    table.columns = table.rows = side;
    table.spacing = spacing;
    table.heights.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const double x = column * spacing, y = row * spacing;
            double height = 0.0;
            for (int octave = 0; octave < kOctaves; ++octave) {
                const double per_metre = std::ldexp(1.0, octave) / 256.0;
                height += std::ldexp(30.0, -octave) *
                          value_noise(x * per_metre, y * per_metre,
                                      1000u + static_cast<std::uint32_t>(octave));
            }
            table.heights.push_back(static_cast<float>(height));
        }
    }
    return table;
}

Result<HeightTable> read_table(const HeightSource& source, const LatticePoint& corner, int side) {
    HeightTable table;
    table.columns = table.rows = side;
    table.spacing = source.lattice().spacing;
    const SampleGrid grid{corner, 1, side, side};
    std::vector<double> heights(grid.size());
    if (const Result<void> read = source.sample(grid, heights); !read) {
        return tl::unexpected(read.error());
    }
    for (const double height : heights) table.heights.push_back(static_cast<float>(height));
    return table;
}

// Plain loops over every sample of every diamond of every spacing: each level costs two passes over
// the table.
//
// Within a cell the bilinear surface minus a plane has its extremes at the corners, where a
// triangle holds the whole cell. A triangle that cuts a cell does it along the cell's diagonal;
// there the difference is a parabola, and its vertex counts too.

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
