// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/terrain/ground.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane {

/// Which arrays of heights a window holds.
enum class WindowHeights {
    floats,   ///< float
    doubles,  ///< double
    both,
};

/// How far a window moves when a box gets too close to its edge.
enum class WindowMove {
    least,  ///< by as few cells as needed: frequent small moves, for readers of the wrapped arrays
    centre,  ///< until the boxes are centred: rare large moves, for readers who copy everything after a move
};

/// Settings of a GroundWindow.
struct GroundWindowSettings {
    std::int32_t columns = 255;  ///< cells from west to east, 1 to kMostWindowCells
    std::int32_t rows = 255;     ///< cells from south to north, 1 to kMostWindowCells
    /// The window moves if fewer cells than this lie between a box and the window's edge. 0 to 1024, less than half of
    /// columns and rows.
    std::int32_t margin = 8;
    double base = 0.0;  ///< world z of height 0, metres, within +-kMostHeight
    /// Height of samples that no cell of ground touches, metres relative to base, finite.
    double absent_height = 0.0;
    WindowHeights heights = WindowHeights::floats;  ///< arrays to hold
    WindowMove move = WindowMove::least;            ///< size of moves
};

/// Most cells along a side of a window.
inline constexpr std::int32_t kMostWindowCells = 8191;

/// Flags of a window's cell. No flag: no ground, QueryStatus::outside.
enum WindowCellBit : std::uint8_t {
    window_ground = 1,  ///< ground and resident
    window_absent = 2,  ///< ground whose chunk is absent: QueryStatus::not_resident
    window_south_replaced =
        4,  ///< volumes replace its southern triangle: see SolidSurface::is_replaced()
    window_north_replaced = 8,  ///< as above, northern triangle
};

/// A rectangle of samples of the contact level; columns and rows count from lattice point (0, 0), ends included.
struct SampleRect {
    std::int64_t west = 0, south = 0, east = -1, north = -1;  ///< first and last column and row
    /// Whether it has no samples.
    bool is_empty() const { return west > east || south > north; }
    bool operator==(const SampleRect&) const = default;
};

/// What an update of a window did.
struct WindowUpdate {
    bool has_moved = false;  ///< cells() has changed
    /// Whether all accepted boxes, clipped to the extent, lie in the window; false if there was none.
    bool covers_boxes = false;
    int refused_boxes = 0;  ///< boxes ignored because they were not finite or had low > high
    std::int64_t read_samples = 0;  ///< samples that were read
};

/// Arrays of contact-surface samples in a rectangle that follows moving boxes, for engines that keep heights in their
/// own memory. The window has a fixed number of cells, moves by whole cells, and reads only samples that entered or
/// changed.
///
/// The arrays wrap around (toroidal addressing): the sample at column c and row r is at index_of(c, r) wherever the
/// window is, so a move copies nothing. copy_heights() and copy_cells() write plain row-major rectangles.
///
/// Absent ground is never filled in: each cell is flagged as ground, absent or outside. Samples that belong to no
/// resident cell, inside or next to the window, hold absent_height.
///
/// Volumes: heights are those of the heightfield. Cell flags tell which triangles of the heightfield volumes replace;
/// Ground::solid() has the replacing triangles.
///
/// Threads: one; any number of readers between updates. Keeps the ground of the last update() and thereby its chunks
///          alive.
class GroundWindow {
public:
    /// Memory: per entry of the arrays, 1 byte of flags and 4 (floats), 8 (doubles) or 12 bytes (both) of heights. The
    ///         arrays have (columns + 1) and (rows + 1) entries along their sides, each rounded up to a power of two
    ///
    /// Fails: invalid_argument, naming the field and its value; out_of_memory
    static Result<GroundWindow> create(const GroundWindowSettings& settings);

    /// Moves the window to the boxes and reads the samples that entered or changed since the last update: rows and
    /// columns uncovered by a move, and parts of chunks that arrived, were evicted or were replaced
    /// (Ground::has_same_cells). After a change of lattice, extent or level it reads everything.
    ///
    /// Only the horizontal extents of the boxes count, clamped to the extent of the ground. If they do not fit with
    /// their margin, the window is centred on their bounding rectangle, and covers_boxes tells whether the boxes are
    /// inside. Without a valid box the window stays; before the first valid box it has no cells.
    ///
    /// Allocates: when the list of changes grows
    /// Cost:      O(samples read + chunks in the window)
    WindowUpdate update(const Ground& ground, std::span<const Aabb> boxes_world);
    /// As update() with one box.
    WindowUpdate update(const Ground& ground, const Aabb& box_world) {
        return update(ground, std::span<const Aabb>(&box_world, 1));
    }
    /// Changes the base; the next update() then reads everything. Requires base within +-kMostHeight.
    void set_base(double base);

    /// Settings as passed to create(), with the base of set_base().
    const GroundWindowSettings& settings() const { return settings_; }
    /// The cells of the window; empty (west > east) before the first box.
    const CellRange& cells() const { return cells_; }
    /// The samples at the corners of cells().
    SampleRect samples() const;
    /// The ground of the last update(), or null.
    const Ground* ground() const { return ground_ ? &*ground_ : nullptr; }

    /// Rectangles that contain every sample whose height changed in the last update(), and a corner of every cell whose
    /// flags changed; samples and cells that entered count as changed. They may overlap and may contain unchanged
    /// samples; empty if nothing changed. Valid until the next update().
    std::span<const SampleRect> changed() const { return changed_; }

    /// Whether a sample lies in the window.
    bool has_sample(std::int64_t column, std::int64_t row) const {
        return column >= cells_.west && column <= cells_.east + 1 && row >= cells_.south &&
               row <= cells_.north + 1 && cells_.west <= cells_.east;
    }
    /// Whether a cell lies in the window.
    bool has_cell(std::int64_t column, std::int64_t row) const {
        return column >= cells_.west && column <= cells_.east && row >= cells_.south &&
               row <= cells_.north;
    }
    /// Array index of a sample, or of the cell north-east of it. Requires has_sample() or has_cell().
    std::size_t index_of(std::int64_t column, std::int64_t row) const {
        return (static_cast<std::size_t>(row) & row_mask_) * stride() +
               (static_cast<std::size_t>(column) & column_mask_);
    }
    /// Entries per row of the arrays, a power of two.
    std::size_t stride() const { return column_mask_ + 1; }
    /// Rows of the arrays, a power of two.
    std::size_t stored_rows() const { return row_mask_ + 1; }

    /// [stride() * stored_rows()] sample heights, metres relative to settings().base. A double is this difference
    /// rounded once, a float is the double rounded once more. Empty unless requested in the settings; entries outside
    /// the window are undefined.
    std::span<const float> floats() const { return floats_; }
    /// See floats().
    std::span<const double> doubles() const { return doubles_; }
    /// [stride() * stored_rows()] WindowCellBit flags of cells.
    std::span<const std::uint8_t> cell_bits() const { return bits_; }

    /// Copies heights row by row from the south-west. Requires a rectangle in samples(), the array in
    /// settings().heights, and space for the rectangle.
    void copy_heights(const SampleRect& rect, std::span<float> heights_out) const;
    void copy_heights(const SampleRect& rect, std::span<double> heights_out) const;
    /// Copies cell flags. Requires a range in cells(), and space for it.
    void copy_cells(const CellRange& range, std::span<std::uint8_t> bits_out) const;

private:
    explicit GroundWindow(const GroundWindowSettings& settings);
    bool place(const Ground& ground, std::span<const Aabb> boxes_world, WindowUpdate& update);
    void read(GroundReader& reader, const SampleRect& rect);
    void read_square(GroundReader& reader, const SampleRect& rect);
    void mark_replaced(const CellRange& cells);
    void read_entered(GroundReader& reader, const SampleRect& kept);
    void read_changed_chunks(GroundReader& reader, const Ground& last, const SampleRect& kept);

    GroundWindowSettings settings_;
    std::size_t column_mask_ = 0, row_mask_ = 0;
    CellRange cells_;
    std::optional<Ground> ground_;  // of the last update
    bool is_stale_ = true;          // the next update must read everything
    std::vector<float> floats_;
    std::vector<double> doubles_;
    std::vector<std::uint8_t> bits_;
    std::vector<SampleRect> changed_;
    std::int64_t read_count_ = 0;
};

}  // namespace terrane
