// SPDX-License-Identifier: MIT
#pragma once

// Shared by the adapters for engines with a built-in height field (MuJoCo, DART). Copies the heights of a GroundWindow
// into one row-major array, flags the samples of resident ground, and counts the bodies' boxes that have no ground
// below them or lie over volumes.
//
// Units: metres. Frames: `_sim` is the simulator's, the world's axes with the origin at origin_world; heights are world
// z. Layout: rows south to north, columns west to east. Threads: one at a time.

#include <terrane/adapters/surface_point.h>
#include <terrane/base/math.h>
#include <terrane/terrain/ground_window.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace terrane::adapters {

/// Counts of boxes without ground below them, and of boxes over volumes.
struct BoxSupport {
    int unsupported = 0;   ///< not finite, or over a cell without ground or not in the window
    int over_volumes = 0;  ///< over a cell that volumes replace
};

/// A rectangle of ground heights that follows boxes; its number of cells is fixed.
class FieldWindow {
public:
    /// @param columns, rows numbers of cells
    /// @param margin        as in GroundWindowSettings
    /// @param origin_world  of the simulator's frame, within 2^40 m
    ///
    /// Fails: invalid_argument, naming the field and its value; out_of_memory
    static Result<FieldWindow> create(std::int64_t columns, std::int64_t rows, std::int32_t margin,
                                      const WorldPos& origin_world) {
        Pose frame;
        frame.translation = origin_world;
        if (!check_frame(frame)) {
            return fail(ErrorCode::invalid_argument,
                        "origin_world must be finite and within 2^40 m");
        }
        const auto clamped = [](std::int64_t cells) {  // values out of range remain so
            return static_cast<std::int32_t>(std::clamp<std::int64_t>(cells, 0, 1 << 30));
        };
        GroundWindowSettings settings;
        settings.columns = clamped(columns);
        settings.rows = clamped(rows);
        settings.margin = margin;
        settings.heights = WindowHeights::doubles;
        settings.move = WindowMove::centre;
        TERRANE_TRY(GroundWindow window, GroundWindow::create(settings));
        return FieldWindow(std::move(window), origin_world);
    }

    /// Moves the window to the boxes (simulator's frame) and reads changed samples. Ignores boxes that are not finite.
    ///
    /// Returns: whether heights() changed; false before the first valid box
    bool update(const Ground& ground, std::span<const Aabb> boxes_sim) {
        boxes_world_.clear();
        for (const Aabb& box : boxes_sim) {
            boxes_world_.push_back({box.low + origin_world_, box.high + origin_world_});
        }
        const WindowUpdate moved = window_.update(ground, boxes_world_);
        covers_boxes_ = moved.covers_boxes;
        if (is_empty() || (is_read_ && !moved.has_moved && window_.changed().empty())) return false;
        is_read_ = true;
        window_.copy_heights(window_.samples(), heights_);
        window_.copy_cells(window_.cells(), bits_);
        measure();
        return true;
    }

    /// True before the first valid box.
    bool is_empty() const { return window_.cells().west > window_.cells().east; }
    /// Whether all boxes of the last update() lie in the window.
    bool covers_boxes() const { return covers_boxes_; }
    /// Whether any cell is resident ground.
    bool has_ground() const { return has_ground_; }
    /// Number of cells that are not resident ground.
    std::int64_t absent_cells() const { return absent_cells_; }
    /// Lowest sample of ground, world z; 0 without ground.
    double low() const { return low_; }
    double high() const { return high_; }  ///< highest sample; see low()
    /// [(columns + 1) * (rows + 1)] world z; undefined where is_ground() is 0.
    std::span<const double> heights() const { return heights_; }
    /// [(columns + 1) * (rows + 1)] 1 if a cell of resident ground touches the sample.
    std::span<const std::uint8_t> is_ground() const { return is_ground_; }
    /// Largest vertical distance between the contact surface and a surface that splits every cell along the south-west
    /// to north-east diagonal.
    double twist_to_north_east() const { return twist_to_north_east_; }
    double twist() const { return twist_; }  ///< as above, for any choice of diagonals
    /// The underlying window of samples and cells.
    const GroundWindow& window() const { return window_; }

    /// The window's centre at a given world z, simulator's frame.
    Eigen::Vector3d middle_sim(const Ground& ground, double z_world) const {
        const CellRange& cells = window_.cells();
        const WorldPos p_world(
            0.5 * ground.cell_x(cells.west) + 0.5 * ground.cell_x(cells.east + 1),
            0.5 * ground.cell_y(cells.south) + 0.5 * ground.cell_y(cells.north + 1), z_world);
        return p_world - origin_world_;
    }

    /// Counts the boxes of the last update() without ground or over volumes.
    BoxSupport support(const Ground& ground) const {
        BoxSupport result;
        for (const Aabb& box : boxes_world_) {
            bool is_over_volume = false;
            if (!is_supported(ground, box, is_over_volume)) ++result.unsupported;
            if (is_over_volume) ++result.over_volumes;
        }
        return result;
    }

private:
    FieldWindow(GroundWindow window, const WorldPos& origin_world)
        : window_(std::move(window)), origin_world_(origin_world) {
        const auto columns = static_cast<std::size_t>(window_.settings().columns);
        const auto rows = static_cast<std::size_t>(window_.settings().rows);
        heights_.resize((columns + 1) * (rows + 1));
        bits_.resize(columns * rows);
        is_ground_.resize(heights_.size());
    }

    void measure() {
        const std::int64_t columns = window_.settings().columns, rows = window_.settings().rows;
        std::fill(is_ground_.begin(), is_ground_.end(), std::uint8_t{0});
        absent_cells_ = 0;
        twist_ = twist_to_north_east_ = 0.0;
        for (std::int64_t row = 0; row < rows; ++row) {
            for (std::int64_t column = 0; column < columns; ++column) {
                if ((bits_[static_cast<std::size_t>(row * columns + column)] & window_ground) ==
                    0) {
                    ++absent_cells_;
                    continue;
                }
                const auto sw = static_cast<std::size_t>(row * (columns + 1) + column);
                const std::size_t nw = sw + static_cast<std::size_t>(columns) + 1;
                for (const std::size_t i : {sw, sw + 1, nw, nw + 1}) is_ground_[i] = 1;
                const double twist = 0.5 * std::abs((heights_[sw] - heights_[sw + 1]) -
                                                    (heights_[nw] - heights_[nw + 1]));
                twist_ = std::max(twist_, twist);
                if (!cut_to_north_east(window_.cells().west + column,
                                       window_.cells().south + row)) {
                    twist_to_north_east_ = std::max(twist_to_north_east_, twist);
                }
            }
        }
        has_ground_ = false;
        low_ = high_ = 0.0;
        for (std::size_t i = 0; i < heights_.size(); ++i) {
            if (is_ground_[i] == 0) continue;
            low_ = has_ground_ ? std::min(low_, heights_[i]) : heights_[i];
            high_ = has_ground_ ? std::max(high_, heights_[i]) : heights_[i];
            has_ground_ = true;
        }
    }

    bool is_supported(const Ground& ground, const Aabb& box, bool& is_over_volume) const {
        const auto is_near = [](const Eigen::Vector3d& p) {
            return p.cwiseAbs().maxCoeff() <= 0x1p42;
        };
        if (is_empty() || !is_near(box.low) || !is_near(box.high)) return false;
        const CellRange range{ground.column_at(box.low.x()), ground.row_at(box.low.y()),
                              ground.column_at(box.high.x()), ground.row_at(box.high.y())};
        if (!window_.has_cell(range.west, range.south) ||
            !window_.has_cell(range.east, range.north)) {
            return false;
        }
        bool is_all_ground = true;
        for (std::int64_t row = range.south; row <= range.north; ++row) {
            for (std::int64_t column = range.west; column <= range.east; ++column) {
                const std::uint8_t bits = window_.cell_bits()[window_.index_of(column, row)];
                if ((bits & window_ground) == 0) is_all_ground = false;
                if ((bits & (window_south_replaced | window_north_replaced)) != 0)
                    is_over_volume = true;
            }
        }
        return is_all_ground;
    }

    GroundWindow window_;
    WorldPos origin_world_;
    bool is_read_ = false, covers_boxes_ = false, has_ground_ = false;
    std::int64_t absent_cells_ = 0;
    double low_ = 0.0, high_ = 0.0, twist_ = 0.0, twist_to_north_east_ = 0.0;
    std::vector<double> heights_;
    std::vector<std::uint8_t> bits_, is_ground_;
    std::vector<Aabb> boxes_world_;
};

}  // namespace terrane::adapters
