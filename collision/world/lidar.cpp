// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "base/vector_math.h"
#include "base/worker_team.h"
#include "broadphase/body_queries.h"

#include <terrane/collision/lidar.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/ground_batch.h>

#include <cmath>
#include <limits>
#include <string>

namespace terrane {
namespace {

constexpr double kPi = std::numbers::pi;

/// Cosine and sine of an angle.
struct Turn {
    double cosine, sine;
};

/// Cosine and sine of an angle, |angle| up to slightly above pi. The tangent of a quarter of the angle, where tangent()
/// is accurate, gives cosine and sine of half the angle, and the double-angle formulas give the result.
Turn turn_of(double angle) {
    const double t = internal::tangent(0.25 * angle);
    const double share = 1.0 / (1.0 + t * t);
    const double cosine = (1.0 - t * t) * share, sine = 2.0 * t * share;
    return {cosine * cosine - sine * sine, 2.0 * sine * cosine};
}

/// Wraps an angle to -pi to pi.
double wrapped(double angle) { return angle - 2.0 * kPi * std::floor(angle / (2.0 * kPi) + 0.5); }

}  // namespace

Result<std::vector<Eigen::Vector3d>> make_lidar_grid(const LidarGridSettings& settings) {
    constexpr int kMostCount = 1 << 20;
    constexpr std::int64_t kMostDirections = std::int64_t{1} << 26;
    const auto check = [&]() -> Result<void> {
        TERRANE_TRY(check_range("azimuth_count", settings.azimuth_count, 1, kMostCount));
        TERRANE_TRY(check_range("first_azimuth", settings.first_azimuth, -2.0 * kPi, 2.0 * kPi));
        TERRANE_TRY(check_range("azimuth_step", settings.azimuth_step, -2.0 * kPi, 2.0 * kPi));
        TERRANE_TRY(check_range("elevation_count", settings.elevation_count, 1, kMostCount));
        if (auto ok =
                check_range("first_elevation", settings.first_elevation, -0.5 * kPi, 0.5 * kPi);
            !ok)
            return ok;
        TERRANE_TRY(check_range("elevation_step", settings.elevation_step, -kPi, kPi));
        const double last =
            settings.first_elevation + settings.elevation_step * (settings.elevation_count - 1);
        // up to rounding of the product
        if (auto ok =
                check_range("the last elevation", last, -0.5 * kPi - 1e-12, 0.5 * kPi + 1e-12);
            !ok)
            return ok;
        return check_range("azimuth_count * elevation_count",
                           std::int64_t{settings.azimuth_count} * settings.elevation_count,
                           std::int64_t{1}, kMostDirections);
    };
    TERRANE_TRY(check());
    std::vector<Turn> azimuths;
    for (int i = 0; i < settings.azimuth_count; ++i)
        azimuths.push_back(turn_of(wrapped(settings.first_azimuth + settings.azimuth_step * i)));
    std::vector<Eigen::Vector3d> directions;
    directions.reserve(azimuths.size() * static_cast<std::size_t>(settings.elevation_count));
    for (int j = 0; j < settings.elevation_count; ++j) {
        const Turn up = turn_of(settings.first_elevation + settings.elevation_step * j);
        for (const Turn& azimuth : azimuths) {
            directions.emplace_back(up.cosine * azimuth.cosine, up.cosine * azimuth.sine, up.sine);
        }
    }
    return directions;
}

namespace {

/// Rays per block of a worker.
constexpr std::size_t kRaysOfTurn = 256;
/// Tolerance of squared lengths of directions, and of products of a rotation's columns.
constexpr double kUnitError = 1e-6;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

bool is_pose(const Pose& pose) {
    return internal::is_finite(pose.translation) &&
           internal::column_error(pose.rotation) <= kUnitError &&
           internal::determinant(pose.rotation) > 0.0;
}

LidarStatus status_of(const RayQueryAnswer& answer, const Ground& ground, const WorldPos& end) {
    if (answer.status == QueryStatus::not_resident) return LidarStatus::not_resident;
    if (answer.status != QueryStatus::ok) return LidarStatus::invalid;
    if (answer.hit) return answer.hits_ground() ? LidarStatus::ground : LidarStatus::body;
    return ground.extent().contains(end.x(), end.y()) ? LidarStatus::miss : LidarStatus::outside;
}

void write_vector(std::span<double> out, std::size_t i, bool is_hit,
                  const Eigen::Vector3d& vector) {
    if (out.empty()) return;
    for (int axis = 0; axis < 3; ++axis)
        out[3 * i + static_cast<std::size_t>(axis)] = is_hit ? vector[axis] : kNone;
}

Result<void> check_entries(const char* name, std::size_t length, std::size_t count,
                           std::size_t per_ray = 1) {
    if (length == 0 || length == per_ray * count) return {};
    return fail(ErrorCode::invalid_argument, std::string(name) + " must be empty or have " +
                                                 std::to_string(per_ray * count) + " entries for " +
                                                 std::to_string(count) + " directions, has " +
                                                 std::to_string(length));
}

Result<void> check_arrays(const LidarArrays& out, std::size_t count) {
    TERRANE_TRY(check_entries("ranges", out.ranges.size(), count));
    TERRANE_TRY(check_entries("points_world", out.points_world.size(), count, 3));
    TERRANE_TRY(check_entries("normals_world", out.normals_world.size(), count, 3));
    TERRANE_TRY(check_entries("bodies", out.bodies.size(), count));
    TERRANE_TRY(check_entries("parts", out.parts.size(), count));
    return check_entries("statuses", out.statuses.size(), count);
}

Result<void> check_directions(std::span<const Eigen::Vector3d> directions) {
    for (std::size_t i = 0; i < directions.size(); ++i) {
        const double square = internal::dot(directions[i], directions[i]);
        if (std::abs(square - 1.0) <= kUnitError) continue;
        return fail(ErrorCode::invalid_argument, "direction " + std::to_string(i) +
                                                     " must be unit, the square of its length is " +
                                                     number_text(square));
    }
    return {};
}

}  // namespace

struct Lidar::State {
    State(const LidarSettings& lidar_settings, std::span<const Eigen::Vector3d> directions)
        : settings(lidar_settings),
          directions_sensor(directions.begin(), directions.end()),
          team(lidar_settings.worker_count) {
        no_bodies.build({});
    }

    LidarSettings settings;
    std::vector<Eigen::Vector3d> directions_sensor;
    internal::WorkerTeam team;
    internal::BodyTree no_bodies;
    RayFan fan;
};

Result<Lidar> Lidar::create(const LidarSettings& settings,
                            std::span<const Eigen::Vector3d> directions_sensor) {
    TERRANE_TRY(check_range("min_range", settings.min_range, 0.0, 1e6));
    if (!(settings.max_range > settings.min_range && settings.max_range <= 1e6)) {
        return fail(ErrorCode::invalid_argument,
                    "max_range must be above min_range, " + number_text(settings.min_range) +
                        ", and at most 1e+06, got " + number_text(settings.max_range));
    }
    TERRANE_TRY(check_range("worker_count", settings.worker_count, 1, 64));
    TERRANE_TRY(check_directions(directions_sensor));
    return Lidar(std::make_unique<State>(settings, directions_sensor));
}

Lidar::Lidar(std::unique_ptr<State> state) : state_(std::move(state)) {}
Lidar::Lidar(Lidar&&) noexcept = default;
Lidar& Lidar::operator=(Lidar&&) noexcept = default;
Lidar::~Lidar() = default;

std::size_t Lidar::count() const { return state_->directions_sensor.size(); }

BodyNeed Lidar::need(const Pose& world_from_sensor, const Eigen::Vector3d& velocity) const {
    // Directions are unit only to kUnitError. A beam over absent ground is undecided wherever a coarser chunk's bounds
    // reach up to it, so that heights do not limit the need.
    return {.centre_world = world_from_sensor.translation,
            .velocity = velocity,
            .radius = (1.0 + 2.0 * kUnitError) * state_->settings.max_range,
            .trajectory = {},
            .is_waiting = true};
}

Result<void> Lidar::scan(const Ground& ground, const World* world, const Pose& world_from_sensor,
                         const LidarArrays& out, const QueryFilter& filter) {
    TERRANE_TRY(check_arrays(out, count()));
    const double min_range = state_->settings.min_range, max_range = state_->settings.max_range;
    const bool is_valid = is_pose(world_from_sensor);
    const WorldPos& origin = world_from_sensor.translation;
    const bool has_fan = is_valid && count() >= RayFan::kLeastRays;
    if (has_fan) state_->fan.reset(ground, origin, max_range);
    const internal::QueryScene ground_alone{
        {}, &state_->no_bodies, &ground, has_fan ? &state_->fan : nullptr};
    state_->team.run_blocks(count(), kRaysOfTurn, [&](std::size_t i) {
        RayQueryAnswer answer;
        WorldPos end = origin;
        if (is_valid) {
            const Eigen::Vector3d direction =
                internal::rotated(world_from_sensor.rotation, state_->directions_sensor[i]);
            const WorldPos begin = origin + min_range * direction;
            end = origin + max_range * direction;
            if (world == nullptr) {
                answer = internal::query_ray(ground_alone, begin, end, filter);
            } else if (has_fan) {
                answer = world->ray(state_->fan, begin, end, filter);
            } else {
                answer = world->ray(ground, begin, end, filter);
            }
        }
        if (!out.ranges.empty()) {
            out.ranges[i] =
                answer.hit ? min_range + answer.fraction * (max_range - min_range) : kNone;
        }
        write_vector(out.points_world, i, answer.hit, answer.point_world);
        write_vector(out.normals_world, i, answer.hit, answer.normal);
        if (!out.bodies.empty()) out.bodies[i] = answer.body;
        if (!out.parts.empty()) out.parts[i] = answer.part;
        if (!out.statuses.empty()) out.statuses[i] = status_of(answer, ground, end);
    });
    return {};
}

}  // namespace terrane
