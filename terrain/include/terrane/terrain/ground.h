// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/surface.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace terrane {

/// Whether a query of the ground or of shapes has an answer, and why not. An answer that is `not_resident` must not be
/// used to move a body.
enum class QueryStatus {
    ok,       ///< the answer is complete; contact queries find no ground outside the extent
    miss,     ///< the ray hits nothing, or no surface is at or below the height
    outside,  ///< no ground there: beyond the extent, or nodata connected to its border
    truncated,  ///< the caller's buffer is too small; it holds the deepest contacts, or the lowest indices
    not_resident,  ///< ground that the answer depends on is absent at contact level
    invalid,       ///< an argument is not finite or out of range, or a rotation is not orthonormal
};

/// The height and the normal at a place.
struct HeightAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double height = 0.0;  ///< of the contact surface, world z, metres; only if status is ok
    /// Of the contact surface, unit, out of the solid; z > 0 except on volumes.
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    /// Certified: the true surface is within this of `height`, metres. As in all answers about the ground, infinite if
    /// the source is not certified (HeightSource::is_certified()).
    double error_m = 0.0;
    bool filled = false;  ///< whether the point is over an enclosed void that was filled
};

/// Where a ray first hits the ground.
struct RayAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double fraction = 0.0;  ///< share of the ray before the hit, 0 to 1; only if status is ok
    WorldPos point_world = WorldPos::Zero();            ///< where it hits the contact surface
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the contact surface, unit
    double error_m = 0.0;  ///< bound of the vertical distance from point_world to the true surface
    bool filled = false;   ///< whether the point is over an enclosed void that was filled
};

/// One cell of the contact surface: two triangles.
struct GroundCell {
    QueryStatus status = QueryStatus::outside;  ///< ok, outside or not_resident
    /// Heights of the corners in quanta: south-west, south-east, north-west, north-east.
    std::int32_t south_west = 0, south_east = 0, north_west = 0, north_east = 0;
    bool cut_to_north_east = false;  ///< see terrane::cut_to_north_east
    float error_m = 0.0f;            ///< the true surface is within this of the cell, metres
    bool filled = false;             ///< whether it is part of an enclosed void that was filled
};

/// Indices of cells of the contact level, counted from lattice point (0, 0); ends included.
struct CellRange {
    std::int64_t west = 0, south = 0, east = -1, north = -1;  ///< first and last column and row
    bool operator==(const CellRange&) const = default;
};

/// Interval of heights over a range of cells.
struct RangeAnswer {
    /// Whether the answer is complete.
    QueryStatus status =
        QueryStatus::outside;  ///< not_resident if any cell is absent; outside if all are outside
    /// Lower bound of the surface over the range, quanta. Over absent cells, bounds are derived from coarser resident
    /// chunks; if there are none, they are the limits of the integer. Undefined if the status is outside.
    std::int32_t low = 0;
    std::int32_t high = 0;  ///< upper bound, otherwise as low
};

/// The contact surface: the resident triangles of one level, independent of what is drawn, and their surface
/// properties. Immutable, cheap to copy.
///
/// Threads: any number
class Ground {
public:
    /// Requires 0 <= contact_level <= finest level of the set's lattice.
    ///
    /// @param surface_map friction, restitution and material by place; null: none
    Ground(std::shared_ptr<const ResidentSet> resident, int contact_level,
           std::shared_ptr<const SurfaceMap> surface_map = nullptr);

    /// Lattice of the source.
    const Lattice& lattice() const { return resident_->lattice(); }
    /// Extent of the source, metres. An edge within 2^-20 of a spacing from a line between cells is moved onto it.
    const WorldRect& extent() const { return extent_; }
    /// Whether cells lie within the extent. Of a cell that an edge of the extent cuts, only the part inside is ground.
    bool is_within_extent(const CellRange& cells) const {
        return cells.west >= whole_.west && cells.east <= whole_.east &&
               cells.south >= whole_.south && cells.north <= whole_.north;
    }
    /// The contact level.
    int level() const { return level_; }
    /// Metres between the samples of the contact surface.
    double spacing() const { return spacing_; }

    /// World x of a cell's south-west corner, metres; bit-identical to Lattice::x().
    double cell_x(std::int64_t column) const { return lattice().x(column * step_); }
    /// World y of a cell's south-west corner, metres; bit-identical to Lattice::y().
    double cell_y(std::int64_t row) const { return lattice().y(row * step_); }
    /// The column of cells that contains a world x; the eastern one if x is on a line between two.
    std::int64_t column_at(double x) const;
    /// The row of cells that contains a world y; the northern one if y is on a line between two.
    std::int64_t row_at(double y) const;

    /// The cell of the contact level at a column and row, counted from lattice point (0, 0).
    GroundCell cell(std::int64_t column, std::int64_t row) const;
    /// Bounds of the surface over a range, computed from the blocks of 8 x 8 cells that the range overlaps. In resident
    /// chunks, these include cells that are not ground.
    ///
    /// Cost: O(blocks along its edge + chunks); O(1) for aligned squares of a power of two
    RangeAnswer range(const CellRange& cells) const;

    /// Whether volumes cut or add to the heightfield of any resident chunk. Cost: O(1)
    bool has_solids() const { return has_solids_; }
    /// The joined solid of the chunk that contains a cell of the contact level; null if the chunk has none or is not
    /// resident. Valid while this ground lives.
    ///
    /// Cost: O(1)
    const SolidSurface* solid(std::int64_t column, std::int64_t row) const;

    /// Whether a range of cells is the same in another ground, because both have the same chunks there. Chunks are
    /// compared by address: keep the other ground alive while its answers are cached, so that no address is reused.
    ///
    /// Cost: O(chunks)
    bool has_same_cells(const Ground& other, const CellRange& cells) const;

    /// Height of the contact surface at world (x, y). If volumes add surfaces there, height of the highest surface.
    HeightAnswer height(double x, double y) const;
    /// The highest surface at or below a height, which may be a floor or a ceiling; `miss` if there is none.
    HeightAnswer height_below(double x, double y, double z) const;

    /// First intersection of the segment between two points with the surface, from above or below; a start exactly on
    /// the surface is a hit. `not_resident` if absent ground comes before any hit.
    RayAnswer ray(const WorldPos& from_world, const WorldPos& to_world) const;

    /// Surface properties at a position, from SurfaceMap::at(), even if there is no ground; absent if there is no map.
    /// Allocates: nothing, unless the map's function does
    /// Allocates: nothing, unless the map's function does
    /// Allocates: nothing, unless the map's function does
    std::optional<SurfaceProperties> surface(double x, double y) const {
        if (surface_map_ == nullptr) return std::nullopt;
        return surface_map_->at(x, y);
    }
    /// The map that surface() reads, or null.
    const std::shared_ptr<const SurfaceMap>& surface_map() const { return surface_map_; }

private:
    friend class GroundBatch;
    friend class GroundReader;
    friend class RayFan;
    class RayWalk;

    // The lines between cells along one axis. at() is bit-identical to Lattice::x() or y().
    struct Lines {
        double origin = 0.0, spacing = 1.0, inverse_spacing = 1.0;
        double at(std::int64_t index) const {
            return origin + spacing * static_cast<double>(index);
        }
        std::int64_t last_up_to(double p) const;
    };

    // Null if not resident.
    const Chunk* find_chunk(std::int64_t column, std::int64_t row) const;
    bool is_in_extent(std::int64_t column, std::int64_t row) const {
        return column >= in_extent_.west && column <= in_extent_.east && row >= in_extent_.south &&
               row <= in_extent_.north;
    }
    static GroundCell read_cell(const Chunk& chunk, std::int64_t column, std::int64_t row);
    SampleRange range_of_absent(const ChunkKey& key) const;
    struct CellPoint;
    bool height_over(const CellPoint& point, double at_most, HeightAnswer& answer) const;
    HeightAnswer height_at_most(double x, double y, double at_most) const;
    // ray(), given that the segment is above resident ground up to this fraction; <= 0: nothing is known.
    RayAnswer ray_after(double fraction, const WorldPos& from_world,
                        const WorldPos& to_world) const;

    std::shared_ptr<const ResidentSet> resident_;
    std::shared_ptr<const SurfaceMap> surface_map_;
    bool has_solids_ = false;
    int level_ = 0;
    std::int64_t step_ = 1;
    double spacing_ = 1.0;
    double quantum_ = 1.0, inverse_quantum_ = 1.0;  // exact: powers of two
    Lines columns_, rows_;
    WorldRect extent_;
    CellRange in_extent_;  // cells that overlap the interior of the extent
    CellRange whole_;      // cells within the extent
};

/// Reads many cells of a ground, faster than Ground if consecutive cells lie in the same chunk.
///
/// Threads: one
class GroundReader {
public:
    /// Reads this ground, which must outlive the reader.
    explicit GroundReader(const Ground& ground) : ground_(&ground) {}

    /// The ground that is read.
    const Ground& ground() const { return *ground_; }
    /// As Ground::cell().
    GroundCell cell(std::int64_t column, std::int64_t row);
    /// As square(), for the block of 8 x 8 cells that contains a cell.
    RangeAnswer block(std::int64_t column, std::int64_t row) { return square(column, row, 3); }
    /// Bounds of the surface over the square that contains a cell; it has 1 << log2_side cells along its side, and is
    /// aligned to its size. If the square is resident and overlaps the extent, the bounds are its lowest and highest
    /// sample, including those of cells that are not ground; otherwise they are those of Ground::range().
    ///
    /// @param log2_side 0 to 7
    ///
    /// Cost: O(1); less for consecutive squares of one chunk
    RangeAnswer square(std::int64_t column, std::int64_t row, int log2_side);
    /// Copies the heights at the corners of a range of cells, and finds out which of the cells are ground.
    ///
    /// @param range       at most 32 cells wide
    /// @param stride      from one row of heights_out to the next, > width of the range
    /// @param heights_out row by row from the south-west, quanta; 0 at corners without a resident cell in the extent
    /// @param ground_out  for each row of cells: bit i is set if cell i from the west is ground and resident
    void heights(const CellRange& range, std::size_t stride, std::span<std::int32_t> heights_out,
                 std::span<std::uint32_t> ground_out);
    /// Whether all cells of a range are ground and resident, and lie within the extent.
    ///
    /// Cost: O(chunks), plus O(cells) in chunks that also have other cells
    bool is_all_ground(const CellRange& range);
    /// Largest error_m of the cells of a range that are ground and resident.
    float error(const CellRange& range);

private:
    const Chunk* chunk_of(std::int64_t column, std::int64_t row);
    template <class Visitor>
    void visit_chunks(const CellRange& range, Visitor visitor);

    const Ground* ground_;
    const Chunk* chunk_ = nullptr;  // the last one found
    std::int64_t chunk_column_ = 0;
    std::int64_t chunk_row_ = 0;
};

}  // namespace terrane
