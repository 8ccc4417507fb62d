// SPDX-License-Identifier: MIT
#include "source/detail/amplitude_field.h"

#include "source/bounds/mesh_bounds.h"
#include "source/bounds/rounding.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace terrane {

AmplitudeField::AmplitudeField(const DetailField& field)
    : origin_x_(field.node_origin_x),
      origin_y_(field.node_origin_y),
      spacing_x_(field.node_spacing_x),
      spacing_y_(field.node_spacing_y),
      columns_(field.columns),
      rows_(field.rows),
      nodes_(field.amplitude) {
    Level cells{std::max(columns_ - 1, 1), std::max(rows_ - 1, 1), {}};
    for (int row = 0; row < cells.rows; ++row) {
        for (int column = 0; column < cells.columns; ++column) {
            cells.blocks.push_back(make_cell(column, row));
        }
    }
    levels_.push_back(std::move(cells));
    while (levels_.back().blocks.size() > 1) {
        const Level& fine = levels_.back();
        Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
        coarse.blocks.resize(static_cast<std::size_t>(coarse.columns) *
                             static_cast<std::size_t>(coarse.rows));
        for (int row = 0; row < fine.rows; ++row) {
            for (int column = 0; column < fine.columns; ++column) {
                coarse
                    .blocks[static_cast<std::size_t>(row / 2) *
                                static_cast<std::size_t>(coarse.columns) +
                            static_cast<std::size_t>(column / 2)]
                    .include(fine.blocks[static_cast<std::size_t>(row) *
                                             static_cast<std::size_t>(fine.columns) +
                                         static_cast<std::size_t>(column)]);
            }
        }
        levels_.push_back(std::move(coarse));
    }
}

double AmplitudeField::amplitude(const Place& x, const Place& y) const {
    const double south_west = node(x.low, y.low), south_east = node(x.high, y.low);
    const double north_west = node(x.low, y.high), north_east = node(x.high, y.high);
    const double south = south_west + x.fraction * (south_east - south_west);
    const double north = north_west + x.fraction * (north_east - north_west);
    return south + y.fraction * (north - south);
}

AmplitudeBounds AmplitudeField::over(const WorldRect& rect) const {
    const Stretch x = stretch(place_x(rect.west), place_x(rect.east), levels_[0].columns);
    const Stretch y = stretch(place_y(rect.south), place_y(rect.north), levels_[0].rows);
    // A larger rectangle takes the same or a coarser level, whose blocks are unions of these: what
    // it covers contains what this one covers.
    const int longest = std::max(x.last - x.first, y.last - y.first);
    std::size_t level = 0;
    while ((longest >> level) > 3) ++level;
    const Level& blocks = levels_[level];
    Block most;
    for (int row = y.first >> level; row <= y.last >> level; ++row) {
        for (int column = x.first >> level; column <= x.last >> level; ++column) {
            most.include(blocks.blocks[static_cast<std::size_t>(row) *
                                           static_cast<std::size_t>(blocks.columns) +
                                       static_cast<std::size_t>(column)]);
        }
    }
    const double slope_x = most.slope_x, slope_y = most.slope_y;
    return {most.most, std::sqrt(slope_x * slope_x + slope_y * slope_y) * (1.0 + 0x1p-40)};
}

AmplitudeBounds AmplitudeField::everywhere() const {
    const Block& all = levels_.back().blocks.front();
    const double slope_x = all.slope_x, slope_y = all.slope_y;
    return {all.most, std::sqrt(slope_x * slope_x + slope_y * slope_y) * (1.0 + 0x1p-40)};
}

void AmplitudeField::Block::include(const Block& other) {
    most = std::max(most, other.most);
    slope_x = std::max(slope_x, other.slope_x);
    slope_y = std::max(slope_y, other.slope_y);
}

AmplitudeField::Place AmplitudeField::place(double coordinate, double origin, double spacing,
                                            int nodes) {
    const double position = (coordinate - origin) / spacing;
    if (!(position > 0.0)) return {0, 0, 0.0};
    if (position >= nodes - 1) return {nodes - 1, nodes - 1, 0.0};
    const double low = std::floor(position);
    return {static_cast<int>(low), static_cast<int>(low) + 1, position - low};
}

AmplitudeField::Stretch AmplitudeField::stretch(const Place& from, const Place& to, int cells) {
    return {std::min(from.low, cells - 1), std::min(to.low, cells - 1)};
}

double AmplitudeField::node(int column, int row) const {
    return static_cast<double>(
        nodes_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column)]);
}

AmplitudeField::Block AmplitudeField::make_cell(int column, int row) const {
    const int east = std::min(column + 1, columns_ - 1), north = std::min(row + 1, rows_ - 1);
    const double a00 = node(column, row), a10 = node(east, row);
    const double a01 = node(column, north), a11 = node(east, north);
    // a bilinear cell's slope along an axis lies between those of its two sides
    const double rise_x = std::max(std::abs(a10 - a00), std::abs(a11 - a01));
    const double rise_y = std::max(std::abs(a01 - a00), std::abs(a11 - a10));
    return {round_up(std::max({a00, a10, a01, a11})), round_up(rise_x / spacing_x_ * kOutward),
            round_up(rise_y / spacing_y_ * kOutward)};
}

}  // namespace terrane
