// SPDX-License-Identifier: MIT
#include "ground/ground_batch.h"

#include "base/settings_check.h"
#include "ground/height_kernels.h"
#include "ground/ray_walk.h"

#include <terrane/terrain/ground_batch.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace terrane::internal {
namespace {

Result<void> check_coordinate(const char* name, const char* coordinate, const PointArray& points,
                              std::size_t length) {
    constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max();
    const std::size_t steps = points.count - 1;
    const bool is_countable = points.stride == 0 || steps <= (kMost - 1) / points.stride;
    const std::size_t least = is_countable ? steps * points.stride + 1 : kMost;
    if (length >= least) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + "." + coordinate + " must have at least " +
                    std::to_string(least) + " numbers for " + std::to_string(points.count) +
                    " points with stride " + std::to_string(points.stride) + ", has " +
                    std::to_string(length));
}

}  // namespace

Result<void> check_points(const char* name, const PointArray& points, bool has_heights) {
    if (points.count == 0) return {};
    TERRANE_TRY(check_coordinate(name, "x", points, points.x.size()));
    TERRANE_TRY(check_coordinate(name, "y", points, points.y.size()));
    return has_heights ? check_coordinate(name, "z", points, points.z.size()) : Result<void>{};
}

Result<void> check_length(const char* name, std::size_t length, std::size_t count,
                          std::size_t per_item) {
    if (length == 0 || (length % per_item == 0 && length / per_item == count)) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + " must be empty or have " + std::to_string(per_item) +
                    (per_item == 1 ? " entry" : " entries") + " for each of " +
                    std::to_string(count) + " items, has " + std::to_string(length));
}

}  // namespace terrane::internal

namespace terrane {
namespace {

// If the last point is incomplete, the count includes it, so that the length check fails.
PointArray interleaved(std::span<const double> numbers, std::size_t dimensions) {
    const auto from = [&](std::size_t first) {
        return numbers.subspan(std::min(first, numbers.size()));
    };
    PointArray points;
    points.count = numbers.size() / dimensions + (numbers.size() % dimensions != 0 ? 1 : 0);
    points.stride = dimensions;
    points.x = from(0);
    points.y = from(1);
    if (dimensions == 3) points.z = from(2);
    return points;
}

}  // namespace

PointArray PointArray::interleaved_xy(std::span<const double> numbers) {
    return interleaved(numbers, 2);
}

PointArray PointArray::interleaved_xyz(std::span<const double> numbers) {
    return interleaved(numbers, 3);
}

PointArray PointArray::separate(std::span<const double> x, std::span<const double> y,
                                std::span<const double> z) {
    return {.count = x.size(), .stride = 1, .x = x, .y = y, .z = z};
}

PointArray PointArray::repeated(const WorldPos& point_world, std::size_t count) {
    const std::span<const double> numbers(point_world.data(), 3);
    return {.count = count,
            .stride = 0,
            .x = numbers.subspan(0, 1),
            .y = numbers.subspan(1, 1),
            .z = numbers.subspan(2, 1)};
}

Result<GroundBatch> GroundBatch::create(const GroundBatchSettings& settings) {
    TERRANE_TRY(check_range("worker_count", settings.worker_count, 1, 64));
    return GroundBatch(std::make_unique<State>(settings.worker_count));
}

GroundBatch::GroundBatch(std::unique_ptr<State> state) : state_(std::move(state)) {}
GroundBatch::GroundBatch(GroundBatch&&) noexcept = default;
GroundBatch& GroundBatch::operator=(GroundBatch&&) noexcept = default;
GroundBatch::~GroundBatch() = default;

// Batches of heights. Points are processed in blocks: the cells of a block are found and their samples prefetched, then
// the heights are computed. The memory accesses of a block thus overlap. The arithmetic is vectorised over the
// points of a block (height_kernels.h). Sorting scattered points by chunk was measured and does not pay: it only moves
// the scattered accesses from samples to points and answers (docs/batch.md).

namespace {

constexpr std::size_t kBlock = internal::kHeightBlock;
/// Smallest number of points in a slice.
constexpr std::size_t kLeastPoints = 1024;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

void write(const HeightArrays& out, std::size_t i, const HeightAnswer& answer) {
    const bool is_ok = answer.status == QueryStatus::ok;
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

/// Processes the blocks of one thread.
class GroundBatch::HeightBlocks {
public:
    HeightBlocks(const Ground& ground, const PointArray& points, const HeightArrays& out,
                 internal::ChunkTable& table, std::uint64_t call)
        : ground_(ground),
          points_(points),
          out_(out),
          table_(table),
          call_(call),
          kernels_(internal::height_kernels(internal::best_simd_level())) {
        const WorldRect& extent = ground.extent_;
        const CellRange& cells = ground.in_extent_;
        columns_ = lines(ground.columns_, extent.west, extent.east, cells.west, cells.east);
        rows_ = lines(ground.rows_, extent.south, extent.north, cells.south, cells.north);
    }

    void answer(std::size_t begin, std::size_t end) {
        for (std::size_t first = begin; first < end; first += kBlock) {
            const std::size_t count = std::min(kBlock, end - first);
            // pads the last block with its last point
            for (std::size_t k = 0; k < kBlock; ++k) {
                const std::size_t at = (first + std::min(k, count - 1)) * points_.stride;
                x_[k] = points_.x[at];
                y_[k] = points_.y[at];
            }
            kernels_.find_cells(columns_, x_, in_x_);
            kernels_.find_cells(rows_, y_, in_y_);
            for (std::size_t k = 0; k < kBlock; ++k) find_samples(k);
            kernels_.heights(south_west_, in_x_, in_y_, ground_.quantum_, heights_);
            write_block(first, count);
        }
    }

private:
    static internal::AxisLines lines(const Ground::Lines& lines, double low, double high,
                                     std::int64_t first, std::int64_t last) {
        return {lines.origin,
                lines.spacing,
                lines.inverse_spacing,
                low,
                high,
                static_cast<double>(first),
                static_cast<double>(last)};
    }

    // Dummy samples for points that are answered individually.
    static constexpr std::array<std::int32_t, kChunkSamples + 2> kNoSamples{};

    void find_samples(std::size_t k) {
        south_west_[k] = kNoSamples.data();
        bound_[k] = nullptr;
        is_filled_[k] = 0;
        const int i = in_x_.cell[k], j = in_y_.cell[k];
        if ((i | j) < 0) return;
        const internal::ChunkEntry& chunk = chunk_of(in_x_.chunk[k], in_y_.chunk[k]);
        if (chunk.heights == nullptr) return;
        const std::size_t cell = cell_index(i, j);
        if (chunk.cell_flags != nullptr) {
            const std::uint8_t flags = chunk.cell_flags[cell];
            if ((flags & cell_outside) != 0) return;
            is_filled_[k] = static_cast<std::uint8_t>((flags & cell_filled) != 0);
        }
        const std::int32_t* const south_west = chunk.heights + sample_index(i, j);
        south_west_[k] = south_west;
        bound_[k] = chunk.cell_bounds + cell;
        __builtin_prefetch(south_west);
        __builtin_prefetch(south_west + kChunkSamples);
        if (!out_.errors_m.empty()) __builtin_prefetch(bound_[k]);
    }

    const internal::ChunkEntry& chunk_of(std::int64_t column, std::int64_t row) {
        internal::ChunkEntry& entry = table_.at(column, row);
        if (entry.call == call_ && entry.column == column && entry.row == row) return entry;
        entry = {.column = column, .row = row, .call = call_};
        const Chunk* const chunk = ground_.find_chunk(column << kChunkShift, row << kChunkShift);
        if (chunk == nullptr || chunk->solid != nullptr || !chunk->is_certified) return entry;
        entry.heights = chunk->heights.data();
        entry.cell_bounds = chunk->cell_bounds.data();
        entry.cell_flags = chunk->cell_flags.empty() ? nullptr : chunk->cell_flags.data();
        return entry;
    }

    void write_block(std::size_t first, std::size_t count) {
        if (!out_.heights.empty()) std::copy_n(heights_.height, count, &out_.heights[first]);
        if (!out_.normals.empty()) {
            kernels_.normals(heights_, ground_.spacing_, normals_);
            for (std::size_t k = 0; k < count; ++k) {
                double* const normal = &out_.normals[3 * (first + k)];
                normal[0] = normals_.x[k];
                normal[1] = normals_.y[k];
                normal[2] = normals_.z[k];
            }
        }
        if (!out_.statuses.empty()) {
            std::fill_n(&out_.statuses[first], count, QueryStatus::ok);
        }
        if (!out_.filled.empty()) std::copy_n(is_filled_, count, &out_.filled[first]);
        for (std::size_t k = 0; k < count; ++k) {
            if (bound_[k] == nullptr) {
                write(out_, first + k, ground_.height(x_[k], y_[k]));
            } else if (!out_.errors_m.empty()) {
                out_.errors_m[first + k] = static_cast<double>(*bound_[k]);
            }
        }
    }

    const Ground& ground_;
    const PointArray& points_;
    const HeightArrays& out_;
    internal::ChunkTable& table_;
    const std::uint64_t call_;
    const internal::HeightKernels& kernels_;
    internal::AxisLines columns_, rows_;
    alignas(64) double x_[kBlock], y_[kBlock];
    internal::AxisCells in_x_, in_y_;
    const std::int32_t* south_west_[kBlock];  // samples
    const float* bound_[kBlock];              // null: the point is answered individually
    std::uint8_t is_filled_[kBlock];
    internal::BlockHeights heights_;
    internal::BlockNormals normals_;
};

Result<void> GroundBatch::heights(const Ground& ground, const PointArray& points_world,
                                  const HeightArrays& out) {
    const std::size_t count = points_world.count;
    TERRANE_TRY(internal::check_points("points_world", points_world, false));
    TERRANE_TRY(internal::check_length("heights", out.heights.size(), count));
    TERRANE_TRY(internal::check_length("normals", out.normals.size(), count, 3));
    TERRANE_TRY(internal::check_length("errors_m", out.errors_m.size(), count));
    TERRANE_TRY(internal::check_length("statuses", out.statuses.size(), count));
    TERRANE_TRY(internal::check_length("filled", out.filled.size(), count));
    ++state_->call;
    state_->run_slices(
        count, kLeastPoints, [&](std::size_t begin, std::size_t end, State::Worker& worker) {
            HeightBlocks(ground, points_world, out, worker.table, state_->call).answer(begin, end);
        });
    return {};
}

namespace {

/// Smallest number of rays in a slice.
constexpr std::size_t kLeastRays = 256;

void write_vector(std::span<double> out, std::size_t i, bool is_ok, const Eigen::Vector3d& vector) {
    if (out.empty()) return;
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    out[3 * i] = is_ok ? vector.x() : kNone;
    out[3 * i + 1] = is_ok ? vector.y() : kNone;
    out[3 * i + 2] = is_ok ? vector.z() : kNone;
}

void write(const RayArrays& out, std::size_t i, const RayAnswer& answer) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const bool is_ok = answer.status == QueryStatus::ok;
    if (!out.fractions.empty()) out.fractions[i] = is_ok ? answer.fraction : kNone;
    write_vector(out.points_world, i, is_ok, answer.point_world);
    write_vector(out.normals, i, is_ok, answer.normal);
    if (!out.errors_m.empty()) out.errors_m[i] = is_ok ? answer.error_m : kNone;
    if (!out.statuses.empty()) out.statuses[i] = answer.status;
    if (!out.filled.empty()) out.filled[i] = static_cast<std::uint8_t>(is_ok && answer.filled);
}

WorldPos point_at(const PointArray& points, std::size_t i) {
    const std::size_t at = i * points.stride;
    return {points.x[at], points.y[at], points.z[at]};
}

}  // namespace

Result<void> GroundBatch::rays(const Ground& ground, const PointArray& from_world,
                               const PointArray& to_world, const RayArrays& out) {
    const std::size_t count = from_world.count;
    if (to_world.count != count) {
        return fail(ErrorCode::invalid_argument,
                    "to_world must have as many points as from_world, " + std::to_string(count) +
                        ", has " + std::to_string(to_world.count));
    }
    TERRANE_TRY(internal::check_points("from_world", from_world, true));
    TERRANE_TRY(internal::check_points("to_world", to_world, true));
    TERRANE_TRY(internal::check_length("fractions", out.fractions.size(), count));
    TERRANE_TRY(internal::check_length("points_world", out.points_world.size(), count, 3));
    TERRANE_TRY(internal::check_length("normals", out.normals.size(), count, 3));
    TERRANE_TRY(internal::check_length("errors_m", out.errors_m.size(), count));
    TERRANE_TRY(internal::check_length("statuses", out.statuses.size(), count));
    TERRANE_TRY(internal::check_length("filled", out.filled.size(), count));
    const bool has_fan = from_world.stride == 0 && count >= RayFan::kLeastRays;
    if (has_fan) {
        double reach = 0.0;
        const WorldPos from = point_at(from_world, 0);
        for (std::size_t i = 0; i < count; ++i) {
            const Eigen::Vector3d ray = point_at(to_world, i) - from;
            const double length = std::sqrt(ray.x() * ray.x() + ray.y() * ray.y());
            if (std::isfinite(length)) reach = std::max(reach, length);
        }
        state_->fan.reset(ground, from, reach);
    }
    const internal::ChunkOrder::Grid grid(ground);
    state_->run_slices(
        count, kLeastRays, [&](std::size_t begin, std::size_t end, State::Worker& worker) {
            // by the midpoint of each ray, which distinguishes rays with a common start
            const auto bucket_of = [&](std::size_t i) {
                const std::size_t from = (begin + i) * from_world.stride;
                const std::size_t to = (begin + i) * to_world.stride;
                return grid.bucket(0.5 * (from_world.x[from] + to_world.x[to]),
                                   0.5 * (from_world.y[from] + to_world.y[to]));
            };
            const std::span<const std::uint32_t> order =
                worker.order.arrange(end - begin, bucket_of);
            for (std::size_t k = 0; k < end - begin; ++k) {
                const std::size_t i = begin + (order.empty() ? k : order[k]);
                const WorldPos from = point_at(from_world, i), to = point_at(to_world, i);
                write(out, i, has_fan ? state_->fan.ray(from, to) : ground.ray(from, to));
            }
        });
    return {};
}

}  // namespace terrane
