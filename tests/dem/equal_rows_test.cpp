// SPDX-License-Identifier: MIT
//
// Heights and bounds where rows or columns of a raster are equal, as they all are beyond its edges, are not computed
// again for each. Every bit must be the same as where each is computed.
#include "bilinear/fine_surface.h"
#include "bounds/level_bounds.h"
#include "bounds/raster_lattice.h"
#include "raster_files.h"
#include "support/random.h"

#include <terrane/store/bytes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <ostream>
#include <random>
#include <vector>

namespace terrane::test {
namespace equal_rows_test {

using internal::DiamondWindow;
using internal::FineSurface;

/// The first tier's ratio to the base spacing, for rasters of fewer than 2^22 x 64 cells.
constexpr int kRatio = 8;

struct Shape {
    int columns, rows;
    int steps =
        10'000;  ///< number of different heights; few of them make rows equal inside the raster too
    double finest_spacing = 0.0;  ///< 0: the cell of 10 m
};

void PrintTo(const Shape& shape, std::ostream* out) {
    *out << shape.columns << " x " << shape.rows << ", " << shape.steps << " heights, "
         << shape.finest_spacing << " m";
}

std::shared_ptr<const FineSurface> open_surface(const std::string& path, const Shape& shape,
                                                double cell_y = 10.0) {
    std::mt19937 random(static_cast<unsigned>(31 * shape.columns + shape.rows));
    RasterSpec spec{.columns = shape.columns, .rows = shape.rows};
    spec.transform[5] = -cell_y;
    // Thirds, so that sums and differences are rounded.
    spec.value = [&](int, int) {
        return static_cast<double>(random() % static_cast<unsigned>(shape.steps)) / 3.0 - 50.0;
    };
    write_raster(path, spec);
    auto reader = internal::RasterReader::open(path).value();
    internal::OpeningProgress progress(path, {});
    std::shared_ptr<const internal::RasterStore> store =
        internal::RasterStore::open(std::move(reader), {}, 0.0, nullptr, progress).value();
    const auto grid = internal::make_grid(store->info(), shape.finest_spacing).value();
    return std::make_shared<const FineSurface>(grid, std::move(store));
}

/// A tier with its rectangle, the margin of six points around the raster included, but without values.
internal::BoundTier empty_tier(const internal::BilinearGrid& grid, std::int64_t step) {
    const double spacing = grid.lattice.spacing * static_cast<double>(step);
    const auto below = [spacing](double from_origin) {
        return static_cast<std::int64_t>(std::floor(from_origin / spacing));
    };
    const Lattice& lattice = grid.lattice;
    internal::BoundTier tier;
    tier.step = step;
    tier.first_x = below(grid.west - lattice.origin_x) - internal::kBeyondRaster;
    tier.first_y = below(grid.south - lattice.origin_y) - internal::kBeyondRaster;
    const double east = grid.west + (grid.columns - 1) * grid.cell_x;
    const double north = grid.south + (grid.rows - 1) * grid.cell_y;
    tier.columns = static_cast<int>(below(east - lattice.origin_x) + 2 + internal::kBeyondRaster -
                                    tier.first_x);
    tier.rows = static_cast<int>(below(north - lattice.origin_y) + 2 + internal::kBeyondRaster -
                                 tier.first_y);
    const auto size = static_cast<std::size_t>(tier.columns) * static_cast<std::size_t>(tier.rows);
    tier.bounds.resize(size);
    tier.cell_bounds.resize(size);
    return tier;
}

/// All tiers as they are stored.
std::vector<internal::BoundTier> stored_tiers(const std::shared_ptr<const FineSurface>& fine) {
    internal::OpeningProgress progress("", {});
    const auto made = internal::BoundTiers::create(fine, progress).value();
    const internal::BilinearGrid& grid = fine->grid();
    ByteWriter out;
    made->write(out);
    ByteReader in(out.bytes());
    std::vector<internal::BoundTier> tiers;
    tiers.push_back(empty_tier(grid, in.get<std::int64_t>()));
    in.get<float>();
    internal::BoundTier& first = tiers.front();
    first.heights.resize(first.bounds.size());
    first.cell_low.resize(first.bounds.size());
    first.cell_high.resize(first.bounds.size());
    in.get_each(std::span<double>(first.heights));
    in.get_each(std::span<float>(first.cell_low));
    in.get_each(std::span<float>(first.cell_high));
    while (tiers.back().step < grid.lattice.chunk_side(0))
        tiers.push_back(empty_tier(grid, 2 * tiers.back().step));
    for (internal::BoundTier& tier : tiers) {
        in.get_each(std::span<float>(tier.bounds));
        in.get_each(std::span<float>(tier.cell_bounds));
    }
    EXPECT_FALSE(in.has_failed());
    EXPECT_TRUE(in.is_done());
    return tiers;
}

/// The window around a raster's first tier, with what its vertices and cells depend on.
DiamondWindow tier_window(const FineSurface& fine) {
    const internal::BoundTier extent = empty_tier(fine.grid(), kRatio * fine.grid().base_step());
    constexpr int kApron = 3 * kRatio;
    const std::int64_t step = fine.grid().base_step();
    return fine
        .bounds_window(
            {{(extent.first_x * kRatio - kApron) * step, (extent.first_y * kRatio - kApron) * step},
             step,
             extent.columns * kRatio + 2 * kApron + 1,
             extent.rows * kRatio + 2 * kApron + 1})
        .value();
}

int count_repeated(const std::vector<int>& runs) {
    int repeated = 0;
    for (std::size_t i = 0; i < runs.size(); ++i) repeated += runs[i] < static_cast<int>(i) ? 1 : 0;
    return repeated;
}

class EqualRows : public testing::TestWithParam<Shape> {};
INSTANTIATE_TEST_SUITE_P(Shapes, EqualRows,
                         testing::Values(Shape{2, 2}, Shape{70, 2}, Shape{70, 3}, Shape{70, 5},
                                         Shape{70, 9}, Shape{70, 17}, Shape{70, 40}, Shape{2, 70},
                                         Shape{3, 70}, Shape{5, 70}, Shape{9, 70}, Shape{17, 70},
                                         Shape{40, 70}, Shape{2, 700}, Shape{700, 2},
                                         Shape{150, 130}, Shape{70, 2, 2}, Shape{2, 70, 2},
                                         Shape{4, 4, 2}, Shape{9, 40, 1}, Shape{70, 2, 10'000, 3.0},
                                         Shape{2, 70, 10'000, 3.0}));

TEST_P(EqualRows, HaveTheBoundsOfRowsThatAreComputedOneByOne) {
    const TemporaryFolder folder;
    const auto fine = open_surface(folder.file("raster.tif"), GetParam());
    DiamondWindow fast = tier_window(*fine);
    const std::int64_t step = fine->grid().base_step();
    for (int y = 0; y < fast.rows; ++y) {
        for (int x = 0; x < fast.columns; ++x) {
            const double height =
                fine->height(fine->grid().column_at_index((fast.first_x + x) * step),
                             fine->grid().row_at_index((fast.first_y + y) * step))
                    .value();
            ASSERT_EQ(fast.heights[fast.at(x, y)], height) << x << ", " << y;
        }
    }
    // Four tier cells and more beyond each edge.
    EXPECT_GE(count_repeated(fast.row_runs), 8 * kRatio);
    EXPECT_GE(count_repeated(fast.column_runs), 8 * kRatio);
    DiamondWindow slow = fast;
    slow.row_runs.clear();
    slow.column_runs.clear();
    compute_bounds(fast, kRatio);
    compute_bounds(slow, kRatio);
    EXPECT_EQ(fast.bounds, slow.bounds);
    for (int n = 2; n <= 2 * kRatio; n *= 2) {
        for (int y = 0; y + n < slow.rows; y += n) {
            for (int x = 0; x + n < slow.columns; x += n) {
                ASSERT_EQ(cell_deviation(fast, x, y, n), cell_deviation(slow, x, y, n))
                    << x << ", " << y << ", " << n;
            }
        }
    }

    const internal::BoundTier tier = stored_tiers(fine).front();
    ASSERT_EQ(tier.step, kRatio * step);
    std::size_t at = 0;
    for (int j = 0; j < tier.rows; ++j) {
        for (int i = 0; i < tier.columns; ++i, ++at) {
            const int x = 3 * kRatio + i * kRatio, y = 3 * kRatio + j * kRatio;
            const HeightInterval range = bilinear_deviation(slow, x, y, kRatio);
            ASSERT_EQ(tier.heights[at], slow.heights[slow.at(x, y)]) << i << ", " << j;
            ASSERT_EQ(tier.bounds[at], slow.bounds[slow.at(x, y)]) << i << ", " << j;
            ASSERT_EQ(tier.cell_bounds[at], cell_deviation(slow, x, y, kRatio)) << i << ", " << j;
            ASSERT_EQ(tier.cell_low[at], -internal::round_outward(-range.low)) << i << ", " << j;
            ASSERT_EQ(tier.cell_high[at], internal::round_outward(range.high)) << i << ", " << j;
        }
    }
}

/// A triangle of tiles, the cells of the first tier, in a square of them, with the plane through its corners.
struct TileTriangle {
    std::int64_t west, south, side;
    double corner, rise_x, rise_y;  ///< of the plane, from tile to tile
    /// Whether it contains a tile, or half of it, by the tile's distances from the diagonals.
    bool (*contains)(std::int64_t rising, std::int64_t falling);
};

/// Largest deviation over a triangle, as far as it is known beyond a raster: at the corners of all of its tiles,
/// enlarged by what is between them. Absent if one of the tiles is not beyond the raster.
std::optional<float> deviation_beyond(const internal::BoundTier& first, const TileTriangle& t) {
    const auto is_off = [](std::int64_t tile, std::int64_t begin, int count) {
        return tile < begin + internal::kBeyondRaster ||
               tile >= begin + count - 1 - internal::kBeyondRaster;
    };
    double most = 0.0;
    for (std::int64_t y = 0; y < t.side; ++y) {
        for (std::int64_t x = 0; x < t.side; ++x) {
            if (!t.contains(y - x, y + x - (t.side - 1))) continue;
            const std::int64_t tile_x = t.west + x, tile_y = t.south + y;
            if (!is_off(tile_x, first.first_x, first.columns) &&
                !is_off(tile_y, first.first_y, first.rows)) {
                return std::nullopt;
            }
            internal::Range range;
            for (const std::int64_t i : {0, 1}) {
                for (const std::int64_t j : {0, 1}) {
                    const double plane = t.corner + (static_cast<double>(x + i) * t.rise_x +
                                                     static_cast<double>(y + j) * t.rise_y);
                    range.add(first.heights[first.at(tile_x + i, tile_y + j)] - plane);
                }
            }
            const std::size_t at = first.at(tile_x, tile_y);
            range.low += static_cast<double>(first.cell_low[at]);
            range.high += static_cast<double>(first.cell_high[at]);
            most = std::max(most, range.deviation());
        }
    }
    return internal::round_outward(most);
}

/// The triangles of the square with the indices i, j of a tier, or of the four around its centre.
class TierSquare {
public:
    TierSquare(const internal::BoundTier& first, std::int64_t side, std::int64_t i, std::int64_t j)
        : side_(side), west_(i * side), south_(j * side), is_north_east_(((i + j) & 1) == 0) {
        const auto height = [&](std::int64_t x, std::int64_t y) {
            return first.heights[first.at(west_ + x, south_ + y)];
        };
        sw_ = height(0, 0);
        se_ = height(side, 0);
        nw_ = height(0, side);
        ne_ = height(side, side);
        centre_ = height(side / 2, side / 2);
    }
    TileTriangle lower() const {
        const double n = static_cast<double>(side_), x = (se_ - sw_) / n;
        if (!is_north_east_)
            return of(sw_, x, (nw_ - sw_) / n, [](auto, auto f) { return f <= 0; });
        return of(sw_, x, (ne_ - se_) / n, [](auto r, auto) { return r <= 0; });
    }
    TileTriangle upper() const {
        const double n = static_cast<double>(side_), x = (ne_ - nw_) / n;
        if (is_north_east_) return of(sw_, x, (nw_ - sw_) / n, [](auto r, auto) { return r >= 0; });
        const double y = (ne_ - se_) / n;
        return of(ne_ - n * (x + y), x, y, [](auto, auto f) { return f >= 0; });
    }
    TileTriangle south() const {
        return of(sw_, (se_ - sw_) / n(), rise(sw_, se_),
                  [](auto r, auto f) { return r <= 0 && f <= 0; });
    }
    TileTriangle north() const {
        const double y = -rise(nw_, ne_);
        return of(nw_ - n() * y, (ne_ - nw_) / n(), y,
                  [](auto r, auto f) { return r >= 0 && f >= 0; });
    }
    TileTriangle west() const {
        return of(sw_, rise(sw_, nw_), (nw_ - sw_) / n(),
                  [](auto r, auto f) { return r >= 0 && f <= 0; });
    }
    TileTriangle east() const {
        const double x = -rise(se_, ne_);
        return of(se_ - n() * x, x, (ne_ - se_) / n(),
                  [](auto r, auto f) { return r <= 0 && f >= 0; });
    }

private:
    double n() const { return static_cast<double>(side_); }
    /// From a side to the centre.
    double rise(double begin, double end) const {
        return (centre_ - 0.5 * (begin + end)) / (0.5 * n());
    }
    TileTriangle of(double corner, double x, double y,
                    bool (*contains)(std::int64_t, std::int64_t)) const {
        return {west_, south_, side_, corner, x, y, contains};
    }

    std::int64_t side_, west_, south_;
    bool is_north_east_;
    double sw_ = 0.0, se_ = 0.0, nw_ = 0.0, ne_ = 0.0, centre_ = 0.0;
};

TEST(BoundsBeyondARaster, OfAllTiersAreTheGreatestOverAllTiles) {
    for (const Shape& shape : {Shape{70, 2}, Shape{2, 70}, Shape{700, 3}, Shape{3, 700},
                               Shape{300, 200}, Shape{70, 2, 10'000, 3.0}}) {
        for (const double cell_y : {10.0, 14.0}) {
            SCOPED_TRACE(testing::PrintToString(shape) + ", " + std::to_string(cell_y));
            const TemporaryFolder folder;
            const auto tiers = stored_tiers(open_surface(folder.file("raster.tif"), shape, cell_y));
            const internal::BoundTier& first = tiers.front();
            const auto larger = [&](const TileTriangle& a, const TileTriangle& b) {
                const auto of_a = deviation_beyond(first, a), of_b = deviation_beyond(first, b);
                return of_a && of_b ? std::optional<float>(std::max(*of_a, *of_b)) : std::nullopt;
            };
            int cells = 0, midpoints = 0;
            for (std::size_t level = 1; level < tiers.size(); ++level) {
                const internal::BoundTier& tier = tiers[level];
                const internal::BoundTier& finer = tiers[level - 1];
                const std::int64_t side = tier.step / first.step;
                for (std::int64_t y = tier.first_y; y < tier.first_y + tier.rows; ++y) {
                    for (std::int64_t x = tier.first_x; x < tier.first_x + tier.columns; ++x) {
                        const std::size_t at = tier.at(x, y);
                        const TierSquare cell(first, side, x, y);
                        if (const auto wanted = larger(cell.lower(), cell.upper())) {
                            ASSERT_EQ(tier.cell_bounds[at], *wanted)
                                << "cell " << x << ", " << y << ", level " << level;
                            ++cells;
                        }
                        const bool along_x = (x & 1) != 0;
                        if (level + 1 == tiers.size() || along_x == ((y & 1) != 0)) continue;
                        const TierSquare here(first, 2 * side, x >> 1, y >> 1);
                        const TierSquare beside(first, 2 * side, along_x ? x >> 1 : (x >> 1) - 1,
                                                along_x ? (y >> 1) - 1 : y >> 1);
                        auto wanted = along_x ? larger(here.south(), beside.north())
                                              : larger(here.west(), beside.east());
                        if (!wanted) continue;
                        for (const std::int64_t i : {2 * x - 1, 2 * x + 1}) {
                            for (const std::int64_t j : {2 * y - 1, 2 * y + 1}) {
                                wanted = std::max(*wanted, finer.bounds[finer.at(i, j)]);
                            }
                        }
                        ASSERT_EQ(tier.bounds[at], *wanted)
                            << "midpoint " << x << ", " << y << ", level " << level;
                        ++midpoints;
                    }
                }
            }
            EXPECT_GT(cells, 300);
            EXPECT_GT(midpoints, 100);
        }
    }
}

TEST(EqualRowsOffTheLattice, AreComputedOneByOne) {
    // Lines between raster cells lie at other places in every row of lattice points, and so rounding differs.
    const TemporaryFolder folder;
    const auto fine = open_surface(folder.file("raster.tif"), {70, 2}, 14.0);
    const DiamondWindow window = tier_window(*fine);
    ASSERT_TRUE(window.kinked);
    EXPECT_TRUE(window.row_runs.empty() && window.column_runs.empty());
}

}  // namespace equal_rows_test
}  // namespace terrane::test
