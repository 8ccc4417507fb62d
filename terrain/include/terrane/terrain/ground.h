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
    ok,       ///< the answer is complete; contact counts cells outside the extent as no ground
    miss,     ///< the ray hits nothing; there is no surface at or below the height
    outside,  ///< no ground there: beyond the extent, or nodata connected to its border
    truncated,  ///< the caller's buffer was too small: it has the deepest contacts, or the lowest indices
    not_resident,  ///< ground that the answer depends on is absent at contact level
    invalid,       ///< an argument is not finite or out of range, or a rotation is not orthonormal
};

/// The height and the normal at a place.
struct HeightAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double height = 0.0;  ///< of the contact surface, world z, metres; only where status is ok
    /// Of the contact surface, unit, out of the solid: z > 0, but for ceilings of volumes.
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    /// Certified: the true surface is within this of `height`. Infinite where the source is not certified
    /// (HeightSource::is_certified()); so it is in all answers about the ground.
    double error_m = 0.0;
    bool filled = false;  ///< over an enclosed void that was filled
};

/// Where a ray first meets the ground.
struct RayAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double fraction = 0.0;  ///< of the ray from `from` to `to`, 0 to 1; only where status is ok
    WorldPos point_world = WorldPos::Zero();            ///< where it meets the contact surface
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the contact surface, unit
    double error_m = 0.0;  ///< upper bound of the true surface's vertical distance at the point
    bool filled = false;   ///< over an enclosed void that was filled
};

/// One cell of the contact surface: two triangles.
struct GroundCell {
    QueryStatus status = QueryStatus::outside;  ///< ok, outside or not_resident
    /// Heights of the corners in quanta: south-west, south-east, north-west, north-east.
    std::int32_t south_west = 0, south_east = 0, north_west = 0, north_east = 0;
    bool cut_to_north_east = false;  ///< see terrane::cut_to_north_east
    float error_m = 0.0f;            ///< the true surface is within this of the cell, metres
    bool filled = false;             ///< over an enclosed void that was filled
};

/// Indices of cells of the contact level, counted from lattice point (0, 0); ends included.
struct CellRange {
    std::int64_t west = 0, south = 0, east = -1, north = -1;  ///< first and last column and row
    bool operator==(const CellRange&) const = default;
};

/// Interval of heights over a range of cells.
struct RangeAnswer {
    /// Whether the answer is complete.
    QueryStatus status = QueryStatus::outside;  ///< not_resident if any cell is; outside if all are
    /// Bounds of the surface over the range, quanta; for absent cells from coarser resident chunks, or the
    /// limits of the integer. Undefined where the status is outside.
    std::int32_t low = 0;
    std::int32_t high = 0;  ///< as low
};

/// The contact surface: the resident triangles of one level, independent of what is drawn, and what they are made of.
/// Immutable, cheap to copy.
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
    /// Extent of the source, metres.
    const WorldRect& extent() const { return extent_; }
    /// The level that answers.
    int level() const { return level_; }
    /// Metres between the samples of the contact surface.
    double spacing() const { return spacing_; }

    /// World x of a cell's south-west corner, metres: the bits of Lattice::x().
    double cell_x(std::int64_t column) const { return lattice().x(column * step_); }
    /// World y of a cell's south-west corner, metres: the bits of Lattice::y().
    double cell_y(std::int64_t row) const { return lattice().y(row * step_); }
    /// The column of cells that contains a world x; on a line, the one to the east.
    std::int64_t column_at(double x) const;
    /// The row of cells that contains a world y; on a line, the one to the north.
    std::int64_t row_at(double y) const;

    /// The cell of the contact level at a column and row, counted from lattice point (0, 0).
    GroundCell cell(std::int64_t column, std::int64_t row) const;
    /// Bounds of the surface over a range, from the blocks of 8 x 8 cells that it overlaps. Includes cells that are
    /// no ground where their chunk is resident.
    ///
    /// Cost: O(blocks along its edge + chunks); O(1) for aligned squares of a power of two
    RangeAnswer range(const CellRange& cells) const;

    /// Whether volumes cut or add to the heightfield of any resident chunk. Cost: O(1)
    bool has_solids() const { return has_solids_; }
    /// The joined solid of the chunk that a cell of the contact level lies in; null where there is none, or the chunk
    /// is not resident. Alive as long as this ground.
    ///
    /// Cost: O(1)
    const SolidSurface* solid(std::int64_t column, std::int64_t row) const;

    /// Whether a range of cells is the same in another ground, because the same chunks are resident there. The other
    /// ground must have been alive for as long as its answers are remembered.
    ///
    /// Cost: O(chunks)
    bool has_same_cells(const Ground& other, const CellRange& cells) const;

    /// The contact surface over a point: the highest one, where volumes fold it.
    HeightAnswer height(double x, double y) const;
    /// The highest surface at or below a height: the next floor or ceiling down. `miss` where there is none.
    HeightAnswer height_below(double x, double y, double z) const;

    /// First intersection of the segment between two points with the surface, from above or below; a start exactly
    /// on it counts. `not_resident` if absent ground comes before any hit.
    RayAnswer ray(const WorldPos& from_world, const WorldPos& to_world) const;

    /// The surface properties at a place: SurfaceMap::at(), whether there is ground or not; nothing without a map.
    /// Allocates: nothing, unless the map's function does
    std::optional<SurfaceProperties> surface(double x, double y) const {
        if (surface_map_ == nullptr) return std::nullopt;
        return surface_map_->at(x, y);
    }
    /// The map that surface() asks, or null.
    const std::shared_ptr<const SurfaceMap>& surface_map() const { return surface_map_; }

private:
    friend class GroundBatch;
    friend class GroundReader;
    friend class RayFan;
    class RayWalk;

    // The lines between cells along one axis: line i is Lattice::x() or y() of it, bit for bit.
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
    // ray() where the segment is above resident ground up to a fraction of it; not above 0: nothing is known.
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
};

/// Reads many cells: the answers of the ground, faster where consecutive cells lie in the same chunk. The ground
/// outlives it.
///
/// Threads: one
class GroundReader {
public:
    /// Reads this ground, which must outlive the reader.
    explicit GroundReader(const Ground& ground) : ground_(&ground) {}

    /// The ground that it reads; a cell of it.
    const Ground& ground() const { return *ground_; }
    /// As Ground::cell().
    GroundCell cell(std::int64_t column, std::int64_t row);
    /// Ground::range() of the block of 8 x 8 cells that a cell lies in.
    RangeAnswer block(std::int64_t column, std::int64_t row) { return square(column, row, 3); }
    /// Bounds of the surface over the aligned square of 1 << log2_side cells along the side that contains a cell:
    /// exactly its lowest and highest sample if it is resident, including cells beyond the extent and nodata;
    /// else as Ground::range().
    ///
    /// @param log2_side 0 to 7
    ///
    /// Cost: O(1); less for consecutive squares of one chunk
    RangeAnswer square(std::int64_t column, std::int64_t row, int log2_side);
    /// Copies the corners of a range of cells, and tells which of the cells are ground.
    ///
    /// @param range       at most 32 cells wide
    /// @param stride      from one row of heights_out to the next, > width of the range
    /// @param heights_out row by row from the south-west, quanta; 0 where no chunk has them
    /// @param ground_out  for each row, bit i is set where cell i from the west is ground and resident
    void heights(const CellRange& range, std::size_t stride, std::span<std::int32_t> heights_out,
                 std::span<std::uint32_t> ground_out);
    /// Whether all cells of a range are ground and resident.
    ///
    /// Cost: O(chunks); O(cells) of chunks that have other cells too
    bool is_all_ground(const CellRange& range);
    /// Largest error_m of the cells of a range that are ground and resident.
    float error(const CellRange& range);

private:
    const Chunk* chunk_of(std::int64_t column, std::int64_t row);
    template <class Visitor>
    void visit_chunks(const CellRange& range, Visitor visitor);

    const Ground* ground_;
    const Chunk* chunk_ = nullptr;  // found last
    std::int64_t chunk_column_ = 0;
    std::int64_t chunk_row_ = 0;
};

}  // namespace terrane
