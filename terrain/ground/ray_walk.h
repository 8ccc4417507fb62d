// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>
#include <terrane/terrain/lattice.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace terrane::internal {

/// The surface of a cell at a point.
struct CellHeight {
    double height;            ///< world z, metres
    double slope_x, slope_y;  ///< rise along one cell, metres
    bool is_south;            ///< the triangle contains the cell's southern edge

    /// Unit, upwards.
    Eigen::Vector3d normal(double spacing) const {
        const Eigen::Vector3d up(-slope_x / spacing, -slope_y / spacing, 1.0);
        return up / up.norm();
    }
};

/// Selects the triangle without branches: the choice is unpredictable, and a misprediction costs more than the
/// arithmetic.
///
/// @param south_west   sample of the cell's south-west corner in Chunk::heights
/// @param u, v         place in the cell from that corner, 0 to 1
/// @param cut          cut_to_north_east() of the cell
inline CellHeight height_in_cell(const std::int32_t* south_west, double u, double v, bool cut,
                                 double quantum) {
    // whether the triangle contains the southern edge, and the eastern one
    const bool is_south = (cut & (u >= v)) | (!cut & (u + v <= 1.0));
    const bool is_east = is_south == cut;
    const std::size_t north = std::size_t{!is_south} * kChunkSamples;
    const std::size_t east = std::size_t{is_east};
    const auto rise_of = [&](std::size_t to, std::size_t from) {
        return quantum *
               (static_cast<double>(south_west[to]) - static_cast<double>(south_west[from]));
    };
    const double slope_x = rise_of(north + 1, north);
    const double slope_y = rise_of(east + kChunkSamples, east);
    // from the south-west corner, or from the north-east one if the triangle does not have the south-west corner
    const auto far = static_cast<double>(!is_south & !cut);
    const double to_north_east = rise_of(1, 0) + rise_of(kChunkSamples + 1, 1);
    const double rise = far * to_north_east + slope_x * (u - far) + slope_y * (v - far);
    return {quantum * static_cast<double>(*south_west) + rise, slope_x, slope_y, is_south};
}

}  // namespace terrane::internal

namespace terrane {

/// log2 of kChunkCells: a right shift by it gives a cell's chunk index, rounded down for negative indices too.
inline constexpr int kChunkShift = SamplePyramid::kCoarsest;

/// The product with the reciprocal is inexact; the index is corrected by comparison with the lines.
inline std::int64_t Ground::Lines::last_up_to(double p) const {
    const double guess = (p - origin) * inverse_spacing;
    auto index = static_cast<std::int64_t>(guess);
    if (guess < static_cast<double>(index)) --index;  // the cast rounds towards zero
    if (p < at(index)) --index;
    if (p >= at(index + 1)) ++index;
    return index;
}

inline const Chunk* Ground::find_chunk(std::int64_t column, std::int64_t row) const {
    return resident_->find_ground({static_cast<std::int32_t>(column >> kChunkShift),
                                   static_cast<std::int32_t>(row >> kChunkShift),
                                   static_cast<std::uint8_t>(level_)});
}

inline GroundCell Ground::read_cell(const Chunk& chunk, std::int64_t column, std::int64_t row) {
    GroundCell cell;
    const auto i = static_cast<int>(column & (kChunkCells - 1));
    const auto j = static_cast<int>(row & (kChunkCells - 1));
    const std::uint8_t flags = chunk.flags_at(i, j);
    if ((flags & cell_outside) != 0) return cell;
    cell.status = QueryStatus::ok;
    const std::size_t south_west = sample_index(i, j);
    cell.south_west = chunk.heights[south_west];
    cell.south_east = chunk.heights[south_west + 1];
    cell.north_west = chunk.heights[south_west + kChunkSamples];
    cell.north_east = chunk.heights[south_west + kChunkSamples + 1];
    cell.cut_to_north_east = cut_to_north_east(column, row);
    cell.error_m = chunk.cell_error(cell_index(i, j));
    cell.filled = (flags & cell_filled) != 0;
    return cell;
}

namespace internal {

// One coordinate of a ray as a function of the parameter t, in cells from the line before its start. The t at a line is
// bit-identical for squares of all sizes; the span over a square is therefore exactly the union of its parts' spans.
struct RayAxis {
    double p, d;                 // position at t = 0, and its derivative
    std::int64_t origin;         // index of the line that p counts from
    std::int64_t sign;           // of the direction: to the next line
    double crossing_p, inverse;  // of crossing()

    RayAxis(double p_cells, double d_cells, std::int64_t origin_line)
        : p(p_cells), d(d_cells), origin(origin_line), sign(d_cells < 0.0 ? -1 : 1) {
        // finite, so that no product is NaN; a ray parallel to the lines never reaches the next one
        constexpr double kHuge = 1e300;
        crossing_p = d == 0.0 ? -kHuge : p;
        inverse = d == 0.0 ? kHuge : std::clamp(1.0 / d, -kHuge, kHuge);
    }
    double at(double t) const { return p + d * t; }
    double crossing(double line) const { return (line - crossing_p) * inverse; }
    double offset(std::int64_t line) const { return static_cast<double>(line - origin); }
    // Index of the cell at t.
    std::int64_t cell(double t) const {
        const double place = at(t);
        const auto index = static_cast<std::int64_t>(place);
        return origin + (place < static_cast<double>(index) ? index - 1 : index);
    }
};

// The plane of a triangle, over its cell: z0 + slope_x u + slope_y v, quanta.
struct Plane {
    double z0, slope_x, slope_y;
};

// A square of cells and the interval of t over it. The interval is empty if rounding makes `end` less than `begin`.
struct SquareSpan {
    std::int64_t column, row;
    double begin, end;
};

}  // namespace internal

// Traverses a ray chunk by chunk. Chunks whose height interval the ray overlaps are traversed by squares of the
// pyramid, and the smallest squares cell by cell.
class Ground::RayWalk {
    using RayAxis = internal::RayAxis;
    using Plane = internal::Plane;
    using SquareSpan = internal::SquareSpan;

public:
    /// @param is_above whether the ray is known to be above the ground at the start of the walk
    RayWalk(const Ground& ground, const WorldPos& start, const Eigen::Vector3d& displacement,
            bool is_above)
        : ground_(ground),
          x_(axis(ground.columns_, start.x(), displacement.x())),
          y_(axis(ground.rows_, start.y(), displacement.y())),
          base_(std::floor(start.z() * ground.inverse_quantum_)),
          z_(start.z() * ground.inverse_quantum_ - base_),
          dz_(displacement.z() * ground.inverse_quantum_),
          start_world_(start),
          displacement_(displacement),
          side_(is_above ? 1 : 0) {}

    void walk(double begin, double leave);
    void answer(RayAnswer& answer_out) const;
    double t() const { return t_; }

private:
    static constexpr int kLarge = 5, kSmall = 3;  // log2 of the sides of the intermediate squares

    static RayAxis axis(const Lines& lines, double p, double d) {
        const std::int64_t origin = lines.last_up_to(p);
        return {(p - lines.at(origin)) / lines.spacing, d / lines.spacing, origin};
    }
    double height(double t) const { return z_ + dz_ * t; }
    double above_base(std::int32_t quanta) const { return static_cast<double>(quanta) - base_; }

    // Calls visit() in order for the squares of 1 << kLog2 cells along the ray within the given cells, until visit()
    // returns true. Returns whether it did.
    template <int kLog2, class Visit>
    bool visit_squares(const CellRange& cells, double begin, double leave, Visit visit) {
        constexpr std::int64_t kSide = std::int64_t{1} << kLog2;
        const auto first = [](std::int64_t cell, std::int64_t low, std::int64_t high) {
            return std::max(low, std::min(cell, high)) & -kSide;
        };
        SquareSpan over{first(x_.cell(begin), cells.west, cells.east),
                        first(y_.cell(begin), cells.south, cells.north), begin, leave};
        double line_x = x_.offset(over.column + (x_.sign > 0 ? kSide : 0));
        double line_y = y_.offset(over.row + (y_.sign > 0 ? kSide : 0));
        const std::array<double, 2> to_next_x{0.0, static_cast<double>(x_.sign * kSide)};
        const std::array<double, 2> to_next_y{0.0, static_cast<double>(y_.sign * kSide)};
        for (;;) {
            const double to_x = x_.crossing(line_x), to_y = y_.crossing(line_y);
            const double next = std::min(to_x, to_y);
            over.end = std::min(next, leave);
            if (visit(over)) return true;
            if (!(next < leave)) return false;
            over.begin = std::max(over.begin, next);
            // branchless, because the axis of the next step is unpredictable
            const bool is_over_x = to_x <= to_y, is_over_y = to_y <= to_x;
            over.column += -std::int64_t{is_over_x} & (x_.sign * kSide);
            over.row += -std::int64_t{is_over_y} & (y_.sign * kSide);
            line_x += to_next_x[is_over_x];
            line_y += to_next_y[is_over_y];
        }
    }

    // Whether the ray stays on one side of a height range; determines the side if it is unknown.
    bool clears(const SampleRange& range, const SquareSpan& over) {
        const double z0 = height(over.begin), z1 = height(over.end);
        if (side_ >= 0 && std::min(z0, z1) > above_base(range.high)) {
            side_ = 1;
            return true;
        }
        if (side_ <= 0 && std::max(z0, z1) < above_base(range.low)) {
            side_ = -1;
            return true;
        }
        return false;
    }

    // As clears(), for a cell of the chunk.
    bool clears_cell(const SquareSpan& over) {
        const std::size_t corner = sample_index(static_cast<int>(over.column & (kChunkCells - 1)),
                                                static_cast<int>(over.row & (kChunkCells - 1)));
        const std::int32_t* const south = chunk_->heights.data() + corner;
        const std::int32_t* const north = south + kChunkSamples;
        // for most cells the highest corner decides
        SampleRange range;
        range.high = std::max(std::max(south[0], south[1]), std::max(north[0], north[1]));
        if (side_ <= 0) {
            range.low = std::min(std::min(south[0], south[1]), std::min(north[0], north[1]));
        }
        return clears(range, over);
    }

    // The cells of a square, clipped to the extent: a ray along the extent's edge belongs to the cells inside.
    CellRange cells_of(const SquareSpan& over, std::int64_t side) const {
        const CellRange cells{over.column, over.row, over.column + side - 1, over.row + side - 1};
        return is_whole_ ? cells : in_extent(cells);
    }
    CellRange in_extent(const CellRange& cells) const {
        const CellRange& extent = ground_.in_extent_;
        return {std::max(cells.west, extent.west), std::max(cells.south, extent.south),
                std::min(cells.east, extent.east), std::min(cells.north, extent.north)};
    }

    template <int kLog2>
    bool visit_parts(const SquareSpan& over) {
        const CellRange cells = cells_of(over, std::int64_t{1} << kLog2);
        if (cells.west > cells.east || cells.south > cells.north) {
            side_ = 0;
            return false;
        }
        if constexpr (kLog2 == kSmall) {
            return visit_squares<0>(cells, over.begin, over.end, [this](const SquareSpan& part) {
                return is_whole_ ? !clears_cell(part) && intersect_cell(part)
                                 : visit_partial_cell(part);
            });
        } else {
            constexpr int kPart = kLog2 == kChunkShift ? kLarge : kSmall;
            return visit_squares<kPart>(
                cells, over.begin, over.end, [this](const SquareSpan& part) {
                    const auto i = static_cast<int>(part.column & (kChunkCells - 1));
                    const auto j = static_cast<int>(part.row & (kChunkCells - 1));
                    return !clears(chunk_->pyramid.at(kPart, i, j), part) &&
                           visit_parts<kPart>(part);
                });
        }
    }
    bool open_chunk(std::int64_t column, std::int64_t row);
    bool intersect_cell(const SquareSpan& over) {
        return intersect(*chunk_, over.column, over.row, over);
    }
    bool visit_partial_cell(const SquareSpan& over);
    bool visit_solid_chunk(const SquareSpan& over);
    bool intersect(const Chunk& chunk, std::int64_t column, std::int64_t row,
                   const SquareSpan& over);
    bool record_hit(double t, const Plane& plane, const GroundCell& cell);

    const Ground& ground_;
    RayAxis x_, y_;
    double base_, z_, dz_;  // quanta
    WorldPos start_world_;
    Eigen::Vector3d displacement_;
    int side_;  // of the surface on which the ray is: 1 above, -1 below, 0 unknown

    const Chunk* chunk_ = nullptr;
    bool is_whole_ = false;  // all cells of the chunk are ground inside the extent

    QueryStatus status_ = QueryStatus::miss;
    double t_ = 0.0;
    double slope_x_ = 0.0, slope_y_ = 0.0;         // quanta per cell
    std::optional<std::uint32_t> solid_triangle_;  // hit triangle of the chunk's solid
    double error_m_ = 0.0;
    bool is_filled_ = false;
};

}  // namespace terrane
