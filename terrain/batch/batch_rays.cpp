// SPDX-License-Identifier: MIT
#include "batch/array_checks.h"
#include "batch/ground_batch_state.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane {
namespace {

/// Least rays of a slice.
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
    const bool is_ok = answer.status == GroundStatus::ok;
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
    if (auto ok = internal::check_points("from_world", from_world, true); !ok) return ok;
    if (auto ok = internal::check_points("to_world", to_world, true); !ok) return ok;
    if (auto ok = internal::check_length("fractions", out.fractions.size(), count); !ok) return ok;
    if (auto ok = internal::check_length("points_world", out.points_world.size(), count, 3); !ok) {
        return ok;
    }
    if (auto ok = internal::check_length("normals", out.normals.size(), count, 3); !ok) return ok;
    if (auto ok = internal::check_length("errors_m", out.errors_m.size(), count); !ok) return ok;
    if (auto ok = internal::check_length("statuses", out.statuses.size(), count); !ok) return ok;
    if (auto ok = internal::check_length("filled", out.filled.size(), count); !ok) return ok;
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
            // by the middle, which tells rays of a common start apart
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
