// SPDX-License-Identifier: MIT
//
// A toroidal array of heights, like one level of a geometry clipmap.
// Source: F. Losasso, H. Hoppe. Geometry clipmaps: terrain rendering using nested regular grids. ACM TOG 23(3), 2004.
// Deviations: one level; chunks arrive and are evicted; samples may have no height.
#include "base/settings_check.h"

#include <terrane/base/result.h>
#include <terrane/terrain/ground_window.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <new>
#include <utility>

namespace terrane {
namespace {

constexpr std::int32_t kMostMargin = 1024;

// First cell of the window along one axis. low and high: range of cells under the boxes.
std::int64_t first_cell(std::int64_t low, std::int64_t high, std::int64_t count,
                        std::int64_t margin, std::optional<std::int64_t> before, WindowMove move) {
    const std::int64_t size = high - low + 1;
    const std::int64_t centred = low - ((count - size) >> 1);
    if (!before || size + 2 * margin > count) return centred;
    const std::int64_t least = high + margin - count + 1, most = low - margin;
    if (*before >= least && *before <= most) return *before;
    return move == WindowMove::centre ? centred : std::clamp(*before, least, most);
}

bool is_valid(const Aabb& box) {
    return box.low.allFinite() && box.high.allFinite() &&
           (box.low.array() <= box.high.array()).all();
}

// The cells of the extent under a box; for a box beyond it, the nearest ones.
CellRange cells_under(const Ground& ground, const Aabb& box) {
    const WorldRect& extent = ground.extent();
    const auto column = [&](double x) {
        return ground.column_at(std::clamp(x, extent.west, extent.east));
    };
    const auto row = [&](double y) {
        return ground.row_at(std::clamp(y, extent.south, extent.north));
    };
    return {column(box.low.x()), row(box.low.y()), column(box.high.x()), row(box.high.y())};
}

SampleRect overlap_of(const SampleRect& a, const SampleRect& b) {
    return {std::max(a.west, b.west), std::max(a.south, b.south), std::min(a.east, b.east),
            std::min(a.north, b.north)};
}

}  // namespace

Result<GroundWindow> GroundWindow::create(const GroundWindowSettings& settings) {
    TERRANE_TRY(check_range("columns", settings.columns, 1, kMostWindowCells));
    TERRANE_TRY(check_range("rows", settings.rows, 1, kMostWindowCells));
    const std::int32_t most = (std::min(settings.columns, settings.rows) - 1) / 2;
    TERRANE_TRY(check_range("margin", settings.margin, 0, std::min(kMostMargin, most)));
    TERRANE_TRY(check_range("base", settings.base, -kMostHeight, kMostHeight));
    TERRANE_TRY(check_range("absent_height", settings.absent_height, -kMostHeight, kMostHeight));
    try {
        return GroundWindow(settings);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::out_of_memory, "no memory for a window of " +
                                                  number_text(settings.columns) + " x " +
                                                  number_text(settings.rows) + " cells");
    }
}

GroundWindow::GroundWindow(const GroundWindowSettings& settings) : settings_(settings) {
    column_mask_ = std::bit_ceil(static_cast<std::size_t>(settings.columns) + 1) - 1;
    row_mask_ = std::bit_ceil(static_cast<std::size_t>(settings.rows) + 1) - 1;
    const std::size_t size = stride() * stored_rows();
    if (settings.heights != WindowHeights::doubles) floats_.resize(size);
    if (settings.heights != WindowHeights::floats) doubles_.resize(size);
    bits_.resize(size);
}

void GroundWindow::set_base(double base) {
    TERRANE_ASSERT(base >= -kMostHeight && base <= kMostHeight, "base must be a height");
    settings_.base = base;
    is_stale_ = true;
}

SampleRect GroundWindow::samples() const {
    if (cells_.west > cells_.east) return {};
    return {cells_.west, cells_.south, cells_.east + 1, cells_.north + 1};
}

WindowUpdate GroundWindow::update(const Ground& ground, std::span<const Aabb> boxes_world) {
    WindowUpdate update;
    changed_.clear();
    read_count_ = 0;
    const bool is_same_world = ground_ && ground_->level() == ground.level() &&
                               ground_->lattice() == ground.lattice() &&
                               ground_->extent() == ground.extent();
    if (!is_same_world) cells_ = {};  // the indices refer to other places
    const std::optional<Ground> last = std::exchange(ground_, ground);
    const SampleRect before = is_stale_ || !is_same_world ? SampleRect{} : samples();
    update.has_moved = place(ground, boxes_world, update);
    const SampleRect now = samples();
    if (!now.is_empty()) {
        GroundReader reader(*ground_);
        const SampleRect kept = overlap_of(before, now);
        if (before.is_empty() || kept.is_empty()) {
            read(reader, now);
        } else {
            read_entered(reader, kept);
            read_changed_chunks(reader, *last, kept);
        }
        is_stale_ = false;
    }
    update.read_samples = read_count_;
    return update;
}

bool GroundWindow::place(const Ground& ground, std::span<const Aabb> boxes_world,
                         WindowUpdate& update) {
    std::optional<CellRange> wanted;
    for (const Aabb& box : boxes_world) {
        if (!is_valid(box)) {
            ++update.refused_boxes;
            continue;
        }
        const CellRange cells = cells_under(ground, box);
        if (!wanted) wanted = cells;
        wanted = {std::min(wanted->west, cells.west), std::min(wanted->south, cells.south),
                  std::max(wanted->east, cells.east), std::max(wanted->north, cells.north)};
    }
    if (!wanted) return false;
    const bool has_place = cells_.west <= cells_.east;
    const auto before = [&](std::int64_t first) {
        return has_place ? std::optional(first) : std::nullopt;
    };
    const std::int64_t west = first_cell(wanted->west, wanted->east, settings_.columns,
                                         settings_.margin, before(cells_.west), settings_.move);
    const std::int64_t south = first_cell(wanted->south, wanted->north, settings_.rows,
                                          settings_.margin, before(cells_.south), settings_.move);
    const CellRange placed{west, south, west + settings_.columns - 1, south + settings_.rows - 1};
    update.covers_boxes = wanted->west >= placed.west && wanted->east <= placed.east &&
                          wanted->south >= placed.south && wanted->north <= placed.north;
    return !(std::exchange(cells_, placed) == placed);
}

// Reads the samples of the window outside the kept rectangle: full-height columns first.
void GroundWindow::read_entered(GroundReader& reader, const SampleRect& kept) {
    const SampleRect now = samples();
    read(reader, {now.west, now.south, kept.west - 1, now.north});
    read(reader, {kept.east + 1, now.south, now.east, now.north});
    read(reader, {kept.west, now.south, kept.east, kept.south - 1});
    read(reader, {kept.west, kept.north + 1, kept.east, now.north});
}

// Rereads changed chunks, also those next to the kept samples: a sample's height depends on the four cells around it.
void GroundWindow::read_changed_chunks(GroundReader& reader, const Ground& last,
                                       const SampleRect& kept) {
    const CellRange around{kept.west - 1, kept.south - 1, kept.east, kept.north};
    if (ground_->has_same_cells(last, around)) return;
    GroundReader last_reader(last);
    constexpr int kLog2Side = SamplePyramid::kCoarsest;
    for (std::int64_t row = around.south & -kChunkCells; row <= around.north; row += kChunkCells) {
        for (std::int64_t column = around.west & -kChunkCells; column <= around.east;
             column += kChunkCells) {
            const bool is_resident =
                reader.square(column, row, kLog2Side).status == QueryStatus::ok;
            const bool was_resident =
                last_reader.square(column, row, kLog2Side).status == QueryStatus::ok;
            if (!is_resident && !was_resident) continue;
            if (ground_->has_same_cells(last, {column, row, column, row})) continue;
            read(reader, overlap_of(kept, {column, row, column + kChunkCells, row + kChunkCells}));
        }
    }
}

// Reads a rectangle of samples, and the bits of the cells that have a corner in the rectangle.
void GroundWindow::read(GroundReader& reader, const SampleRect& rect) {
    if (rect.is_empty()) return;
    changed_.push_back(rect);
    read_count_ += (rect.east - rect.west + 1) * (rect.north - rect.south + 1);
    constexpr std::int64_t kSide = 31;  // samples: GroundReader reads 32 cells at once
    for (std::int64_t south = rect.south; south <= rect.north; south += kSide) {
        for (std::int64_t west = rect.west; west <= rect.east; west += kSide) {
            read_square(reader, {west, south, std::min(west + kSide - 1, rect.east),
                                 std::min(south + kSide - 1, rect.north)});
        }
    }
    if (!ground_->has_solids()) return;
    mark_replaced({std::max(rect.west - 1, cells_.west), std::max(rect.south - 1, cells_.south),
                   std::min(rect.east, cells_.east), std::min(rect.north, cells_.north)});
}

// As read(), for at most 31 x 31 samples, and without flags of volumes.
void GroundWindow::read_square(GroundReader& reader, const SampleRect& rect) {
    constexpr std::size_t kStride = 33;
    std::array<std::int32_t, kStride * kStride> quanta;
    std::array<std::uint32_t, kStride> ground_bits;
    const CellRange around{rect.west - 1, rect.south - 1, rect.east, rect.north};
    reader.heights(around, kStride, quanta, ground_bits);
    const double quantum = ground_->lattice().quantum;
    for (std::int64_t row = around.south; row <= around.north; ++row) {
        const auto j = static_cast<std::size_t>(row - around.south);
        const std::uint32_t here = ground_bits[j];
        // one bit per sample: whether a ground cell has it as a corner
        const std::uint64_t rows_bits = here | (j > 0 ? ground_bits[j - 1] : 0u);
        const std::uint64_t touched = rows_bits | (rows_bits << 1);
        for (std::int64_t column = around.west; column <= around.east; ++column) {
            const auto i = static_cast<std::size_t>(column - around.west);
            if (has_cell(column, row)) {
                std::uint8_t bits = window_ground;
                if ((here >> i & 1u) == 0) {
                    const QueryStatus status = reader.cell(column, row).status;
                    bits = status == QueryStatus::not_resident ? window_absent : 0;
                }
                bits_[index_of(column, row)] = bits;
            }
            if (i == 0 || j == 0) continue;
            const std::size_t index = index_of(column, row);
            const double height = (touched >> i & 1u) != 0
                                      ? quanta[j * kStride + i] * quantum - settings_.base
                                      : settings_.absent_height;
            if (!floats_.empty()) floats_[index] = static_cast<float>(height);
            if (!doubles_.empty()) doubles_[index] = height;
        }
    }
}

void GroundWindow::mark_replaced(const CellRange& cells) {
    const SolidSurface* solid = nullptr;
    for (std::int64_t row = cells.south; row <= cells.north; ++row) {
        for (std::int64_t column = cells.west; column <= cells.east; ++column) {
            std::uint8_t& bits = bits_[index_of(column, row)];
            const auto i = static_cast<int>(column & (kChunkCells - 1));
            const auto j = static_cast<int>(row & (kChunkCells - 1));
            if (column == cells.west || i == 0) solid = ground_->solid(column, row);
            if (solid == nullptr || (bits & window_ground) == 0) continue;
            const std::size_t cell = cell_index(i, j);
            if (solid->is_replaced(cell, false)) bits |= window_south_replaced;
            if (solid->is_replaced(cell, true)) bits |= window_north_replaced;
        }
    }
}

namespace {

// Copies entries of a wrapped array row by row.
template <class From, class To>
void copy_wrapped(const GroundWindow& window, std::span<const From> from, const SampleRect& rect,
                  std::span<To> out) {
    std::size_t next = 0;
    for (std::int64_t row = rect.south; row <= rect.north; ++row) {
        for (std::int64_t column = rect.west; column <= rect.east; ++column) {
            out[next++] = static_cast<To>(from[window.index_of(column, row)]);
        }
    }
}

[[maybe_unused]] bool is_inside(const SampleRect& rect, const SampleRect& all) {
    return rect.is_empty() || (rect.west >= all.west && rect.east <= all.east &&
                               rect.south >= all.south && rect.north <= all.north);
}

[[maybe_unused]] std::size_t size_of(const SampleRect& rect) {
    if (rect.is_empty()) return 0;
    return static_cast<std::size_t>(rect.east - rect.west + 1) *
           static_cast<std::size_t>(rect.north - rect.south + 1);
}

}  // namespace

void GroundWindow::copy_heights(const SampleRect& rect, std::span<float> heights_out) const {
    TERRANE_ASSERT(is_inside(rect, samples()), "a copy of heights must lie in the window");
    TERRANE_ASSERT(heights_out.size() >= size_of(rect), "a copy of heights needs room");
    TERRANE_ASSERT(!floats_.empty(), "the window holds no floats");
    copy_wrapped(*this, floats(), rect, heights_out);
}

void GroundWindow::copy_heights(const SampleRect& rect, std::span<double> heights_out) const {
    TERRANE_ASSERT(is_inside(rect, samples()), "a copy of heights must lie in the window");
    TERRANE_ASSERT(heights_out.size() >= size_of(rect), "a copy of heights needs room");
    TERRANE_ASSERT(!doubles_.empty(), "the window holds no doubles");
    copy_wrapped(*this, doubles(), rect, heights_out);
}

void GroundWindow::copy_cells(const CellRange& range, std::span<std::uint8_t> bits_out) const {
    const SampleRect rect{range.west, range.south, range.east, range.north};
    [[maybe_unused]] const SampleRect all{cells_.west, cells_.south, cells_.east, cells_.north};
    TERRANE_ASSERT(is_inside(rect, all), "a copy of cells must lie in the window");
    TERRANE_ASSERT(bits_out.size() >= size_of(rect), "a copy of cells needs room");
    copy_wrapped(*this, cell_bits(), rect, bits_out);
}

}  // namespace terrane
