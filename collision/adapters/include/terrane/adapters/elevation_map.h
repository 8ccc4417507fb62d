// SPDX-License-Identifier: MIT
#pragma once

// An elevation map in the layout of ROS's grid_map: a rectangle of float cells in a circular buffer that follows a
// robot by whole cells. Does not need ROS. layer() has the data of get("elevation") of a grid_map::GridMap with the
// same length, resolution, position and start index:
//
//     Eigen::Map<const Eigen::MatrixXf>(map.layer().data(), map.rows(), map.columns())
//
// In grid_map_msgs/GridMap start_row() is outer_start_index and start_column() is inner_start_index.
//
// Units: metres. Frame: the map's, x east, y north, z up, translated by ElevationMapSettings::origin_world.
// Layout: column-major. Row and column indices increase towards -x and -y: unwrapped cell (0, 0) has the largest x and
// y. Buffer index = unwrapped index plus start index, modulo the size. A cell holds the height of the contact surface
// at its centre; if volumes produce several surfaces there, it holds the height of the highest one.
//
// Absent ground: NaN, as in grid_map, with the reason in statuses(). Nothing is filled in.
//
// Threads: one; any number of readers between updates.
// Sources: P. Fankhauser, M. Hutter. A universal grid map library. In: Robot Operating System. 2016 (circular buffer).
//          The reference of grid_map_core, docs.ros.org (layout, positions).

#include <terrane/adapters/surface_point.h>

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace terrane::adapters {

/// Maximum number of cells of an ElevationMap, of 5 bytes each.
inline constexpr std::int64_t kMostElevationCells = std::int64_t{1} << 26;

/// Settings of an ElevationMap.
struct ElevationMapSettings {
    double length_x = 10.0;   ///< side, metres, rounded to whole cells, at least one
    double length_y = 10.0;   ///< as length_x
    double resolution = 0.1;  ///< side of a cell, metres, 1e-6 to 1e6
    WorldPos origin_world = WorldPos::Zero();  ///< of the map's frame, within 2^40 m
};

/// Report of an update.
struct ElevationMapUpdate {
    std::int64_t moved_x = 0;       ///< motion of the map, cells, positive eastward
    std::int64_t moved_y = 0;       ///< motion of the map, cells, positive northward
    std::int64_t read_cells = 0;    ///< cells whose height was read
    std::int64_t absent_cells = 0;  ///< cells of the map without a height
    bool is_refused = false;        ///< the position was not finite or too far; nothing changed
};

/// Heights around a moving position, in a circular buffer of cells.
class ElevationMap {
public:
    /// Fails: invalid_argument, naming the field and its value, and for more than kMostElevationCells cells
    static Result<ElevationMap> create(const ElevationMapSettings& settings) {
        const double resolution = settings.resolution;
        if (!(resolution >= 1e-6 && resolution <= 1e6)) {
            return fail(ErrorCode::invalid_argument,
                        "resolution must be 1e-06 to 1e+06, got " + number_text(resolution));
        }
        for (const auto& [name, length] :
             {std::pair{"length_x", settings.length_x}, std::pair{"length_y", settings.length_y}}) {
            const double most = static_cast<double>(kMostElevationCells);
            if (length >= 0.5 * resolution && length / resolution <= most) continue;
            return fail(ErrorCode::invalid_argument,
                        std::string(name) + " must be 1 to " + number_text(kMostElevationCells) +
                            " cells, got " + number_text(length) + " m");
        }
        ElevationMap map(settings);
        if (map.rows_ * map.columns_ > kMostElevationCells) {
            return fail(ErrorCode::invalid_argument,
                        "a map must have at most " + number_text(kMostElevationCells) +
                            " cells, got " + number_text(map.rows_ * map.columns_));
        }
        Pose frame;
        frame.translation = settings.origin_world;
        if (!check_frame(frame)) {
            return fail(ErrorCode::invalid_argument,
                        "origin_world must be finite and within 2^40 m");
        }
        const auto size = static_cast<std::size_t>(map.rows_ * map.columns_);
        map.layer_.assign(size, std::numeric_limits<float>::quiet_NaN());
        map.statuses_.assign(size, QueryStatus::not_resident);
        return map;
    }

    /// Moves the map's centre to (x, y), rounded to whole cells. Reads the cells that entered the map, and all cells of
    /// each map column over chunks that are absent or were replaced since the last update(). A position that is not
    /// finite or beyond 2^40 m changes nothing.
    ///
    /// @param x, y metres, map frame
    ///
    /// Allocates: nothing
    /// Cost:      O(cells read), plus a check of the chunks below each column
    ElevationMapUpdate update(const Ground& ground, double x, double y) {
        ElevationMapUpdate update;
        if (!(std::abs(x) <= 0x1p40 && std::abs(y) <= 0x1p40)) {
            update.is_refused = true;
            update.absent_cells = absent_count();
            return update;
        }
        update.moved_x = whole_cells(x - position_x());
        update.moved_y = whole_cells(y - position_y());
        cell_x_ += update.moved_x;
        cell_y_ += update.moved_y;
        start_row_ = wrap(start_row_ - update.moved_x, rows_);
        start_column_ = wrap(start_column_ - update.moved_y, columns_);
        for (std::int64_t column = 0; column < columns_; ++column) {
            const bool is_kept =
                !is_new(column, update.moved_y, columns_) && is_same(ground, column);
            for (std::int64_t row = 0; row < rows_; ++row) {
                if (is_kept && !is_new(row, update.moved_x, rows_)) continue;
                read(ground, row, column);
                ++update.read_cells;
            }
        }
        ground_ = ground;
        update.absent_cells = absent_count();
        return update;
    }

    /// Rows of the layer: cells along x.
    std::int64_t rows() const { return rows_; }
    std::int64_t columns() const { return columns_; }  ///< cells along y
    /// Buffer row and column of unwrapped cell (0, 0), the north-eastern one.
    std::int64_t start_row() const { return start_row_; }
    std::int64_t start_column() const { return start_column_; }  ///< see start_row()
    /// Side of a cell.
    double resolution() const { return settings_.resolution; }
    /// x of the map's centre, map frame: always a whole number of cells from the frame's origin.
    double position_x() const { return static_cast<double>(cell_x_) * settings_.resolution; }
    /// As position_x(), along y.
    double position_y() const { return static_cast<double>(cell_y_) * settings_.resolution; }

    /// [rows() * columns()] heights, column-major, map frame; NaN where there is no ground.
    std::span<const float> layer() const { return layer_; }
    /// [rows() * columns()] status of each cell, the reason for NaN. `not_resident` before the first update().
    std::span<const QueryStatus> statuses() const { return statuses_; }

    /// x of an unwrapped cell's centre, map frame.
    double cell_x(std::int64_t row) const { return position_x() + offset(row, rows_); }
    /// As cell_x(), along y.
    double cell_y(std::int64_t column) const { return position_y() + offset(column, columns_); }
    /// Index in layer() of an unwrapped cell. Requires 0 <= row < rows() and 0 <= column < columns().
    std::size_t index(std::int64_t row, std::int64_t column) const {
        return static_cast<std::size_t>(wrap(column + start_column_, columns_) * rows_ +
                                        wrap(row + start_row_, rows_));
    }
    /// Index in layer() of the cell that contains a position, map frame; nothing outside the map.
    std::optional<std::size_t> find(double x, double y) const {
        const double row = 0.5 * static_cast<double>(rows_) - (x - position_x()) / resolution();
        const double column =
            0.5 * static_cast<double>(columns_) - (y - position_y()) / resolution();
        if (!(row >= 0.0 && row < static_cast<double>(rows_)) ||
            !(column >= 0.0 && column < static_cast<double>(columns_))) {
            return std::nullopt;
        }
        return index(static_cast<std::int64_t>(row), static_cast<std::int64_t>(column));
    }

private:
    explicit ElevationMap(const ElevationMapSettings& settings)
        : settings_(settings),
          rows_(std::max<std::int64_t>(1, std::llround(settings.length_x / settings.resolution))),
          columns_(
              std::max<std::int64_t>(1, std::llround(settings.length_y / settings.resolution))) {}

    static std::int64_t wrap(std::int64_t i, std::int64_t size) { return (i % size + size) % size; }
    // Rounds half away from zero, as grid_map does.
    std::int64_t whole_cells(double distance) const {
        return std::llround(distance / settings_.resolution);
    }
    // Offset of an unwrapped cell's centre from the map's centre; indices run against the axis.
    double offset(std::int64_t i, std::int64_t size) const {
        return (0.5 * static_cast<double>(size) - 0.5 - static_cast<double>(i)) *
               settings_.resolution;
    }
    // Whether an unwrapped row or column entered with a move: low indices if it was along the axis, else high ones.
    static bool is_new(std::int64_t i, std::int64_t moved, std::int64_t size) {
        return moved > 0 ? i < moved : i >= size + moved;
    }
    bool is_same(const Ground& ground, std::int64_t column) const {
        if (!ground_) return false;
        const double x = settings_.origin_world.x(),
                     y = settings_.origin_world.y() + cell_y(column);
        const std::int64_t row = ground.row_at(y);
        const CellRange cells{ground.column_at(x + cell_x(rows_ - 1)) - 1, row,
                              ground.column_at(x + cell_x(0)) + 1, row};
        return ground.extent() == ground_->extent() && ground.has_same_cells(*ground_, cells);
    }
    void read(const Ground& ground, std::int64_t row, std::int64_t column) {
        const WorldPos& origin = settings_.origin_world;
        const HeightAnswer answer =
            ground.height(origin.x() + cell_x(row), origin.y() + cell_y(column));
        const std::size_t at = index(row, column);
        statuses_[at] = answer.status;
        layer_[at] = answer.status == QueryStatus::ok
                         ? static_cast<float>(answer.height - origin.z())
                         : std::numeric_limits<float>::quiet_NaN();
    }
    std::int64_t absent_count() const {
        return std::count_if(statuses_.begin(), statuses_.end(),
                             [](QueryStatus status) { return status != QueryStatus::ok; });
    }

    ElevationMapSettings settings_;
    std::int64_t rows_, columns_;
    std::int64_t cell_x_ = 0, cell_y_ = 0;  // of the centre, from the frame's origin
    std::int64_t start_row_ = 0, start_column_ = 0;
    std::vector<float> layer_;
    std::vector<QueryStatus> statuses_;
    std::optional<Ground> ground_;  // of the last update
};

}  // namespace terrane::adapters
