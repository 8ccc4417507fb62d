// SPDX-License-Identifier: MIT
#include "bounds/level_bounds.h"

#include "raster/cancellable_work.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>

namespace terrane::internal {
namespace {

/// The least and the greatest ratio of the first tier's step to the base spacing: powers of two.
constexpr int kRatio = 8, kMaxRatio = 64;

/// Number of tiles along an edge of nodes or points.
int tiles_along(int count) { return (count + kTileSide - 1) / kTileSide; }

double base_points(const BilinearGrid& grid) {
    const double base = grid.base_spacing();
    return (grid.columns * grid.cell_x / base) * (grid.rows * grid.cell_y / base);
}

/// Ratio of the first tier's step to the base spacing, chosen for at most about 2^22 points.
int first_ratio(const BilinearGrid& grid) {
    constexpr double kMostPoints = 0x1p22;
    int ratio = kRatio;
    while (ratio < kMaxRatio && base_points(grid) > kMostPoints * ratio * ratio) ratio *= 2;
    return ratio;
}

}  // namespace

std::optional<std::size_t> BoundTiers::find(std::int64_t step) const {
    for (std::size_t level = 0; level < tiers_.size(); ++level) {
        if (tiers_[level].step == step) return level;
    }
    return std::nullopt;
}

BoundTier BoundTiers::make_extent(std::int64_t step) const {
    const BilinearGrid& grid = fine_->grid();
    BoundTier tier(memory_);
    tier.step = step;
    // The rectangle of lattice points that contains all samples, with a margin.
    const double spacing = grid.lattice.spacing * static_cast<double>(step);
    const auto index_below = [&](double from_origin) {
        return static_cast<std::int64_t>(std::floor(from_origin / spacing));
    };
    const double east = grid.west + (grid.columns - 1) * grid.cell_x;
    const double north = grid.south + (grid.rows - 1) * grid.cell_y;
    tier.first_x = index_below(grid.west - grid.lattice.origin_x) - kBeyondRaster;
    tier.first_y = index_below(grid.south - grid.lattice.origin_y) - kBeyondRaster;
    tier.columns = static_cast<int>(index_below(east - grid.lattice.origin_x) + 1 + kBeyondRaster -
                                    tier.first_x + 1);
    tier.rows = static_cast<int>(index_below(north - grid.lattice.origin_y) + 1 + kBeyondRaster -
                                 tier.first_y + 1);
    return tier;
}

void BoundTiers::add_extents() {
    // The coarsest tier's cells are root squares; vertices with a spacing of half their side are in the tier before it.
    const std::int64_t coarsest = fine_->grid().lattice.chunk_side(0);
    while (tiers_.back().step < coarsest) tiers_.push_back(make_extent(2 * tiers_.back().step));
}

void BoundTiers::resize(BoundTier& tier) const {
    const std::size_t size =
        static_cast<std::size_t>(tier.columns) * static_cast<std::size_t>(tier.rows);
    tier.bounds.resize(size);
    tier.cell_bounds.resize(size);
    if (has_cell_flags_) tier.cell_flags.resize(size);
    if (tier.step != first_step()) return;
    tier.heights.resize(size);
    tier.cell_low.resize(size);
    tier.cell_high.resize(size);
}

Result<void> BoundTiers::fill_square(int ratio, int x, int y, int side, BoundTier& tier) const {
    const int columns = std::min(side, tier.columns - x), rows = std::min(side, tier.rows - y);
    const int apron = 3 * ratio;
    const std::int64_t west = (tier.first_x + x) * ratio, south = (tier.first_y + y) * ratio;
    const std::int64_t step = fine_->grid().base_step();
    TERRANE_TRY(auto made, fine_->bounds_window({{(west - apron) * step, (south - apron) * step},
                                                 step,
                                                 (columns - 1) * ratio + 2 * apron + 1,
                                                 (rows - 1) * ratio + 2 * apron + 1}));
    DiamondWindow& window = made;
    compute_bounds(window, ratio);
    DeviationRows deviations(window);
    for (int j = 0; j < rows; ++j) {
        const int wy = apron + j * ratio;
        const std::size_t first =
            static_cast<std::size_t>(y + j) * static_cast<std::size_t>(tier.columns) +
            static_cast<std::size_t>(x);
        // As in compute_bounds(), a cell repeats its neighbour over equal rows or columns.
        const bool repeats_row = j > 0 && window.has_equal_rows(wy - ratio, wy + ratio);
        if (!repeats_row) {
            deviations.squares(
                apron, wy, ratio,
                std::span(tier.cell_bounds).subspan(first, static_cast<std::size_t>(columns)));
        }
        for (int i = 0; i < columns; ++i) {
            const int wx = apron + i * ratio;
            const std::size_t at = first + static_cast<std::size_t>(i);
            tier.heights[at] = window.heights[window.at(wx, wy)];
            tier.bounds[at] = window.bounds[window.at(wx, wy)];
            std::optional<std::size_t> equal;
            if (repeats_row) {
                equal = at - static_cast<std::size_t>(tier.columns);
                tier.cell_bounds[at] = tier.cell_bounds[*equal];
            } else if (i > 0 && window.has_equal_columns(wx - ratio, wx + ratio)) {
                equal = at - 1;
            }
            if (equal) {
                tier.cell_low[at] = tier.cell_low[*equal];
                tier.cell_high[at] = tier.cell_high[*equal];
                continue;
            }
            const HeightInterval between = bilinear_deviation(window, wx, wy, ratio);
            tier.cell_low[at] = -round_outward(-between.low);
            tier.cell_high[at] = round_outward(between.high);
        }
    }
    return {};
}

Result<void> BoundTiers::make_first(int ratio, OpeningProgress& progress) {
    BoundTier& tier = tiers_.emplace_back(make_extent(fine_->grid().base_step() * ratio));
    resize(tier);
    constexpr int kWindowSide = 512;
    const int side = std::max(8, kWindowSide / ratio);
    // Squares write disjoint entries, so the tier does not depend on the number of threads.
    const int across = (tier.columns + side - 1) / side;
    const int count = across * ((tier.rows + side - 1) / side);
    progress.begin(0.85, count);
    TERRANE_TRY(in_parallel(count, [&](int i) -> Result<void> {
        auto filled = fill_square(ratio, i % across * side, i / across * side, side, tier);
        return filled ? progress.step() : filled;
    }));
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < tier.heights.size(); ++i) {
        low = std::min(low, tier.heights[i]);
        high = std::max(high, tier.heights[i]);
    }
    // Adds the bound of the surface's distance from the interpolant of a cell's corners.
    low += static_cast<double>(*std::ranges::min_element(tier.cell_low));
    high += static_cast<double>(*std::ranges::max_element(tier.cell_high));
    largest_ = round_outward(high - low);
    return {};
}

Result<void> BoundTiers::make_coarser(OpeningProgress& progress) {
    add_extents();
    const std::span<BoundTier> coarser = std::span(tiers_).subspan(1);
    for (BoundTier& tier : coarser) resize(tier);
    TERRANE_TRY(const auto visits, find_deviations(*fine_, first(), coarser, progress));
    tile_visits_ = visits;
    for (std::size_t level = 1; level < tiers_.size(); ++level) nest(level);
    return {};
}

/// Computes the bounds of a tier's vertices from the deviations of its midpoints and cells.
void BoundTiers::nest(std::size_t level) {
    BoundTier& tier = tiers_[level];
    if (level + 1 == tiers_.size()) {
        // The deviations around the coarsest tier's vertices are neither computed nor needed.
        std::ranges::fill(tier.bounds, largest_);
        return;
    }
    const BoundTier& finer = tiers_[level - 1];
    const BoundTier& coarser = tiers_[level + 1];
    const auto for_each_vertex = [&tier](bool centres, auto&& visit) {
        for (std::int64_t y = tier.first_y; y < tier.first_y + tier.rows; ++y) {
            for (std::int64_t x = tier.first_x; x < tier.first_x + tier.columns; ++x) {
                const bool is_centre = (x & y & 1) != 0, is_vertex = ((x | y) & 1) != 0;
                if (is_vertex && is_centre == centres) visit(x, y, tier.bounds[tier.at(x, y)]);
            }
        }
    };
    const auto largest = [](const BoundTier& of, std::int64_t x, std::int64_t y, int dx, int dy) {
        return std::max(of.bounds[of.at(x + dx, y + dy)], of.bounds[of.at(x - dx, y - dy)]);
    };
    for_each_vertex(false, [&](std::int64_t x, std::int64_t y, float& bound) {
        bound = std::max(bound, std::max(largest(finer, 2 * x, 2 * y, 1, 1),
                                         largest(finer, 2 * x, 2 * y, 1, -1)));
    });
    for_each_vertex(true, [&](std::int64_t x, std::int64_t y, float& bound) {
        const float own = coarser.cell_bounds[coarser.at(x >> 1, y >> 1)];
        bound = std::max(own, std::max(largest(tier, x, y, 1, 0), largest(tier, x, y, 0, 1)));
    });
}

double BoundTiers::first_points(const BilinearGrid& grid) {
    const double ratio = first_ratio(grid), spacing = ratio * grid.base_spacing();
    constexpr double kAround = 2.0 * kBeyondRaster + 3.0;
    return (grid.columns * grid.cell_x / spacing + kAround) *
           (grid.rows * grid.cell_y / spacing + kAround);
}

Result<std::unique_ptr<BoundTiers>> BoundTiers::create(std::shared_ptr<const FineSurface> fine,
                                                       OpeningProgress& progress,
                                                       std::pmr::memory_resource* memory) {
    std::unique_ptr<BoundTiers> tiers(new BoundTiers(std::move(fine), memory));
    const int ratio = first_ratio(tiers->fine_->grid());
    TERRANE_TRY(tiers->make_first(ratio, progress));
    TERRANE_TRY(tiers->make_coarser(progress));
    return tiers;
}

bool BoundTiers::has_heights(const SampleGrid& grid) const {
    const std::int64_t step = first().step;
    return grid.step >= step && grid.corner.x % step == 0 && grid.corner.y % step == 0;
}

template <typename Value>
Result<void> BoundTiers::get(std::size_t level, std::pmr::vector<Value> BoundTier::*values,
                             const Points& points, std::span<Value> values_out) const {
    const BoundTier& tier = tiers_[level];
    std::shared_ptr<const BoundTier> values_of;
    int at_tile = -1;
    std::size_t at = 0;
    for (int j = 0; j < points.rows; ++j) {
        const int row = tier.stored_row(points.y + j * points.stride);
        for (int i = 0; i < points.columns; ++i) {
            const int column = tier.stored_column(points.x + i * points.stride);
            if (!tiles_) {
                values_out[at++] = (tier.*values)[static_cast<std::size_t>(row) *
                                                      static_cast<std::size_t>(tier.columns) +
                                                  static_cast<std::size_t>(column)];
                continue;
            }
            const int tile = row / kTileSide * tiles_along(tier.columns) + column / kTileSide;
            if (tile != at_tile) {
                at_tile = tile;
                TERRANE_TRY(values_of, tiles_->get(tile, static_cast<int>(level)));
            }
            const int in_tile = row % kTileSide * values_of->columns + column % kTileSide;
            values_out[at++] = ((*values_of).*values)[static_cast<std::size_t>(in_tile)];
        }
    }
    return {};
}

Result<void> BoundTiers::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    const std::int64_t step = first_step();
    return get(
        0, &BoundTier::heights,
        {grid.corner.x / step, grid.corner.y / step, grid.step / step, grid.columns, grid.rows},
        heights_out);
}

Result<void> BoundTiers::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const std::int64_t x = grid.corner.x / grid.step, y = grid.corner.y / grid.step;
    if (const auto level = find(grid.step)) {
        TERRANE_TRY(
            get(*level, &BoundTier::bounds, {x, y, 1, grid.columns, grid.rows}, bounds_out));
    } else {
        std::ranges::fill(bounds_out.first(grid.size()), largest_);
    }
    // Points of even column and row are vertices of a coarser spacing.
    for (int row = static_cast<int>(y & 1); row < grid.rows; row += 2) {
        for (int column = static_cast<int>(x & 1); column < grid.columns; column += 2) {
            bounds_out[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                       static_cast<std::size_t>(column)] = 0.0f;
        }
    }
    return {};
}

Result<void> BoundTiers::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const int columns = grid.columns - 1, rows = grid.rows - 1;
    if (const auto level = find(grid.step)) {
        return get(*level, &BoundTier::cell_bounds,
                   {grid.corner.x / grid.step, grid.corner.y / grid.step, 1, columns, rows},
                   bounds_out);
    }
    std::ranges::fill(
        bounds_out.first(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)),
        largest_);
    return {};
}

Result<void> BoundTiers::add_cell_flags(
    const std::function<Result<void>(const SampleGrid& grid, std::span<std::uint8_t> flags_out)>&
        get_flags) {
    has_cell_flags_ = true;
    for (BoundTier& tier : tiers_) {
        resize(tier);
        const SampleGrid grid{{tier.first_x * tier.step, tier.first_y * tier.step},
                              tier.step,
                              tier.columns + 1,
                              tier.rows + 1};
        TERRANE_TRY(get_flags(grid, tier.cell_flags));
    }
    return {};
}

Result<void> BoundTiers::cell_flags(const SampleGrid& grid,
                                    std::span<std::uint8_t> flags_out) const {
    TERRANE_ASSERT(has_cell_flags(grid.step), "cells of this size have no flags");
    return get(
        *find(grid.step), &BoundTier::cell_flags,
        {grid.corner.x / grid.step, grid.corner.y / grid.step, 1, grid.columns - 1, grid.rows - 1},
        flags_out);
}

namespace {

constexpr HeightInterval kNothing{std::numeric_limits<double>::infinity(),
                                  -std::numeric_limits<double>::infinity()};

void add(HeightInterval& range, const HeightInterval& other) {
    range.low = std::min(range.low, other.low);
    range.high = std::max(range.high, other.high);
}

/// Margin for the rounding of interpolation and distances.
constexpr double kHeightRounding = 1e-9;

}  // namespace

Result<HeightPyramid> HeightPyramid::create(const BilinearGrid& grid, const RasterStore& store,
                                            OpeningProgress& progress) {
    HeightPyramid pyramid;
    pyramid.grid_ = grid;
    TERRANE_TRY(pyramid.add_samples(store, progress));
    pyramid.add_levels();
    return pyramid;
}

HeightPyramid::Level HeightPyramid::first_level(const BilinearGrid& grid,
                                                std::pmr::memory_resource* memory) {
    Level level{.nodes = Nodes(memory)};
    level.columns = std::max((grid.columns - 1 + kBlockSide - 1) / kBlockSide, 1);
    level.rows = std::max((grid.rows - 1 + kBlockSide - 1) / kBlockSide, 1);
    return level;
}

HeightPyramid::Level HeightPyramid::next_level(const Level& fine) {
    Level level{.nodes = Nodes(fine.nodes.get_allocator())};
    level.columns = (fine.columns + 1) / 2;
    level.rows = (fine.rows + 1) / 2;
    return level;
}

Result<void> HeightPyramid::add_samples(const RasterStore& store, OpeningProgress& progress) {
    Level level = first_level(grid_, store.memory());
    level.nodes.assign(
        static_cast<std::size_t>(level.columns) * static_cast<std::size_t>(level.rows), kNothing);
    const int width = grid_.columns;
    std::vector<double> strip(static_cast<std::size_t>(width) * (kBlockSide + 1));
    double steepest = 0.0;
    progress.begin(0.6, level.rows);
    for (int by = 0; by < level.rows; ++by) {
        TERRANE_TRY(progress.step());
        const int south = by * kBlockSide;
        const int rows = std::min(kBlockSide + 1, grid_.rows - south);
        TERRANE_TRY(store.read(0, south, width, rows, strip));
        HeightInterval* nodes =
            level.nodes.data() + static_cast<std::ptrdiff_t>(by) * level.columns;
        for (int row = 0; row < rows; ++row) {
            const double* line = strip.data() + static_cast<std::ptrdiff_t>(row) * width;
            for (int bx = 0; bx < level.columns; ++bx) {
                const int begin = bx * kBlockSide;
                const int end = std::min(begin + kBlockSide, width - 1);
                for (int column = begin; column <= end; ++column) {
                    add(nodes[bx], {line[column], line[column]});
                }
            }
            if (row + 1 == rows) break;
            const double* next = line + width;
            for (int column = 0; column + 1 < width; ++column) {
                const double rise_x = std::max(std::fabs(line[column + 1] - line[column]),
                                               std::fabs(next[column + 1] - next[column]));
                const double rise_y = std::max(std::fabs(next[column] - line[column]),
                                               std::fabs(next[column + 1] - line[column + 1]));
                const double x = rise_x / grid_.cell_x, y = rise_y / grid_.cell_y;
                steepest = std::max(steepest, x * x + y * y);
            }
        }
    }
    // Covers the rounding of differences, squares and root.
    slope_ = std::sqrt(steepest) * (1.0 + 1e-6);
    levels_.push_back(std::move(level));
    return {};
}

void HeightPyramid::add_levels() {
    while (levels_.back().columns > 1 || levels_.back().rows > 1) {
        const Level& fine = levels_.back();
        Level coarse = next_level(fine);
        coarse.nodes.assign(
            static_cast<std::size_t>(coarse.columns) * static_cast<std::size_t>(coarse.rows),
            kNothing);
        std::size_t at = 0;
        for (int y = 0; y < fine.rows; ++y) {
            for (int x = 0; x < fine.columns; ++x) {
                add(coarse.nodes[static_cast<std::size_t>(y / 2) *
                                     static_cast<std::size_t>(coarse.columns) +
                                 static_cast<std::size_t>(x / 2)],
                    fine.nodes[at++]);
            }
        }
        levels_.push_back(std::move(coarse));
    }
    for (Level& level : levels_) {
        for (int y = 0; y < std::max(level.rows - 1, 1); ++y) {
            for (int x = 0; x < std::max(level.columns - 1, 1); ++x) {
                HeightInterval range = kNothing;
                for (int j = y; j < std::min(y + 2, level.rows); ++j) {
                    for (int i = x; i < std::min(x + 2, level.columns); ++i) {
                        add(range, level.nodes[static_cast<std::size_t>(j) *
                                                   static_cast<std::size_t>(level.columns) +
                                               static_cast<std::size_t>(i)]);
                    }
                }
                level.rise = std::max(level.rise, range.high - range.low);
            }
        }
    }
}

HeightInterval HeightPyramid::interval(const WorldRect& rect) const {
    // Cells that the closed rectangle touches.
    const auto cell = [](double u, int count) {
        return static_cast<int>(std::clamp(u, 0.0, static_cast<double>(std::max(count - 2, 0))));
    };
    const double margin = 1e-9;
    const int west =
        cell(std::floor((rect.west - grid_.west) / grid_.cell_x - margin), grid_.columns);
    const int east =
        cell(std::floor((rect.east - grid_.west) / grid_.cell_x + margin), grid_.columns);
    const int south =
        cell(std::floor((rect.south - grid_.south) / grid_.cell_y - margin), grid_.rows);
    const int north =
        cell(std::floor((rect.north - grid_.south) / grid_.cell_y + margin), grid_.rows);

    // The finest level on which the rectangle covers at most 8 x 8 nodes.
    std::size_t k = 0;
    int side = kBlockSide;
    while (k + 1 < levels_.size() &&
           (east / side - west / side >= 8 || north / side - south / side >= 8)) {
        ++k;
        side *= 2;
    }
    const Result<HeightInterval> range =
        range_of(k, west / side, south / side, east / side, north / side);
    if (!range) {
        constexpr double kInfinite = std::numeric_limits<double>::infinity();
        return {-kInfinite, kInfinite};
    }
    return {range->low - kHeightRounding, range->high + kHeightRounding};
}

Result<HeightInterval> HeightPyramid::range_of(std::size_t k, int west, int south, int east,
                                               int north) const {
    const Level& level = levels_[k];
    HeightInterval range = kNothing;
    if (!level.nodes.empty()) {
        for (int y = south; y <= north; ++y) {
            for (int x = west; x <= east; ++x) add(range, level.nodes[level.at(x, y)]);
        }
        return range;
    }
    for (int tile_y = south / kTileSide; tile_y <= north / kTileSide; ++tile_y) {
        for (int tile_x = west / kTileSide; tile_x <= east / kTileSide; ++tile_x) {
            TERRANE_TRY(const auto tile, tiles_->get(tile_y * tiles_along(level.columns) + tile_x,
                                                     static_cast<int>(k)));
            const int last_x = std::min(east - tile_x * kTileSide, kTileSide - 1);
            const int last_y = std::min(north - tile_y * kTileSide, kTileSide - 1);
            for (int y = std::max(south - tile_y * kTileSide, 0); y <= last_y; ++y) {
                for (int x = std::max(west - tile_x * kTileSide, 0); x <= last_x; ++x) {
                    add(range, (*tile)[static_cast<std::size_t>(y * kTileSide + x)]);
                }
            }
        }
    }
    return range;
}

double HeightPyramid::rise_bound(double distance) const {
    const double reach = std::max(distance, 0.0);
    double rise = levels_.back().nodes.front().high - levels_.back().nodes.front().low;
    // Two points at most a node's side apart lie in 2 x 2 adjacent nodes.
    double side = std::min(grid_.cell_x, grid_.cell_y) * kBlockSide;
    for (const Level& level : levels_) {
        if (reach <= side) {
            rise = std::min(rise, level.rise);
            break;
        }
        side *= 2.0;
    }
    return std::min(rise, slope_ * reach * (1.0 + 1e-9)) + kHeightRounding;
}

// Serialisation of the bounds of an opening. Sizes follow from the grid and are not written, so no file can contain
// wrong sizes.

namespace {

template <typename T>
std::span<const T> all_of(const std::pmr::vector<T>& values) {
    return values;
}

void put_nodes(std::span<const HeightInterval> nodes, ByteWriter& out) {
    for (const HeightInterval& node : nodes) {
        out.put(node.low);
        out.put(node.high);
    }
}

std::pmr::vector<HeightInterval> get_nodes(int columns, int rows, ByteReader& in) {
    std::pmr::vector<HeightInterval> nodes(static_cast<std::size_t>(columns) *
                                           static_cast<std::size_t>(rows));
    for (HeightInterval& node : nodes) {
        node.low = in.get<double>();
        node.high = in.get<double>();
    }
    return nodes;
}

tl::unexpected<Error> other_size() {
    return fail(ErrorCode::bad_data, "kept bounds are not of this raster's size");
}

int tile_count(int columns, int rows) { return tiles_along(columns) * tiles_along(rows); }

/// Reads the records of tiles, which are the entries of a table, level after level, row by row.
///
/// @param first_tiles entry of the first tile of each level, and the number of all tiles
/// @param decode      Result<Tile>(int tile, int level, ByteReader& content); tiles are counted in each level
template <typename Tile, typename Decode>
std::shared_ptr<const TileCache<Tile>> make_tiles(std::size_t most_tiles,
                                                  const std::vector<std::size_t>& first_tiles,
                                                  std::shared_ptr<const SealedReader> file,
                                                  ByteReader& directory, const Decode& decode) {
    const auto records =
        std::make_shared<const SealedTable<SealedRecord>>(first_tiles.back(), file, directory);
    const auto load = [first_tiles, file = std::move(file), records, decode](
                          int tile, int level) -> Result<std::shared_ptr<const Tile>> {
        TERRANE_TRY(const auto record, records->get(first_tiles[static_cast<std::size_t>(level)] +
                                                    static_cast<std::size_t>(tile)));
        TERRANE_TRY(const auto bytes, record.read(*file));
        ByteReader in(bytes);
        TERRANE_TRY(auto decoded, decode(tile, level, in));
        if (!in.is_done()) return other_size();
        return std::make_shared<const Tile>(std::move(decoded));
    };
    return std::make_shared<const TileCache<Tile>>(most_tiles, load);
}

}  // namespace

void HeightPyramid::write(ByteWriter& out) const {
    out.put(slope_);
    for (const Level& level : levels_) {
        out.put(level.rise);
        put_nodes(level.nodes, out);
    }
}

Result<HeightPyramid> HeightPyramid::read(const BilinearGrid& grid, ByteReader& in) {
    HeightPyramid pyramid;
    pyramid.grid_ = grid;
    pyramid.slope_ = in.get<double>();
    Level level = first_level(grid);
    for (;;) {
        level.rise = in.get<double>();
        level.nodes = get_nodes(level.columns, level.rows, in);
        const bool is_last = level.columns == 1 && level.rows == 1;
        pyramid.levels_.push_back(level);
        if (is_last || in.has_failed()) break;
        level = next_level(level);
    }
    if (in.has_failed()) return other_size();
    return pyramid;
}

Result<void> HeightPyramid::write_tiles(SealedWriter& file, ByteWriter& directory) const {
    SealedTableWriter<SealedRecord> records;
    directory.put(slope_);
    for (const Level& level : levels_) {
        directory.put(level.rise);
        if (level.is_one_tile()) {
            put_nodes(level.nodes, directory);
            continue;
        }
        for (int tile_y = 0; tile_y < tiles_along(level.rows); ++tile_y) {
            for (int tile_x = 0; tile_x < tiles_along(level.columns); ++tile_x) {
                ByteWriter content;
                for (int y = 0; y < kTileSide; ++y) {
                    for (int x = 0; x < kTileSide; ++x) {
                        const int column = tile_x * kTileSide + x, row = tile_y * kTileSide + y;
                        const bool is_inside = column < level.columns && row < level.rows;
                        const HeightInterval node =
                            is_inside ? level.nodes[level.at(column, row)] : kNothing;
                        content.put(node.low);
                        content.put(node.high);
                    }
                }
                TERRANE_TRY(const auto record, SealedRecord::append(file, content.bytes()));
                TERRANE_TRY(records.add(record, file));
            }
        }
    }
    return records.finish(file, directory);
}

Result<HeightPyramid> HeightPyramid::read_tiles(const BilinearGrid& grid,
                                                std::shared_ptr<const SealedReader> file,
                                                ByteReader& directory) {
    constexpr std::size_t kMostTiles = 512;  // kept in memory: 32 MB
    HeightPyramid pyramid;
    pyramid.grid_ = grid;
    pyramid.slope_ = directory.get<double>();
    std::vector<std::size_t> first_tiles{0};
    Level level = first_level(grid);
    for (;;) {
        level.rise = directory.get<double>();
        int tiles = 0;
        if (level.is_one_tile()) {
            level.nodes = get_nodes(level.columns, level.rows, directory);
        } else {
            tiles = tile_count(level.columns, level.rows);
        }
        first_tiles.push_back(first_tiles.back() + static_cast<std::size_t>(tiles));
        const bool is_last = level.columns == 1 && level.rows == 1;
        pyramid.levels_.push_back(level);
        if (is_last || directory.has_failed()) break;
        level = next_level(level);
    }
    pyramid.tiles_ = make_tiles<Nodes>(kMostTiles, first_tiles, std::move(file), directory,
                                       [](int, int, ByteReader& in) -> Result<Nodes> {
                                           return get_nodes(kTileSide, kTileSide, in);
                                       });
    if (directory.has_failed()) return other_size();
    return pyramid;
}

namespace {

/// Calls visit with each array of a tier, in the order in which files have them.
template <typename Tier, typename Visit>
void for_each_array(Tier& tier, Visit&& visit) {
    visit(tier.heights);
    visit(tier.cell_low);
    visit(tier.cell_high);
    visit(tier.bounds);
    visit(tier.cell_bounds);
    visit(tier.cell_flags);
}

void get_arrays(ByteReader& in, BoundTier& tier) {
    for_each_array(tier, [&in](auto& values) { in.get_each(std::span(values)); });
}

}  // namespace

Result<std::unique_ptr<BoundTiers>> BoundTiers::read_extents(
    std::shared_ptr<const FineSurface> fine, ByteReader& in) {
    std::unique_ptr<BoundTiers> tiers(new BoundTiers(std::move(fine)));
    const std::int64_t base_step = tiers->fine_->grid().base_step();
    const auto step = in.get<std::int64_t>();
    const std::int64_t ratio = step / base_step;
    const bool is_possible = ratio >= kRatio && ratio <= kMaxRatio && (ratio & (ratio - 1)) == 0;
    if (!is_possible || step != ratio * base_step) return other_size();
    tiers->largest_ = in.get<float>();
    tiers->tiers_.push_back(tiers->make_extent(step));
    tiers->add_extents();
    return tiers;
}

void BoundTiers::write(ByteWriter& out) const {
    out.put(first_step());
    out.put(largest_);
    for (const BoundTier& tier : tiers_) {
        for_each_array(tier, [&out](const auto& values) { out.put_each(all_of(values)); });
    }
}

Result<std::unique_ptr<BoundTiers>> BoundTiers::read(std::shared_ptr<const FineSurface> fine,
                                                     ByteReader& in) {
    TERRANE_TRY(auto tiers, read_extents(std::move(fine), in));
    for (BoundTier& tier : tiers->tiers_) {
        tiers->resize(tier);
        get_arrays(in, tier);
    }
    if (in.has_failed()) return other_size();
    return tiers;
}

BoundTier BoundTiers::tile_extent(const BoundTier& tier, int tile) const {
    const int across = tiles_along(tier.columns);
    const int x = tile % across * kTileSide, y = tile / across * kTileSide;
    BoundTier part;
    part.step = tier.step;
    part.first_x = tier.first_x + x;
    part.first_y = tier.first_y + y;
    part.columns = std::min(kTileSide, tier.columns - x);
    part.rows = std::min(kTileSide, tier.rows - y);
    return part;
}

Result<void> BoundTiers::write_tiles(SealedWriter& file, ByteWriter& directory) const {
    SealedTableWriter<SealedRecord> records;
    directory.put(first_step());
    directory.put(largest_);
    for (const BoundTier& tier : tiers_) {
        for (int i = 0; i < tile_count(tier.columns, tier.rows); ++i) {
            const BoundTier tile = tile_extent(tier, i);
            ByteWriter content;
            for_each_array(tier, [&](const auto& values) {
                if (values.empty()) return;
                for (int row = 0; row < tile.rows; ++row) {
                    const std::size_t at = tier.at(tile.first_x, tile.first_y + row);
                    content.put_each(
                        all_of(values).subspan(at, static_cast<std::size_t>(tile.columns)));
                }
            });
            TERRANE_TRY(const auto record, SealedRecord::append(file, content.bytes()));
            TERRANE_TRY(records.add(record, file));
        }
    }
    return records.finish(file, directory);
}

Result<std::unique_ptr<BoundTiers>> BoundTiers::read_tiles(std::shared_ptr<const FineSurface> fine,
                                                           std::shared_ptr<const SealedReader> file,
                                                           ByteReader& directory,
                                                           bool has_cell_flags) {
    constexpr std::size_t kMostTiles = 256;  // kept in memory: 25 MB
    TERRANE_TRY(auto tiers, read_extents(std::move(fine), directory));
    tiers->has_cell_flags_ = has_cell_flags;
    std::vector<std::size_t> first_tiles{0};
    for (const BoundTier& tier : tiers->tiers_) {
        const int count = tile_count(tier.columns, tier.rows);
        first_tiles.push_back(first_tiles.back() + static_cast<std::size_t>(count));
    }
    // The cache belongs to the tiers, so they exist as long as it.
    const auto decode = [of = tiers.get()](int i, int level, ByteReader& in) -> Result<BoundTier> {
        BoundTier tile = of->tile_extent(of->tiers_[static_cast<std::size_t>(level)], i);
        of->resize(tile);
        get_arrays(in, tile);
        return tile;
    };
    tiers->tiles_ =
        make_tiles<BoundTier>(kMostTiles, first_tiles, std::move(file), directory, decode);
    if (directory.has_failed()) return other_size();
    return tiers;
}

}  // namespace terrane::internal
