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

/// How far a window moves when a box comes too close to its edge.
enum class WindowMove {
    least,   ///< by as few cells as needed: small moves, often. For users of the wrapped arrays
    centre,  ///< until the boxes are in its middle: large moves, rarely. For users who copy all of it after a move
};

/// Settings of a GroundWindow.
struct GroundWindowSettings {
    std::int32_t columns = 255;  ///< cells from west to east, 1 to kMostWindowCells
    std::int32_t rows = 255;     ///< cells from south to north, 1 to kMostWindowCells
    /// The window moves when a box is closer to its edge than this many cells, 0 to 1024, less than half of columns
    /// and rows.
    std::int32_t margin = 8;
    double base = 0.0;  ///< world z that heights are relative to, metres, within +-kMostHeight
    /// What a sample holds that no cell of ground touches, metres relative to base, finite: 0 is world z = base.
    double absent_height = 0.0;
    WindowHeights heights = WindowHeights::floats;  ///< which arrays there are
    WindowMove move = WindowMove::least;            ///< how far it moves
};

/// Most cells along a side of a window.
inline constexpr std::int32_t kMostWindowCells = 8191;

/// Bits of a cell of a window. No bit: no ground there, GroundStatus::outside.
enum WindowCellBit : std::uint8_t {
    window_ground = 1,  ///< ground and resident
    window_absent = 2,  ///< GroundStatus::not_resident: ground, but its chunk is absent
    window_south_replaced =
        4,  ///< volumes replace its southern triangle: see SolidSurface::is_replaced()
    window_north_replaced = 8,  ///< its northern one
};

/// A rectangle of samples, columns and rows of the contact level counted from lattice point (0, 0), ends included.
struct SampleRect {
    std::int64_t west = 0, south = 0, east = -1, north = -1;  ///< first and last column and row
    /// Whether it has no samples.
    bool is_empty() const { return west > east || south > north; }
    bool operator==(const SampleRect&) const = default;
};

/// What an update of a window did.
struct WindowUpdate {
    bool has_moved = false;  ///< cells() is another rectangle than before
    /// The accepted boxes lie in the window as far as they lie in the extent; false if there was none.
    bool covers_boxes = false;
    int refused_boxes = 0;          ///< boxes that were not finite or had low > high: ignored
    std::int64_t read_samples = 0;  ///< samples that were read
};

/// The samples of a rectangle of the contact surface around moving boxes, as arrays: for engines that want heights in
/// memory of their own. It has a fixed number of cells, moves by whole cells, and reads only what entered or changed.
///
/// The arrays are wrapped (a torus): the sample at column c and row r is at index_of(c, r), wherever the window is, so
/// that a move copies nothing. copy_heights() and copy_cells() write plain row-major rectangles.
///
/// Absent ground is never filled by a guess: a cell says whether it is ground, absent or outside, and a sample that no
/// cell of resident ground touches, inside the window or beside it, is absent_height.
///
/// Volumes: heights are of the heightfield; cells say which of its triangles volumes replace, and Ground::solid() has
/// the triangles in their place.
///
/// Threads: one, or any number of readers between updates. It holds the ground of the last update(), and so its chunks.
class GroundWindow {
public:
    /// Memory: 1 byte and 4 (floats), 8 or 12 bytes for each entry of the arrays, which have (columns + 1) and
    ///         (rows + 1) entries along their sides, each rounded up to a power of two
    ///
    /// Fails: invalid_argument, naming the field and its value; out_of_memory
    static Result<GroundWindow> create(const GroundWindowSettings& settings);

    /// Moves the window to the boxes, and reads what entered it or changed since the last update: rows and columns that
    /// a move uncovered, and the parts of chunks that came, went or were replaced (Ground::has_same_cells). Another
    /// lattice, extent or level: everything.
    ///
    /// The boxes' horizontal sides matter, clamped to the extent. Where they do not fit with their margin, the window
    /// is centred on the rectangle around them, and covers_boxes says whether they are inside. Without a valid box it
    /// stays; before the first one it has no cells.
    ///
    /// Allocates: where the list of changes grows
    /// Cost:      O(samples read + chunks in the window)
    WindowUpdate update(const Ground& ground, std::span<const Aabb> boxes_world);
    /// As update() with one box.
    WindowUpdate update(const Ground& ground, const Aabb& box_world) {
        return update(ground, std::span<const Aabb>(&box_world, 1));
    }
    /// Changes the base; the next update() reads everything. Requires base within +-kMostHeight.
    void set_base(double base);

    /// As they were given; with the base of set_base().
    const GroundWindowSettings& settings() const { return settings_; }
    /// The cells of the window; empty (west > east) before the first box.
    const CellRange& cells() const { return cells_; }
    /// The corners of cells().
    SampleRect samples() const;
    /// The ground of the last update(), or null.
    const Ground* ground() const { return ground_ ? &*ground_ : nullptr; }

    /// Rectangles that hold every sample whose height changed in the last update(), and a corner of every cell whose
    /// bits did, those that entered included. They may overlap, and may hold samples that did not change. Empty:
    /// nothing changed. Valid until the next update().
    std::span<const SampleRect> changed() const { return changed_; }

    /// Whether a sample, a cell lies in the window.
    bool has_sample(std::int64_t column, std::int64_t row) const {
        return column >= cells_.west && column <= cells_.east + 1 && row >= cells_.south &&
               row <= cells_.north + 1 && cells_.west <= cells_.east;
    }
    /// The same of a cell.
    bool has_cell(std::int64_t column, std::int64_t row) const {
        return column >= cells_.west && column <= cells_.east && row >= cells_.south &&
               row <= cells_.north;
    }
    /// Index of a sample, or of the cell north-east of it, in the arrays. Requires has_sample() or has_cell().
    std::size_t index_of(std::int64_t column, std::int64_t row) const {
        return (static_cast<std::size_t>(row) & row_mask_) * stride() +
               (static_cast<std::size_t>(column) & column_mask_);
    }
    /// Entries of a row of the arrays, a power of two.
    std::size_t stride() const { return column_mask_ + 1; }
    /// Rows of the arrays, a power of two.
    std::size_t stored_rows() const { return row_mask_ + 1; }

    /// [stride() * stored_rows()] heights of samples, metres relative to settings().base: of doubles, the difference
    /// rounded once; of floats, that rounded once more. Empty where the settings do not ask for them. Entries outside
    /// the window are undefined.
    std::span<const float> floats() const { return floats_; }
    /// See floats().
    std::span<const double> doubles() const { return doubles_; }
    /// [stride() * stored_rows()] WindowCellBit of cells.
    std::span<const std::uint8_t> cell_bits() const { return bits_; }

    /// Copies heights row by row from the south-west. Requires a rectangle in samples(), the array in
    /// settings().heights, and room for the rectangle.
    void copy_heights(const SampleRect& rect, std::span<float> heights_out) const;
    void copy_heights(const SampleRect& rect, std::span<double> heights_out) const;
    /// Copies bits of cells. Requires a range in cells(), and room for it.
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
    bool is_stale_ = true;          // nothing that is held can be kept
    std::vector<float> floats_;
    std::vector<double> doubles_;
    std::vector<std::uint8_t> bits_;
    std::vector<SampleRect> changed_;
    std::int64_t read_count_ = 0;
};

}  // namespace terrane
