// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/resident_set.h>

#include <cstdint>
#include <memory>
#include <span>

namespace terrane {

enum class GroundStatus {
    ok,            ///< answered
    miss,          ///< a ray met nothing on its way
    outside,       ///< no ground there: beyond the extent, or nodata connected to its border
    not_resident,  ///< ground, but its chunk at contact level is not loaded
    invalid,       ///< the question is not finite
};

struct HeightAnswer {
    GroundStatus status = GroundStatus::invalid;
    double height = 0.0;  ///< of the contact surface, world z, metres; only where status is ok
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the contact surface, unit, z > 0
    double error_m = 0.0;  ///< certified: the true surface is within this of `height`
    bool filled = false;   ///< over an enclosed void that was filled
};

struct RayAnswer {
    GroundStatus status = GroundStatus::invalid;
    double fraction = 0.0;  ///< of the way from `from` to `to`; only where status is ok
    WorldPos point_world = WorldPos::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    double error_m = 0.0;  ///< vertical distance of the true surface at the point, at most
    bool filled = false;
};

/// One cell of the contact surface: two triangles.
struct GroundCell {
    GroundStatus status = GroundStatus::outside;  ///< ok, outside or not_resident
    /// Heights of the corners in quanta: south-west, south-east, north-west, north-east.
    std::int32_t south_west = 0, south_east = 0, north_west = 0, north_east = 0;
    bool cut_to_north_east = false;  ///< see terrane::cut_to_north_east
    float error_m = 0.0f;
    bool filled = false;
};

/// Indices of cells of the contact level, counted from lattice point (0, 0); ends included.
struct CellRange {
    std::int64_t west = 0, south = 0, east = -1, north = -1;
    bool operator==(const CellRange&) const = default;
};

/// Heights over a range of cells.
struct RangeAnswer {
    GroundStatus status =
        GroundStatus::outside;  ///< not_resident if any cell is; outside if all are
    /// Bounds of the surface over the range, quanta; where cells are not resident, from coarser
    /// chunks that are, or all that an integer holds. No bounds where the status is outside.
    std::int32_t low = 0;
    std::int32_t high = 0;
};

/// The contact surface: the triangles of one level of what is resident. What is drawn does not
/// matter. Cheap to copy; immutable; any number of threads.
class Ground {
public:
    /// Requires 0 <= contact_level <= finest level of the set's lattice.
    Ground(std::shared_ptr<const ResidentSet> resident, int contact_level);

    const Lattice& lattice() const { return resident_->lattice(); }
    const WorldRect& extent() const { return extent_; }
    int level() const { return level_; }
    /// Metres between the samples of the contact surface.
    double spacing() const { return spacing_; }

    /// World coordinate of a cell index's south-west corner, metres: exact steps of the lattice.
    double cell_x(std::int64_t column) const { return lattice().x(column * step_); }
    double cell_y(std::int64_t row) const { return lattice().y(row * step_); }
    /// The cell that a coordinate falls in; on a line, the one to the east or north.
    std::int64_t column_at(double x) const;
    std::int64_t row_at(double y) const;

    GroundCell cell(std::int64_t column, std::int64_t row) const;
    /// Bounds of the surface over a range, from the blocks of 8 x 8 cells that it meets. Cells that are no
    /// ground count where their chunk is resident.
    ///
    /// Cost: O(blocks along its edge + chunks); O(1) for aligned squares of a power of two
    RangeAnswer range(const CellRange& cells) const;

    /// The contact surface over a point.
    HeightAnswer height(double x, double y) const;

    /// First point on the way from one point to another where the ray meets the surface from above
    /// or from below; starting exactly in it counts. `not_resident` where unloaded ground comes
    /// before any hit.
    RayAnswer ray(const WorldPos& from_world, const WorldPos& to_world) const;

private:
    friend class GroundReader;
    class RayWalk;

    // The lines between cells along one axis: line i is Lattice::x() or y() of it, bit for bit.
    struct Lines {
        double origin = 0.0, spacing = 1.0, inverse_spacing = 1.0;
        double at(std::int64_t index) const {
            return origin + spacing * static_cast<double>(index);
        }
        std::int64_t last_up_to(double p) const;
    };

    // Null where it is not resident.
    const Chunk* find_chunk(std::int64_t column, std::int64_t row) const;
    bool is_in_extent(std::int64_t column, std::int64_t row) const {
        return column >= in_extent_.west && column <= in_extent_.east && row >= in_extent_.south &&
               row <= in_extent_.north;
    }
    static GroundCell read_cell(const Chunk& chunk, std::int64_t column, std::int64_t row);
    SampleRange range_of_absent(const ChunkKey& key) const;
    struct Place;
    bool height_over(const Place& place, HeightAnswer& answer) const;

    std::shared_ptr<const ResidentSet> resident_;
    int level_ = 0;
    std::int64_t step_ = 1;
    double spacing_ = 1.0;
    double quantum_ = 1.0, inverse_quantum_ = 1.0;  // exact: powers of two
    Lines columns_, rows_;
    WorldRect extent_;
    CellRange in_extent_;  // cells of the lattice that the extent's inside meets
};

/// Reads one cell after the other: what it finds is what the ground answers, sooner where the next cell
/// lies in the same chunk. The ground outlives it.
///
/// Threads: one
class GroundReader {
public:
    explicit GroundReader(const Ground& ground) : ground_(&ground) {}

    const Ground& ground() const { return *ground_; }
    GroundCell cell(std::int64_t column, std::int64_t row);
    /// Ground::range() of the block of 8 x 8 cells that a cell lies in.
    RangeAnswer block(std::int64_t column, std::int64_t row) { return square(column, row, 3); }
    /// Bounds of the surface over the square of 1 << log2_side cells along the side, aligned to its size,
    /// that a cell lies in: exactly its lowest and highest sample where it is resident, those of cells
    /// beyond the extent and of nodata among them; else as Ground::range().
    ///
    /// @param log2_side 0 to 7
    ///
    /// Cost: O(1), the less the more squares of one chunk are asked for in turn
    RangeAnswer square(std::int64_t column, std::int64_t row, int log2_side);
    /// Corners of a range of cells, and which of the cells are ground.
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
    template <class Take>
    void visit_chunks(const CellRange& range, Take take);

    const Ground* ground_;
    const Chunk* chunk_ = nullptr;  // that was found last
    std::int64_t chunk_column_ = 0;
    std::int64_t chunk_row_ = 0;
};

}  // namespace terrane
