// SPDX-License-Identifier: MIT
//
// The bound of a cell. The raster's own surface is h(p), bilinear between samples at whole numbers of p = (column,
// row). The ground point above the foot f of the ellipsoid, or of the plane, is f + h(p(f)) n(f), with the normal n;
// its x and y are those of the plane, and its z is the height there. Over a cell of the grid let A be the affine map
// from the cell to p that fits the four nodes, off by q at each, and G the greatest slope of h around the cell. With
// overlines for the bilinear interpolation of values at the nodes, E = |h - overline(h)| is at most
//
//     |h(A) - overline(h(A))| + G (2 q + |p - overline(p)|).
//
// The first term is the largest at the corners of the pieces into which the raster's lines cut the cell, plus a term
// for the curvature of each piece, a quadratic function. The deviation of p in the second term has two parts: that of
// the smooth map from the plane, which is at most (|p_xx| + |p_yy|) / 8 for second differences over a cell and is taken
// twice as large; and the shift of the foot by the deviation of h n, at most |n_xy| E and terms with the ellipsoid's
// curvature. So E is on both sides; a slope for which it has no solution overhangs in the plane. The deviation of z
// follows from that of h.
#include "raster/resampled_raster.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane::internal {
namespace {

constexpr double kNoHeight = std::numeric_limits<double>::quiet_NaN();
/// Side of the tiles of the first pass, in cells: whole blocks.
constexpr int kTileSide = 8 * kBlockSide;
/// Place of a node: found when it moves by less than this share of a cell.
constexpr double kConverged = 1e-9;
/// The map is smooth at a node if its second difference is at most this share of its first one.
constexpr double kMostBend = 0.25;
/// Least value of 1 - slope * tan(tilt), by which the deviation of an inclined surface grows.
constexpr double kLeastUpright = 0.1;

/// A window of samples; beyond it the edge is repeated.
struct SampleWindow {
    std::int64_t column = 0, row = 0;
    int columns = 0, rows = 0;
    std::vector<double> samples;

    double at(std::int64_t c, std::int64_t r) const {
        const std::int64_t x = std::clamp<std::int64_t>(c - column, 0, columns - 1);
        const std::int64_t y = std::clamp<std::int64_t>(r - row, 0, rows - 1);
        return samples[static_cast<std::size_t>(y * columns + x)];
    }
    bool contains(const SamplePosition& p) const {
        return p.column >= static_cast<double>(column) && p.row >= static_cast<double>(row) &&
               p.column <= static_cast<double>(column + columns - 1) &&
               p.row <= static_cast<double>(row + rows - 1);
    }
    /// The surface; requires that the window contains the position.
    double height(const SamplePosition& p) const {
        const double west = std::floor(p.column), south = std::floor(p.row);
        const auto c = static_cast<std::int64_t>(west), r = static_cast<std::int64_t>(south);
        const double fx = p.column - west, fy = p.row - south;
        const double at_south = at(c, r) + fx * (at(c + 1, r) - at(c, r));
        const double at_north = at(c, r + 1) + fx * (at(c + 1, r + 1) - at(c, r + 1));
        return at_south + fy * (at_north - at_south);
    }
};

SamplePosition operator+(const SamplePosition& a, const SamplePosition& b) {
    return {a.column + b.column, a.row + b.row};
}
SamplePosition operator-(const SamplePosition& a, const SamplePosition& b) {
    return {a.column - b.column, a.row - b.row};
}
SamplePosition operator*(double factor, const SamplePosition& a) {
    return {factor * a.column, factor * a.row};
}
double length_of(const SamplePosition& a) { return std::hypot(a.column, a.row); }

/// The affine map from a cell of the grid, (0, 0) to (1, 1), to the raster.
struct CellMap {
    SamplePosition corner, by_x, by_y;

    SamplePosition at(double s, double t) const { return corner + (s * by_x + t * by_y); }
};

/// Largest deviation of the raster's surface from the bilinear interpolation of its values at a cell's corners.
double mapped_deviation(const SampleWindow& window, const CellMap& map) {
    const std::array<double, 4> corners = {window.height(map.at(0, 0)), window.height(map.at(1, 0)),
                                           window.height(map.at(0, 1)),
                                           window.height(map.at(1, 1))};
    const double slope_x = corners[1] - corners[0], slope_y = corners[2] - corners[0];
    const double twist = corners[0] - corners[1] - corners[2] + corners[3];
    double most = 0.0;
    const auto add = [&](double s, double t, double height) {
        const double flat = corners[0] + s * slope_x + t * slope_y + s * t * twist;
        most = std::max(most, std::fabs(height - flat));
    };
    const auto [least_column, most_column] = std::minmax(
        {map.at(0, 0).column, map.at(1, 0).column, map.at(0, 1).column, map.at(1, 1).column});
    const auto [least_row, most_row] =
        std::minmax({map.at(0, 0).row, map.at(1, 0).row, map.at(0, 1).row, map.at(1, 1).row});
    const auto first_column = static_cast<std::int64_t>(std::floor(least_column));
    const auto last_column = static_cast<std::int64_t>(std::floor(most_column));
    const auto first_row = static_cast<std::int64_t>(std::floor(least_row));
    const auto last_row = static_cast<std::int64_t>(std::floor(most_row));

    // Where the raster's lines cross the cell's edges; a line runs between samples of equal column, or equal row.
    constexpr double kOver = 1e-9;
    const auto is_in = [](double s) { return s >= -kOver && s <= 1.0 + kOver; };
    const auto cross = [&](double start, double by_x, double by_y, std::int64_t line,
                           auto&& height) {
        const double to_line = static_cast<double>(line) - start;
        for (const double edge : {0.0, 1.0}) {
            const double t = (to_line - edge * by_x) / by_y, s = (to_line - edge * by_y) / by_x;
            if (is_in(t)) add(edge, t, height(map.at(edge, t)));
            if (is_in(s)) add(s, edge, height(map.at(s, edge)));
        }
    };
    for (std::int64_t c = first_column + 1; c <= last_column; ++c) {
        cross(map.corner.column, map.by_x.column, map.by_y.column, c, [&](const SamplePosition& p) {
            return window.height({static_cast<double>(c), p.row});
        });
    }
    for (std::int64_t r = first_row + 1; r <= last_row; ++r) {
        cross(map.corner.row, map.by_x.row, map.by_y.row, r, [&](const SamplePosition& p) {
            return window.height({p.column, static_cast<double>(r)});
        });
    }
    const double area = map.by_x.column * map.by_y.row - map.by_x.row * map.by_y.column;
    double bend = 0.0;
    for (std::int64_t r = first_row; r <= last_row; ++r) {
        for (std::int64_t c = first_column; c <= last_column; ++c) {
            const SamplePosition d =
                SamplePosition{static_cast<double>(c), static_cast<double>(r)} - map.corner;
            const double s = (d.column * map.by_y.row - d.row * map.by_y.column) / area;
            const double t = (d.row * map.by_x.column - d.column * map.by_x.row) / area;
            if (is_in(s) && is_in(t)) add(s, t, window.at(c, r));
            const double of_cell = window.at(c, r) - window.at(c + 1, r) - window.at(c, r + 1) +
                                   window.at(c + 1, r + 1);
            const double mixed =
                of_cell * (map.by_x.column * map.by_y.row + map.by_y.column * map.by_x.row) - twist;
            bend = std::max(bend, 2.0 * std::fabs(of_cell * map.by_x.column * map.by_x.row) +
                                      2.0 * std::fabs(mixed) +
                                      2.0 * std::fabs(of_cell * map.by_y.column * map.by_y.row));
        }
    }
    // A quadratic function with second derivatives a, b (mixed) and c differs from the interpolation of its values at
    // the corners of a polygon within the cell by at most (|a| + 2 |b| + |c|) / 8.
    return most + bend / 8.0;
}

/// Largest slope of the raster's surface around a cell, metres per sample; NaN: the window is too small.
double slope_around(const SampleWindow& window, const CellMap& map, double around) {
    const auto bounds = [around](double a, double by_x, double by_y) {
        const double low = a + std::min(by_x, 0.0) + std::min(by_y, 0.0);
        const double high = a + std::max(by_x, 0.0) + std::max(by_y, 0.0);
        return std::pair{static_cast<std::int64_t>(std::floor(low - around)),
                         static_cast<std::int64_t>(std::floor(high + around)) + 1};
    };
    const auto columns = bounds(map.corner.column, map.by_x.column, map.by_y.column);
    const auto rows = bounds(map.corner.row, map.by_x.row, map.by_y.row);
    if (!window.contains({static_cast<double>(columns.first), static_cast<double>(rows.first)}) ||
        !window.contains({static_cast<double>(columns.second), static_cast<double>(rows.second)})) {
        return kNoHeight;
    }
    double x = 0.0, y = 0.0;
    for (std::int64_t r = rows.first; r <= rows.second; ++r) {
        for (std::int64_t c = columns.first; c <= columns.second; ++c) {
            if (c < columns.second)
                x = std::max(x, std::fabs(window.at(c + 1, r) - window.at(c, r)));
            if (r < rows.second) y = std::max(y, std::fabs(window.at(c, r + 1) - window.at(c, r)));
        }
    }
    return std::hypot(x, y);
}

float round_up(double value) {
    const auto nearest = static_cast<float>(value);
    return static_cast<double>(nearest) < value
               ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
               : nearest;
}

}  // namespace

BlockMaxima::BlockMaxima(int columns, int rows) {
    const auto blocks = [](int cells) {
        return (std::max(cells, 1) + kBlockSide - 1) / kBlockSide;
    };
    Level level{blocks(columns), blocks(rows), {}};
    level.values.resize(static_cast<std::size_t>(level.columns) *
                        static_cast<std::size_t>(level.rows));
    levels_.push_back(std::move(level));
}

void BlockMaxima::raise(int column, int row, float value) {
    Level& level = levels_.front();
    float& block = level.values[static_cast<std::size_t>(row / kBlockSide) *
                                    static_cast<std::size_t>(level.columns) +
                                static_cast<std::size_t>(column / kBlockSide)];
    block = std::max(block, value);
}

void BlockMaxima::finish() {
    while (levels_.back().values.size() > 1) {
        const Level& fine = levels_.back();
        Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
        coarse.values.resize(static_cast<std::size_t>(coarse.columns) *
                             static_cast<std::size_t>(coarse.rows));
        for (int row = 0; row < fine.rows; ++row) {
            for (int column = 0; column < fine.columns; ++column) {
                float& value =
                    coarse.values[static_cast<std::size_t>(row / 2 * coarse.columns + column / 2)];
                value = std::max(
                    value, fine.values[static_cast<std::size_t>(row * fine.columns + column)]);
            }
        }
        levels_.push_back(std::move(coarse));
    }
}

float BlockMaxima::over(std::int64_t west, std::int64_t south, std::int64_t east,
                        std::int64_t north) const {
    if (levels_.empty()) return 0.0f;
    // Blocks at least as wide as the rectangle: it meets at most four.
    const std::int64_t side = std::max(east - west, north - south);
    std::size_t k = 0;
    while (k + 1 < levels_.size() && (std::int64_t{kBlockSide} << k) < side) ++k;
    const Level& level = levels_[k];
    const std::int64_t block = std::int64_t{kBlockSide} << k;
    const auto first = [block](std::int64_t cell) {
        return std::max<std::int64_t>(cell, 0) / block;
    };
    const auto last = [block](std::int64_t cell, int count) {
        return cell < 0 ? -1 : std::min<std::int64_t>(cell / block, count - 1);
    };
    float most = 0.0f;
    for (std::int64_t y = first(south); y <= last(north, level.rows); ++y) {
        for (std::int64_t x = first(west); x <= last(east, level.columns); ++x) {
            most = std::max(most, level.values[static_cast<std::size_t>(y * level.columns + x)]);
        }
    }
    return most;
}

struct ResampledRaster::Node {
    SamplePosition p;       ///< in the raster
    double h = kNoHeight;   ///< there, of the raster, relative to the store's base
    double z = kNoHeight;   ///< in the plane; NaN: nodata
    double lean = 0.0;      ///< horizontal part of the normal
    double upright = 1.0;   ///< vertical part of the normal
    double bend = 0.0;      ///< second differences of the smooth map, along x and y together
    double reach = 0.0;     ///< greatest first difference of the smooth map
    SamplePosition beyond;  ///< how far beyond the raster a node of a cell over its edge can be
};

/// Nodes of a rectangle and the samples around them.
struct ResampledRaster::Tile {
    int columns = 0, rows = 0;
    std::vector<Node> nodes;  ///< [rows * columns]
    SampleWindow window;

    const Node& at(int column, int row) const {
        return nodes[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                     static_cast<std::size_t>(column)];
    }
};

Result<ResampledRaster::Tile> ResampledRaster::make_tile(int column, int row, int columns,
                                                         int rows) const {
    const DemInfo& raster = raster_->info();
    const double base = raster_->base();
    const double highest = std::max(std::fabs(raster.min_m), std::fabs(raster.max_m));
    // The smooth map: the places of nodes at height 0, and of a ring around them.
    const int wide = columns + 2;
    std::vector<SamplePosition> smooth(static_cast<std::size_t>(wide) *
                                       static_cast<std::size_t>(rows + 2));
    double lean = 0.0;
    for (int j = 0; j < rows + 2; ++j) {
        for (int i = 0; i < wide; ++i) {
            const double x = map_->x(column + i - 1), y = map_->y(row + j - 1);
            smooth[static_cast<std::size_t>(j * wide + i)] = map_->at(x, y);
            const TangentPlane::Foot foot = map_->foot(x, y);
            lean = std::max(lean, std::hypot(foot.normal.x(), foot.normal.y()));
        }
    }
    // Twice the shift of a node's foot, and the samples of its cells.
    const auto margin_of = [&](const Node& node) {
        return 3.0 + node.reach * (4.0 + 2.0 * highest * lean / info_.cell_x);
    };
    Tile tile;
    tile.columns = columns;
    tile.rows = rows;
    tile.nodes.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    // The window of the samples that the nodes need, with the shift of their feet.
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    double west = kInfinite, south = kInfinite, east = -kInfinite, north = -kInfinite;
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            const auto at = [&](int di, int dj) {
                return smooth[static_cast<std::size_t>((j + 1 + dj) * wide + i + 1 + di)];
            };
            Node& node = tile.nodes[static_cast<std::size_t>(j * columns + i)];
            node.p = at(0, 0);
            const SamplePosition steps[] = {at(1, 0) - node.p, node.p - at(-1, 0),
                                            at(0, 1) - node.p, node.p - at(0, -1)};
            double least = kInfinite;
            for (const SamplePosition& step : steps) {
                node.reach = std::max(node.reach, length_of(step));
                least = std::min(least, length_of(step));
            }
            const auto most = [](double a, double b) {
                return std::max(std::fabs(a), std::fabs(b));
            };
            node.beyond = {
                1.01 * (most(steps[0].column, steps[1].column) +
                        most(steps[2].column, steps[3].column)),
                1.01 * (most(steps[0].row, steps[1].row) + most(steps[2].row, steps[3].row))};
            node.bend = length_of(steps[0] - steps[1]) + length_of(steps[2] - steps[3]);
            // Comparisons with NaN are false.
            const bool is_smooth = least >= 0.0 && node.bend <= kMostBend * node.reach;
            const double out = 0.5 * margin_of(node);
            const bool is_near = node.p.column >= -0.5 - out && node.p.row >= -0.5 - out &&
                                 node.p.column <= raster.columns - 0.5 + out &&
                                 node.p.row <= raster.rows - 0.5 + out;
            if (!is_smooth || !is_near) {
                node.p = {kNoHeight, kNoHeight};
                continue;
            }
            const double margin = margin_of(node);
            west = std::min(west, node.p.column - margin);
            east = std::max(east, node.p.column + margin);
            south = std::min(south, node.p.row - margin);
            north = std::max(north, node.p.row + margin);
        }
    }
    if (!(west <= east)) return tile;
    SampleWindow& window = tile.window;
    window.column = static_cast<std::int64_t>(std::floor(west));
    window.row = static_cast<std::int64_t>(std::floor(south));
    window.columns = static_cast<int>(std::ceil(east) - std::floor(west)) + 1;
    window.rows = static_cast<int>(std::ceil(north) - std::floor(south)) + 1;
    window.samples.resize(static_cast<std::size_t>(window.columns) *
                          static_cast<std::size_t>(window.rows));
    TERRANE_TRY(
        raster_->read(window.column, window.row, window.columns, window.rows, window.samples));

    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            Node& node = tile.nodes[static_cast<std::size_t>(j * columns + i)];
            if (std::isnan(node.p.column)) continue;
            const double x = map_->x(column + i), y = map_->y(row + j);
            // The foot of the ground point above (x, y), by fixed-point iteration: each round divides the distance by
            // 1 / (slope * tan(tilt)).
            TangentPlane::Foot foot = map_->foot(x, y);
            double foot_x = x, foot_y = y;
            constexpr int kMostRounds = 300;
            bool is_found = false;
            for (int round = 0; round < kMostRounds && window.contains(node.p); ++round) {
                node.h = window.height(node.p);
                const double height = base + node.h;
                const double next_x = x - height * foot.normal.x();
                const double next_y = y - height * foot.normal.y();
                const double moved =
                    std::max(std::fabs(next_x - foot_x), std::fabs(next_y - foot_y));
                if (moved <= kConverged * info_.cell_x) {
                    is_found = true;
                    break;
                }
                foot_x = next_x;
                foot_y = next_y;
                foot = map_->foot(foot_x, foot_y);
                node.p = map_->at(foot_x, foot_y);
            }
            if (!is_found) return overhang(column + i, row + j);
            const double out_x =
                std::max(-0.5 - node.p.column, node.p.column - (raster.columns - 0.5));
            const double out_y = std::max(-0.5 - node.p.row, node.p.row - (raster.rows - 0.5));
            if (out_x > node.beyond.column || out_y > node.beyond.row) continue;
            if (!raster_->is_whole()) {
                const auto sample = [](double at, int count) {
                    return static_cast<int>(std::clamp(at, 0.0, count - 1.0));
                };
                const double c = std::floor(node.p.column), r = std::floor(node.p.row);
                TERRANE_TRY(
                    const auto flags,
                    raster_->flags(sample(c, raster.columns), sample(r, raster.rows),
                                   sample(c + 1.0, raster.columns), sample(r + 1.0, raster.rows)));
                if (flags != 0) continue;
            }
            node.lean = std::hypot(foot.normal.x(), foot.normal.y());
            node.upright = foot.normal.z();
            node.z = foot.z + (base + node.h) * node.upright;
        }
    }
    return tile;
}

tl::unexpected<Error> ResampledRaster::overhang(int column, int row) const {
    return fail(ErrorCode::bad_data, named_raster(path_) + " has slopes at x " +
                                         number_text(map_->x(column)) + ", y " +
                                         number_text(map_->y(row)) +
                                         " m that overhang on the tangent plane (--project local)");
}

double ResampledRaster::cell_error(const Tile& tile, int column, int row) const {
    const Node* nodes[] = {&tile.at(column, row), &tile.at(column + 1, row),
                           &tile.at(column, row + 1), &tile.at(column + 1, row + 1)};
    double low = nodes[0]->h, high = low, lean = 0.0, upright = 1.0, reach = 0.0, bend = 0.0;
    for (const Node* node : nodes) {
        if (std::isnan(node->z)) return 0.0;  // nodata
        low = std::min(low, node->h);
        high = std::max(high, node->h);
        lean = std::max(lean, node->lean);
        upright = std::min(upright, node->upright);
        reach = std::max(reach, node->reach);
        bend = std::max(bend, node->bend);
    }
    const SamplePosition sum = nodes[0]->p + nodes[1]->p + (nodes[2]->p + nodes[3]->p);
    const SamplePosition off = nodes[0]->p - nodes[1]->p - (nodes[2]->p - nodes[3]->p);
    CellMap map;
    map.by_x = 0.5 * ((nodes[1]->p - nodes[0]->p) + (nodes[3]->p - nodes[2]->p));
    map.by_y = 0.5 * ((nodes[2]->p - nodes[0]->p) + (nodes[3]->p - nodes[1]->p));
    map.corner = 0.25 * sum - 0.5 * (map.by_x + map.by_y);
    const double at_nodes = 0.25 * length_of(off);

    // Per metre of the plane. The factors near 1 cover the change of each number within the cell.
    const double samples_per_metre = (reach + 2.0 * bend) / info_.cell_x;
    const double curvature = 1.02 * map_->most_curvature() / (upright * upright * upright);
    const double width = 1.5 * (info_.cell_x + (high - low) * lean);
    const double turn = curvature * width;  // of the normal
    const double highest =
        std::max(std::fabs(raster_->info().min_m), std::fabs(raster_->info().max_m));
    const double of_normals = 0.25 * (high - low) * turn + highest * turn * turn;
    const double of_map = map_->most_curvature() > 0.0 ? PlaneMap::kTableError + kConverged : 0.0;

    const double flat = mapped_deviation(tile.window, map);
    constexpr int kMostTries = 12;
    double around = 1e-9;
    for (int i = 0; i < kMostTries; ++i) {
        const double slope = slope_around(tile.window, map, around);
        if (std::isnan(slope)) break;
        const double tilt = 1.02 * samples_per_metre * lean;
        const double remaining = 1.0 - slope * tilt;
        if (!(remaining >= kLeastUpright)) break;
        const double shift = 0.25 * bend + of_map + samples_per_metre * of_normals;
        const double error =
            (flat + 2.0 * raster_->rounding() + slope * (2.0 * at_nodes + shift)) / remaining;
        // The places whose slopes were needed must be those that were looked at.
        const double strayed = at_nodes + shift + tilt * error;
        if (strayed > around && !map_->is_affine()) {
            around = 2.0 * strayed;
            continue;
        }
        const double in_plane = (map_->most_curvature() > 0.0 ? 1.02 : 1.0) * error / upright;
        return in_plane + of_normals * (1.0 + lean / upright) + curvature * width * width / 6.0;
    }
    return std::numeric_limits<double>::infinity();
}

Result<void> ResampledRaster::read(int column, int row, int columns, int rows,
                                   std::span<double> heights_out) const {
    for (int south = 0; south < rows; south += kTileSide) {
        for (int west = 0; west < columns; west += kTileSide) {
            TERRANE_TRY(const auto tile,
                        make_tile(column + west, row + south, std::min(kTileSide, columns - west),
                                  std::min(kTileSide, rows - south)));
            for (int j = 0; j < tile.rows; ++j) {
                const std::size_t to =
                    static_cast<std::size_t>(south + j) * static_cast<std::size_t>(columns) +
                    static_cast<std::size_t>(west);
                for (int i = 0; i < tile.columns; ++i) {
                    heights_out[to + static_cast<std::size_t>(i)] = tile.at(i, j).z;
                }
            }
        }
    }
    return {};
}

Result<std::shared_ptr<const ResampledRaster>> ResampledRaster::create(
    std::string path, std::shared_ptr<const RasterStore> raster,
    std::shared_ptr<const PlaneMap> map, double progress_end, OpeningProgress& progress) {
    std::shared_ptr<ResampledRaster> made(new ResampledRaster);
    made->path_ = std::move(path);
    made->raster_ = std::move(raster);
    made->map_ = std::move(map);
    DemInfo& info = made->info_;
    info = made->map_->info();
    made->errors_ = BlockMaxima(info.columns - 1, info.rows - 1);
    constexpr HeightInterval kNone{std::numeric_limits<double>::infinity(),
                                   -std::numeric_limits<double>::infinity()};
    made->range_ = kNone;
    std::mutex mutex;
    const int lines = (info.rows + kTileSide - 1) / kTileSide;
    progress.begin(progress_end, lines);
    TERRANE_TRY(in_parallel(lines, [&](int line) -> Result<void> {
        const int south = line * kTileSide;
        HeightInterval range = kNone;
        for (int west = 0; west < info.columns; west += kTileSide) {
            // One more node to the east and to the north, for the cells.
            const int columns = std::min(kTileSide + 1, info.columns - west);
            const int rows = std::min(kTileSide + 1, info.rows - south);
            TERRANE_TRY(const auto tile, made->make_tile(west, south, columns, rows));
            for (const Node& node : tile.nodes) {
                if (std::isnan(node.z)) continue;
                range.low = std::min(range.low, node.z);
                range.high = std::max(range.high, node.z);
            }
            for (int j = 0; j + 1 < rows; ++j) {
                for (int i = 0; i + 1 < columns; ++i) {
                    const double error = made->cell_error(tile, i, j);
                    if (!std::isfinite(error)) return made->overhang(west + i, south + j);
                    made->errors_.raise(west + i, south + j, round_up(error));
                }
            }
        }
        {
            const std::lock_guard lock(mutex);
            made->range_.low = std::min(made->range_.low, range.low);
            made->range_.high = std::max(made->range_.high, range.high);
        }
        return progress.step();
    }));
    if (made->range_.low > made->range_.high) {
        return fail(ErrorCode::bad_data,
                    named_raster(made->path_) + " has no height at a sample of the plane");
    }
    made->errors_.finish();
    info.resampling_error = static_cast<double>(made->errors_.all());
    std::string& placement = info.placement;
    placement += info.projection == DemProjection::local ? ", resampled onto the tangent plane"
                                                         : ", resampled";
    placement += " to cells of " + number_text(info.cell_x) + " m, within " +
                 number_text(info.resampling_error) + " m";
    return std::shared_ptr<const ResampledRaster>(std::move(made));
}

}  // namespace terrane::internal
