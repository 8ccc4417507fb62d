// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/collision/body.h>
#include <terrane/collision/world_query.h>
#include <terrane/terrain/ground.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

namespace terrane {

class World;

/// What a ray of a scan meets first.
enum class LidarStatus {
    miss,          ///< nothing, and its end is over the ground's extent
    ground,        ///< the ground
    body,          ///< a body
    not_resident,  ///< ground that is not loaded may be met before anything else
    outside,       ///< nothing, and its end is beyond the ground's extent, where nothing is known
    invalid,       ///< the pose is not finite, or its rotation is not orthonormal
};

/// Settings of a Lidar.
struct LidarSettings {
    /// Metres along each ray; nothing nearer is seen, such as the body that carries the sensor. At least 0.
    double min_range = 0.1;
    double max_range = 100.0;  ///< metres; nothing farther is seen; above min_range, to 1e6
    int worker_count = 1;      ///< threads of scan(), the caller's included, 1 to 64
};

/// Directions at equal angles: elevations from the first to the last, and for each all azimuths.
struct LidarGridSettings {
    int azimuth_count = 1024;                             ///< 1 to 2^20
    double first_azimuth = -std::numbers::pi;             ///< -2 pi to 2 pi; 0 is x, pi / 2 is y
    double azimuth_step = 2.0 * std::numbers::pi / 1024;  ///< -2 pi to 2 pi
    int elevation_count = 32;                             ///< 1 to 2^20
    double first_elevation = -0.5;  ///< -pi / 2 to pi / 2, and so is the last; positive towards z
    double elevation_step = 0.02;   ///< -pi to pi
};

/// The directions of a grid in the sensor's frame, unit: direction (azimuth i, elevation j) has index j * azimuth_count
/// + i. Computed without libm: the same bits on every machine.
///
/// Fails:    invalid_argument, naming the field and its value, for one out of range, or more than 2^26 directions
/// Accuracy: 1e-15 per component for the angle first + index * step as a double
Result<std::vector<Eigen::Vector3d>> make_lidar_grid(const LidarGridSettings& settings = {});

/// Where answers of Lidar::scan() are written: entry i is of direction i. Each span has one entry for each direction,
/// points and normals have three numbers, x y z x y z ...; an empty span is not written. Where nothing is met, the
/// numbers are NaN and the body is none.
struct LidarArrays {
    std::span<double> ranges{};         ///< metres from the sensor's origin
    std::span<double> points_world{};   ///< [3 * count] that are met
    std::span<double> normals_world{};  ///< [3 * count] RayQueryAnswer::normal
    std::span<BodyId> bodies{};         ///< that are met; of the ground: none
    std::span<std::uint32_t> parts{};   ///< RayQueryAnswer::part
    std::span<LidarStatus> statuses{};  ///< what is met
};

/// A range scanner: all its rays start at one moment from one pose.
///
/// Ray i runs from min_range to max_range along direction i; its answer is that of World::ray() between these two
/// points, bit for bit, with any number of workers. Noise, beam divergence and motion during a scan are not modelled.
///
/// Fails:     invalid_argument, naming the argument and its value, where scan() or create() refuse it; nothing is
///            written then
/// Threads:   one at a time; the world must not change meanwhile
/// Allocates: create() alone, and the first query of a world after a change
class Lidar {
public:
    /// @param directions_sensor in the sensor's frame, unit to 1e-6
    ///
    /// Fails: also for a direction that is not unit
    static Result<Lidar> create(const LidarSettings& settings,
                                std::span<const Eigen::Vector3d> directions_sensor);
    Lidar(Lidar&&) noexcept;
    Lidar& operator=(Lidar&&) noexcept;
    ~Lidar();

    /// Number of directions.
    std::size_t count() const;

    /// Scans the ground, and the bodies of a world.
    ///
    /// @param world             null: the ground alone
    /// @param world_from_sensor rotates directions into the world; its translation is the origin of all rays
    /// @param filter            which bodies are seen, and whether the ground is
    ///
    /// Cost: O(count log bodies) / workers; docs/batch.md has measured times
    Result<void> scan(const Ground& ground, const World* world, const Pose& world_from_sensor,
                      const LidarArrays& out, const QueryFilter& filter = {});

private:
    struct State;
    explicit Lidar(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
