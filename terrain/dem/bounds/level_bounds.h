// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/bilinear_grid.h"
#include "bilinear/fine_surface.h"
#include "bilinear/raster_samples.h"
#include "raster/cancellable_work.h"
#include "raster/raster_store.h"

#include <terrane/store/bytes.h>
#include <terrane/terrain/height_source.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Number of points by which a tier extends beyond the raster on each side: a vertex there depends on the points within
/// three steps, and points with all four residues of the index modulo 4 are needed.
inline constexpr std::int64_t kBeyondRaster = 6;

/// Points or nodes along the side of a tile, in which a file has tiers and pyramids.
inline constexpr int kTileSide = 64;

/// A decimated lattice over a raster, with the bounds of the vertices and cells of its spacing. Beyond the raster the
/// surface repeats the raster's edge. So a point there has the values of the stored point near the edge whose index is
/// equal modulo 4, because the squares around both are cut along the same diagonals.
struct BoundTier {
    explicit BoundTier(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
        : bounds(memory),
          cell_bounds(memory),
          heights(memory),
          cell_low(memory),
          cell_high(memory),
          cell_flags(memory) {}

    std::int64_t step = 1;                  ///< finest spacings between neighbouring points
    std::int64_t first_x = 0, first_y = 0;  ///< index of the south-western point, in steps
    int columns = 0, rows = 0;
    /// [rows * columns] of the vertices of spacing `step`; otherwise 0.
    std::pmr::vector<float> bounds;
    std::pmr::vector<float> cell_bounds;  ///< [rows * columns] of the cell north-east of a point

    // Only in the first tier.
    std::pmr::vector<double> heights;  ///< [rows * columns]
    /// [rows * columns] range of the surface minus the bilinear interpolation of the corners, over the cell
    /// north-east of a point.
    std::pmr::vector<float> cell_low, cell_high;

    /// [rows * columns] bits of CellFlag of the cell north-east of a point. Only of a raster with nodata that was
    /// reopened.
    std::pmr::vector<std::uint8_t> cell_flags;

    bool contains(std::int64_t x, std::int64_t y) const {
        return x >= first_x && y >= first_y && x < first_x + columns && y < first_y + rows;
    }
    std::size_t at(std::int64_t x, std::int64_t y) const { return row_at(y) + column_at(x); }
    /// The two parts of at().
    std::size_t row_at(std::int64_t y) const {
        return static_cast<std::size_t>(stored_row(y)) * static_cast<std::size_t>(columns);
    }
    std::size_t column_at(std::int64_t x) const {
        return static_cast<std::size_t>(stored_column(x));
    }
    /// Row and column of the stored point that has the values of a point.
    int stored_row(std::int64_t y) const { return static_cast<int>(repeated(y - first_y, rows)); }
    int stored_column(std::int64_t x) const {
        return static_cast<int>(repeated(x - first_x, columns));
    }

private:
    static std::int64_t repeated(std::int64_t i, std::int64_t count) {
        if (i < 0) return i & 3;
        if (i >= count) return count - 4 + ((i - count) & 3);
        return i;
    }
};

/// Finds the greatest deviation of the surface over every triangle that is larger than a cell of the first tier.
///
/// @param first   with heights, cell_low and cell_high
/// @param levels  tiers with 2, 4, 8 ... times the first tier's step, initialised with zeros. Receives in cell_bounds
///                the deviation over each cell, and, except in the last tier, in bounds the deviation over the diamond
///                of each midpoint
///
/// @return visited tiles, summed over passes and triangles
///
/// Fails: io; cancelled
/// Cost:  tiles over the raster times levels, and the raster's circumference times levels
Result<std::int64_t> find_deviations(const FineSurface& fine, const BoundTier& first,
                                     std::span<BoundTier> levels, OpeningProgress& progress);

/// Bounds that are computed once and stored, in memory or in a file. The first tier is eight times coarser than the
/// base spacing (more for huge rasters). Finer bounds are computed on demand, from windows of at most about 500 points
/// a side.
class BoundTiers {
public:
    /// Computes all tiers: two passes over the raster.
    ///
    /// @param memory of the tiers; must exist as long as they do
    ///
    /// Fails: io; cancelled
    static Result<std::unique_ptr<BoundTiers>> create(
        std::shared_ptr<const FineSurface> fine, OpeningProgress& progress,
        std::pmr::memory_resource* memory = std::pmr::get_default_resource());

    /// Approximate number of points in the first tier.
    static double first_points(const BilinearGrid& grid);

    /// Serialisation for OpeningCache; read() fails with bad_data if the bytes do not match this surface.
    void write(ByteWriter& out) const;
    static Result<std::unique_ptr<BoundTiers>> read(std::shared_ptr<const FineSurface> fine,
                                                    ByteReader& in);

    /// The same, but tiles of the tiers are records of the file.
    /// Fails: io
    Result<void> write_tiles(SealedWriter& file, ByteWriter& directory) const;
    /// Reads tiles when they are needed, and keeps some in memory.
    ///
    /// @param has_cell_flags whether add_cell_flags() was called before they were written
    ///
    /// Fails: bad_data if the bytes do not match this surface
    static Result<std::unique_ptr<BoundTiers>> read_tiles(std::shared_ptr<const FineSurface> fine,
                                                          std::shared_ptr<const SealedReader> file,
                                                          ByteReader& directory,
                                                          bool has_cell_flags);

    /// Whether sample() can give the heights of a grid: its corner and step must be multiples of the first tier's step.
    bool has_heights(const SampleGrid& grid) const;
    /// Fails: as reading tiles; so do the functions below
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const;

    /// As in HeightSource; both require grid.step >= first_step().
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;
    std::int64_t first_step() const { return first().step; }

    /// Flags of the cells of all tiers, for write(). Fails: as get_flags
    Result<void> add_cell_flags(
        const std::function<Result<void>(const SampleGrid& grid,
                                         std::span<std::uint8_t> flags_out)>& get_flags);
    /// Whether cell_flags() has the flags of the cells of a step.
    bool has_cell_flags(std::int64_t step) const {
        return has_cell_flags_ && find(step).has_value();
    }
    /// As in HeightSource; requires has_cell_flags().
    Result<void> cell_flags(const SampleGrid& grid, std::span<std::uint8_t> flags_out) const;

    /// Work done for the tiers above the first: visited tiles, summed over triangles.
    std::int64_t tile_visits() const { return tile_visits_; }

private:
    explicit BoundTiers(std::shared_ptr<const FineSurface> fine,
                        std::pmr::memory_resource* memory = std::pmr::get_default_resource())
        : fine_(std::move(fine)), memory_(memory) {}

    const BoundTier& first() const { return tiers_.front(); }
    /// Index of the tier of a spacing; absent if it is coarser than a root square.
    std::optional<std::size_t> find(std::int64_t step) const;
    /// A tier of a spacing, with its rectangle but without values.
    BoundTier make_extent(std::int64_t step) const;
    /// Appends tiers with twice the spacing, up to the root squares, as make_extent().
    void add_extents();
    /// Makes the arrays of a tier, or of a tile of it.
    void resize(BoundTier& tier) const;
    /// The beginning of write(), and tiers with extents alone. Fails: bad_data
    static Result<std::unique_ptr<BoundTiers>> read_extents(std::shared_ptr<const FineSurface> fine,
                                                            ByteReader& in);

    /// Points of a tier: x, y is the south-western one, in the tier's steps; its neighbours are `stride` steps away.
    struct Points {
        std::int64_t x = 0, y = 0, stride = 1;
        int columns = 0, rows = 0;
    };
    template <typename Value>
    Result<void> get(std::size_t level, std::pmr::vector<Value> BoundTier::*values,
                     const Points& points, std::span<Value> values_out) const;
    /// The stored points of a tile that are in the tier, without values.
    BoundTier tile_extent(const BoundTier& tier, int tile) const;

    Result<void> make_first(int ratio, OpeningProgress& progress);
    Result<void> fill_square(int ratio, int x, int y, int side, BoundTier& tier) const;
    Result<void> make_coarser(OpeningProgress& progress);
    void nest(std::size_t level);

    std::shared_ptr<const FineSurface> fine_;
    std::pmr::memory_resource* memory_;
    std::vector<BoundTier> tiers_;  ///< each with twice the spacing of the previous one
    bool has_cell_flags_ = false;
    /// If the values are in a file, tiles by number in the tier and index of the tier. Otherwise null.
    std::shared_ptr<const TileCache<BoundTier>> tiles_;
    float largest_ = 0.0f;  ///< upper bound of all deviations
    std::int64_t tile_visits_ = 0;
};

/// Bounds of the bilinear surface's heights and rises: the lowest and highest sample of closed squares of 8, 16, 32 ...
/// raster cells, and the steepest slope. Heights are metres relative to the store's base.
class HeightPyramid {
public:
    /// Nodes are in the store's memory.
    /// Fails: io; cancelled
    static Result<HeightPyramid> create(const BilinearGrid& grid, const RasterStore& store,
                                        OpeningProgress& progress);

    /// Serialisation for OpeningCache; read() fails with bad_data if the bytes do not match this grid.
    void write(ByteWriter& out) const;
    static Result<HeightPyramid> read(const BilinearGrid& grid, ByteReader& in);

    /// The same, but for levels of more than one tile, whose tiles are records of the file.
    /// Fails: io
    Result<void> write_tiles(SealedWriter& file, ByteWriter& directory) const;
    /// Reads tiles when they are needed, and keeps some in memory.
    /// Fails: bad_data if the bytes do not match this grid
    static Result<HeightPyramid> read_tiles(const BilinearGrid& grid,
                                            std::shared_ptr<const SealedReader> file,
                                            ByteReader& directory);

    /// Contains every height over a closed rectangle of the plane. Infinite if a tile cannot be read.
    HeightInterval interval(const WorldRect& rect) const;
    /// As HeightSource::rise_bound().
    double rise_bound(double distance) const;
    HeightInterval range() const { return levels_.back().nodes.front(); }

private:
    using Nodes = std::pmr::vector<HeightInterval>;
    struct Level {
        int columns = 0, rows = 0;
        Nodes nodes;        ///< empty if they are in tiles
        double rise = 0.0;  ///< largest range of heights in 2 x 2 adjacent nodes

        std::size_t at(int x, int y) const {
            return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(x);
        }
        bool is_one_tile() const { return columns <= kTileSide && rows <= kTileSide; }
    };

    static Level first_level(const BilinearGrid& grid,
                             std::pmr::memory_resource* memory = std::pmr::get_default_resource());
    /// In the memory of the finer level.
    static Level next_level(const Level& fine);
    /// Range of the nodes of a closed rectangle of a level. Fails: as reading tiles
    Result<HeightInterval> range_of(std::size_t k, int west, int south, int east, int north) const;

    Result<void> add_samples(const RasterStore& store, OpeningProgress& progress);
    void add_levels();

    BilinearGrid grid_;
    std::vector<Level> levels_;  ///< level k: nodes of 8 * 2^k cells
    double slope_ = 0.0;         ///< largest gradient
    /// [kTileSide * kTileSide] nodes each, by number in the level and index of the level.
    std::shared_ptr<const TileCache<Nodes>> tiles_;
};

}  // namespace terrane::internal
