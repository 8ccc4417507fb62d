// SPDX-License-Identifier: MIT
#pragma once

#include "raster/cancellable_work.h"
#include "raster/plane_map.h"
#include "raster/raster_store.h"

#include <memory>
#include <mutex>
#include <vector>

namespace terrane::internal {

/// The greatest of non-negative values over rectangles of cells, from the values of blocks of 8 x 8 cells.
class BlockMaxima {
public:
    BlockMaxima() = default;
    BlockMaxima(int columns, int rows);

    /// Raises the value of a cell's block.
    void raise(int column, int row, float value);
    /// Computes the larger blocks, after the last raise().
    void finish();
    /// At least the greatest value over a closed rectangle of cells; cells outside have 0. Not less over a larger
    /// rectangle.
    float over(std::int64_t west, std::int64_t south, std::int64_t east, std::int64_t north) const;
    float all() const { return levels_.empty() ? 0.0f : levels_.back().values.front(); }

private:
    struct Level {
        int columns = 0, rows = 0;
        std::vector<float> values;
    };
    std::vector<Level> levels_;  ///< level k: blocks of 8 * 2^k cells
};

/// The bilinear surface of a raster, sampled at the nodes of a square grid in another plane: see PlaneMap.
///
/// A node's height is that of the raster's own surface at its place; the surface repeats the raster's edge beyond it. A
/// node is nodata where the raster's cell has nodata; where it is farther beyond the raster than a cell of the grid
/// reaches; and where the map from the plane to the raster is not smooth on the scale of a cell, as at a pole of a
/// raster in degrees. Each cell of the grid has a bound of the distance between its bilinear surface and the raster's.
class ResampledRaster final : public HeightReader {
public:
    /// Computes the bounds: one pass over all nodes, in parallel.
    ///
    /// Fails: io; cancelled; bad_data for slopes that overhang in the plane
    static Result<std::shared_ptr<const ResampledRaster>> create(
        std::string path, std::shared_ptr<const RasterStore> raster,
        std::shared_ptr<const PlaneMap> map, double progress_end, OpeningProgress& progress);

    const std::string& path() const override { return path_; }
    const DemInfo& info() const override { return info_; }
    bool rows_go_north() const override { return true; }
    Result<void> read(int column, int row, int columns, int rows,
                      std::span<double> heights_out) const override;
    bool has_float_numbers() const override { return false; }
    double scale() const override { return 1.0; }
    double offset() const override { return 0.0; }
    std::optional<HeightInterval> range() const override { return range_; }
    double error_over(std::int64_t west, std::int64_t south, std::int64_t east,
                      std::int64_t north) const override {
        return static_cast<double>(errors_.over(west, south, east, north));
    }
    bool has_errors() const override { return true; }

private:
    struct Node;
    struct Tile;

    ResampledRaster() = default;
    /// The error of a slope that overhangs at a node.
    tl::unexpected<Error> overhang(int column, int row) const;
    /// The nodes of a rectangle.
    ///
    /// Fails: io; bad_data for slopes that overhang
    Result<Tile> make_tile(int column, int row, int columns, int rows) const;
    /// Bound of the distance over the cell north-east of a tile's node; infinite if the slope overhangs.
    double cell_error(const Tile& tile, int column, int row) const;

    std::string path_;
    std::shared_ptr<const RasterStore> raster_;
    std::shared_ptr<const PlaneMap> map_;
    DemInfo info_;
    HeightInterval range_;
    BlockMaxima errors_;
};

}  // namespace terrane::internal
