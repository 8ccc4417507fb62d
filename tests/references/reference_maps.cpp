// SPDX-License-Identifier: MIT
#include "reference_maps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
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

}  // namespace terrane::test
