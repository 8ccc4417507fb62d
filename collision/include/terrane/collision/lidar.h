// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/collision/body.h>
#include <terrane/collision/world_query.h>
#include <terrane/terrain/body_need.h>
#include <terrane/terrain/ground.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

namespace terrane {

class World;

/// What a ray of a scan hits first.
enum class LidarStatus {
    miss,          ///< no hit; the ray ends within the ground's extent in plan
    ground,        ///< hits the ground
    body,          ///< hits a body
    not_resident,  ///< ground that is not loaded may be the first hit
    outside,       ///< no hit; the ray ends beyond the ground's extent in plan
    invalid,       ///< the pose is not finite, or its rotation is not orthonormal
};

/// Settings of a Lidar.
struct LidarSettings {
    /// Start of each ray, metres from the sensor, >= 0. Nearer surfaces, such as its carrier, are not detected.
    double min_range = 0.1;
    double max_range = 100.0;  ///< metres, above min_range, at most 1e6
    int worker_count = 1;      ///< threads of scan(), including the caller, 1 to 64
};

/// A grid of directions at equal angular steps, ordered by elevation, then azimuth.
struct LidarGridSettings {
    int azimuth_count = 1024;                             ///< 1 to 2^20
    double first_azimuth = -std::numbers::pi;             ///< -2 pi to 2 pi; 0 is x, pi / 2 is y
    double azimuth_step = 2.0 * std::numbers::pi / 1024;  ///< -2 pi to 2 pi
    int elevation_count = 32;                             ///< 1 to 2^20
    double first_elevation = -0.5;  ///< -pi / 2 to pi / 2, also for the last; positive towards z
    double elevation_step = 0.02;   ///< -pi to pi
};

/// Returns the unit directions of a grid in the sensor's frame; direction (azimuth i, elevation j) has index j *
/// azimuth_count + i. Computed without libm, so bit-identical on every machine.
///
/// Fails:    invalid_argument, naming the field and its value, for a field out of range or more than 2^26 directions
/// Accuracy: 1e-15 per component for the angle first + index * step as a double
Result<std::vector<Eigen::Vector3d>> make_lidar_grid(const LidarGridSettings& settings = {});

/// Output arrays of Lidar::scan(); entry i belongs to direction i. Points and normals have three numbers per direction,
/// x y z x y z ...; empty spans are skipped. Without a hit, numbers are NaN and the body is none.
struct LidarArrays {
    std::span<double> ranges{};         ///< metres from the sensor's origin
    std::span<double> points_world{};   ///< [3 * count] hit points
    std::span<double> normals_world{};  ///< [3 * count] RayQueryAnswer::normal
    std::span<BodyId> bodies{};         ///< bodies hit; none for the ground
    std::span<std::uint32_t> parts{};   ///< RayQueryAnswer::part
    std::span<LidarStatus> statuses{};  ///< kind of hit
};

/// A range scanner whose rays all start from one pose at one instant.
///
/// Ray i runs from min_range to max_range along direction i. Its answer is bit-identical to World::ray() between these
/// two points, for any number of workers. Noise, beam divergence and motion during a scan are not modelled.
///
/// Fails:     create() and scan(): invalid_argument, naming the argument and its value; scan() then writes no output
/// Threads:   one at a time; the world must not change during a scan
/// Allocates: in create(), and in the first query after a change of the world
class Lidar {
public:
    /// @param directions_sensor unit to 1e-6, in the sensor's frame
    ///
    /// Fails: also for a direction that is not of unit length
    static Result<Lidar> create(const LidarSettings& settings,
                                std::span<const Eigen::Vector3d> directions_sensor);
    Lidar(Lidar&&) noexcept;
    Lidar& operator=(Lidar&&) noexcept;
    ~Lidar();

    /// Number of directions.
    std::size_t count() const;

    /// The need of a sensor, for a pager beside World::needs(): all ground within max_range in plan, whatever its
    /// height, and ground that comes into range as the sensor moves. Beams that reach ground for which nothing asks
    /// have the status not_resident. If the area is too large for the pager, its outer part is left out:
    /// PagerStats::cut_needs.
    ///
    /// @param velocity of the sensor until the scan, m/s, world axes
    BodyNeed need(const Pose& world_from_sensor,
                  const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero()) const;

    /// Scans the ground and the bodies of a world.
    ///
    /// @param world             null: only the ground
    /// @param world_from_sensor pose of the sensor; its translation is the origin of all rays
    /// @param filter            bodies to detect, and whether to detect the ground
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
