// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/vehicle.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane {

/// Settings of a PathDriver. Fixed once it is created.
struct PathDriverSettings {
    double cruise_speed = 12.0;  ///< largest speed, m/s, 0.1 to 1000
    /// Largest in corners, m/s^2, 0.1 to 100. Vehicles with little friction or a high centre of mass use less.
    double lateral_acceleration = 2.5;
    double deceleration = 2.0;  ///< ahead of corners and of the end, m/s^2, 0.1 to 100
};

/// What a driver is doing.
enum class DriverStatus : std::uint8_t {
    driving,      ///< follows the path
    rolled_over,  ///< the vehicle lies on its side or roof: throttle 0, brakes on
    finished,     ///< the end of the path was reached: brakes on; final
};

/// Drives a vehicle along a polyline by pure pursuit. Brakes in time for corners and for the end, and slows down on
/// descents and side slopes. It does not query the ground ahead: it drives over a cliff at up to the cruise speed.
///
/// Threads: one at a time.
class PathDriver {
public:
    /// @param points_world x and y of the path, metres, in the order of travel; points less than 1 mm after the
    ///                     previous one are dropped
    ///
    /// Fails: invalid_argument, naming the point or the field, for fewer than two distinct points, coordinates that are
    ///        not finite or beyond 2e9 m, and settings out of range
    static Result<PathDriver> create(std::vector<Eigen::Vector2d> points_world,
                                     const PathDriverSettings& settings);

    /// The controls for the vehicle's next step: see World::vehicle() and World::vehicle_settings().
    ///
    /// Allocates: nothing
    /// Cost:      linear in the points from 5 m behind the vehicle to 25 m ahead, along the path
    VehicleControls drive(const VehicleSettings& settings, const VehicleState& vehicle);

    /// As of the last call of drive().
    DriverStatus status() const { return status_; }
    /// Whether the vehicle came within 3 m of the last point or passed it; final. The driver then brakes to a stop.
    bool is_finished() const { return is_finished_; }

private:
    struct Vertex {
        WorldVec2 p_world = WorldVec2::Zero();
        double along = 0.0;  // metres from the start of the path
        // Squares of speeds, of the corner here and with what braking for all later ones leaves.
        double corner = 0.0, braked = 0.0;
    };

    PathDriver(std::vector<Vertex> path, const PathDriverSettings& settings);
    double advance(const Eigen::Vector2d& here);
    Eigen::Vector2d point_at(double along, std::size_t end) const;
    double corner_speed(double along, double share) const;

    std::vector<Vertex> path_;
    PathDriverSettings settings_;
    std::size_t next_ = 1;  // end of the segment that the vehicle is on
    bool is_finished_ = false;
    DriverStatus status_ = DriverStatus::driving;
};

}  // namespace terrane
