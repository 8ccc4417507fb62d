// SPDX-License-Identifier: MIT
//
// Heights of many points. Points are answered in blocks: first the cells of a block are found and their samples
// requested from memory (prefetch), then the heights are computed, so that the accesses of a block overlap. Sorting
// scattered points by chunk was measured and does not pay: it only moves the scattered accesses from samples to points
// and answers (docs/batch.md).
#include "batch/array_checks.h"
#include "batch/ground_batch_state.h"
#include "ground/cell_height.h"
#include "ground/cell_lines.h"

#include <algorithm>
#include <array>
#include <limits>

namespace terrane {
namespace {

/// Points whose samples are requested together.
constexpr std::size_t kBlock = 64;
/// Least points of a slice.
constexpr std::size_t kLeastPoints = 1024;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

void write(const HeightArrays& out, std::size_t i, const HeightAnswer& answer) {
    const bool is_ok = answer.status == GroundStatus::ok;
    if (!out.heights.empty()) out.heights[i] = is_ok ? answer.height : kNaN;
    if (!out.normals.empty()) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            out.normals[3 * i + axis] =
                is_ok ? answer.normal[static_cast<Eigen::Index>(axis)] : kNaN;
        }
    }
    if (!out.errors_m.empty()) out.errors_m[i] = is_ok ? answer.error_m : kNaN;
    if (!out.statuses.empty()) out.statuses[i] = answer.status;
    if (!out.filled.empty()) out.filled[i] = static_cast<std::uint8_t>(is_ok && answer.filled);
}

}  // namespace

/// Blocks of one thread.
class GroundBatch::HeightBlocks {
public:
    HeightBlocks(const Ground& ground, const PointArray& points, const HeightArrays& out,
                 internal::ChunkTable& table, std::uint64_t call)
        : ground_(ground), points_(points), out_(out), table_(table), call_(call) {}

    void answer(std::size_t begin, std::size_t end) {
        for (std::size_t first = begin; first < end; first += kBlock) {
            const std::size_t count = std::min(kBlock, end - first);
            for (std::size_t k = 0; k < count; ++k) {
                const std::size_t at = (first + k) * points_.stride;
                block_[k] = find(points_.x[at], points_.y[at]);
            }
            compute(first, count);
        }
    }

private:
    struct Point {
        const std::int32_t* south_west;  // sample; null: the point is answered by itself
        const float* bound;
        double x, y;  // metres from the cell's south-west corner
        bool cut_to_north_east, is_filled;
    };

    Point find(double x, double y) {
        Point point{};
        if (!ground_.extent_.contains(x, y)) return point;
        const std::int64_t column = ground_.columns_.last_up_to(x);
        const std::int64_t row = ground_.rows_.last_up_to(y);
        if (!ground_.is_in_extent(column, row)) return point;
        const internal::ChunkEntry& chunk = chunk_of(column, row);
        if (chunk.heights == nullptr) return point;
        const auto i = static_cast<int>(column & (kChunkCells - 1));
        const auto j = static_cast<int>(row & (kChunkCells - 1));
        const std::size_t cell = cell_index(i, j);
        if (chunk.cell_flags != nullptr) {
            const std::uint8_t flags = chunk.cell_flags[cell];
            if ((flags & cell_outside) != 0) return point;
            point.is_filled = (flags & cell_filled) != 0;
        }
        point.south_west = chunk.heights + sample_index(i, j);
        point.bound = chunk.cell_bounds + cell;
        point.x = x - ground_.columns_.at(column);
        point.y = y - ground_.rows_.at(row);
        point.cut_to_north_east = cut_to_north_east(column, row);
        __builtin_prefetch(point.south_west);
        __builtin_prefetch(point.south_west + kChunkSamples);
        if (!out_.errors_m.empty()) __builtin_prefetch(point.bound);
        return point;
    }

    const internal::ChunkEntry& chunk_of(std::int64_t column, std::int64_t row) {
        const std::int64_t chunk_column = column >> kChunkShift, chunk_row = row >> kChunkShift;
        internal::ChunkEntry& entry = table_.at(chunk_column, chunk_row);
        if (entry.call == call_ && entry.column == chunk_column && entry.row == chunk_row) {
            return entry;
        }
        entry = {.column = chunk_column, .row = chunk_row, .call = call_};
        const Chunk* const chunk = ground_.find_chunk(column, row);
        if (chunk == nullptr || chunk->solid != nullptr) return entry;
        entry.heights = chunk->heights.data();
        entry.cell_bounds = chunk->cell_bounds.data();
        entry.cell_flags = chunk->cell_flags.empty() ? nullptr : chunk->cell_flags.data();
        return entry;
    }

    void compute(std::size_t first, std::size_t count) {
        const double spacing = ground_.spacing_, quantum = ground_.quantum_;
        for (std::size_t k = 0; k < count; ++k) {
            const Point& point = block_[k];
            const std::size_t i = first + k;
            if (point.south_west == nullptr) {
                const std::size_t at = i * points_.stride;
                write(out_, i, ground_.height(points_.x[at], points_.y[at]));
                continue;
            }
            const internal::CellHeight found = internal::height_in_cell(
                point.south_west, std::min(1.0, point.x / spacing),
                std::min(1.0, point.y / spacing), point.cut_to_north_east, quantum);
            if (!out_.heights.empty()) out_.heights[i] = found.height;
            if (!out_.normals.empty()) {
                const Eigen::Vector3d normal = found.normal(spacing);
                std::copy_n(normal.data(), 3, &out_.normals[3 * i]);
            }
            if (!out_.errors_m.empty()) out_.errors_m[i] = static_cast<double>(*point.bound);
            if (!out_.statuses.empty()) out_.statuses[i] = GroundStatus::ok;
            if (!out_.filled.empty()) out_.filled[i] = static_cast<std::uint8_t>(point.is_filled);
        }
    }

    const Ground& ground_;
    const PointArray& points_;
    const HeightArrays& out_;
    internal::ChunkTable& table_;
    const std::uint64_t call_;
    std::array<Point, kBlock> block_;
};

Result<void> GroundBatch::heights(const Ground& ground, const PointArray& points_world,
                                  const HeightArrays& out) {
    const std::size_t count = points_world.count;
    if (auto ok = internal::check_points("points_world", points_world, false); !ok) return ok;
    if (auto ok = internal::check_length("heights", out.heights.size(), count); !ok) return ok;
    if (auto ok = internal::check_length("normals", out.normals.size(), count, 3); !ok) return ok;
    if (auto ok = internal::check_length("errors_m", out.errors_m.size(), count); !ok) return ok;
    if (auto ok = internal::check_length("statuses", out.statuses.size(), count); !ok) return ok;
    if (auto ok = internal::check_length("filled", out.filled.size(), count); !ok) return ok;
    ++state_->call;
    state_->run_slices(
        count, kLeastPoints, [&](std::size_t begin, std::size_t end, State::Worker& worker) {
            HeightBlocks(ground, points_world, out, worker.table, state_->call).answer(begin, end);
        });
    return {};
}

}  // namespace terrane
