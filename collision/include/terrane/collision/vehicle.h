// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/body.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace terrane {

/// Two wheels at the same distance from the front, or one in the middle.
struct AxleSettings {
    double position = 0.0;   ///< of the wheels' centres, metres forward of the centre of mass
    double track = 1.8;      ///< between the middles of the wheels, metres; 0: one wheel
    double max_steer = 0.0;  ///< steering angle at full lock, radians; negative: steers oppositely
    bool is_driven = true;   ///< whether the engine drives its wheels
    /// Stiffness of the anti-roll bar, newtons per metre of difference in compression: it pushes the more compressed
    /// wheel down and lifts the other.
    double anti_roll = 0.0;
};

/// Settings of a vehicle on wheels. The defaults are those of make_truck() without its cab. They describe a light
/// off-road truck that slides on flat ground before it rolls over: its static stability factor, track /
/// (2 centre_of_mass_height), is 1.2 and its tyre friction 0.8.
///
/// Body frame: x forward, y left, z up, origin at the centre of the chassis box, which is also the centre of mass. The
/// inertia is that of the box with uniform density.
struct VehicleSettings {
    /// Half extents of the chassis box, which collides, metres, each 0.01 to 1000; x is along the vehicle.
    Eigen::Vector3d chassis_half_extents = Eigen::Vector3d(2.3, 0.9, 0.4);
    std::vector<CompoundPart> bodywork = {};  ///< massless parts that collide, such as a cab
    double mass = 3500.0;                     ///< kilograms, wheels included, 1e-3 to 1e9
    /// Height of the centre of mass above flat ground at rest, metres, chassis_half_extents.z to 1000. Determines the
    /// height of the wheels.
    double centre_of_mass_height = 0.75;
    /// Axles from front to rear, 1 to 32. The driven wheels share the drive force, all wheels the brake force.
    std::vector<AxleSettings> axles = {
        {.position = 1.6, .track = 1.8, .max_steer = 0.6, .is_driven = true, .anti_roll = 20e3},
        {.position = -1.6, .track = 1.8, .max_steer = 0.0, .is_driven = true, .anti_roll = 20e3}};
    double wheel_radius = 0.42;         ///< metres, 0.01 to 100
    double suspension_travel = 0.3;     ///< from hanging to fully compressed, metres, 0.001 to 100
    double suspension_hertz = 1.6;      ///< natural frequency of the body's bounce, 0.1 to 10
    double damping_ratio = 0.4;         ///< of the body's bounce, 1: critical, 0 to 10
    double tyre_friction = 0.8;         ///< Coulomb, along the rolling direction, 0 to 100
    double side_grip = 1.0;             ///< lateral over longitudinal friction, 0.01 to 1
    double max_drive_force = 22e3;      ///< total at low speed, newtons, 0 to 1e12
    double max_drive_power = 120e3;     ///< total at the wheels, watts, 0 to 1e12
    double max_brake_force = 30e3;      ///< total, newtons, 0 to 1e12
    double rolling_resistance = 0.015;  ///< resisting force over wheel load, 0 to 1
    double drag_area = 1.4;             ///< drag coefficient times frontal area, m^2, 0 to 1e4
    /// Whether the vehicle is tracked: the wheels of each side form a belt, and steering is differential. Beyond the
    /// friction ellipse a belt keeps its longitudinal force; a tyre scales both components.
    bool is_tracked = false;
    double friction = 0.5;     ///< of the chassis, Coulomb, 0 to 1e6
    double restitution = 0.0;  ///< of the chassis, 0 to 1
    CollisionFilter filter{};  ///< of the chassis and the wheels
};

/// A light truck with a cab on four wheels, two of them steered; reaches 48 m/s on flat ground.
VehicleSettings make_truck();
/// A 12 t armoured personnel carrier on two tracks of five wheels each; reaches 18 m/s on flat ground.
VehicleSettings make_tracked();
/// A 9 t off-road truck with a cab on six driven wheels, four of them steered; reaches 30 m/s on flat ground.
VehicleSettings make_six_wheeler();

/// Controls of a vehicle; each is clamped to its range.
struct VehicleControls {
    /// Share of max_drive_force, -1 (backward) to 1 (forward), limited by max_drive_power at the current speed. A
    /// throttle against the motion brakes.
    double throttle = 0.0;
    double brake = 0.0;  ///< 0 to 1: share of max_brake_force
    double steer = 0.0;  ///< -1 (right) to 1 (left)
};

/// One wheel after a step.
struct WheelState {
    WorldPos centre_world = WorldPos::Zero();  ///< centre of the wheel
    double compression = 0.0;                  ///< 0 (hanging) to suspension_travel, metres
    /// Rotation angle about the axle for drawing, radians, unbounded; positive when rolling forward, right-handed about
    /// the body's y axis.
    double spin = 0.0;
    double steer = 0.0;       ///< about the body's z axis, radians, positive to the left
    bool in_contact = false;  ///< touches something with its lower half, relative to the chassis
    BodyId body{};            ///< body under the wheel; none on the ground
    WorldPos point_world = WorldPos::Zero();            ///< contact point; valid if `in_contact`
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< contact normal, towards the wheel
    double load = 0.0;       ///< mean suspension force along the normal over the step, N
    double side_slip = 0.0;  ///< of the contact point along the axle, m/s, positive to the left
};

/// Pose, motion and wheels of a vehicle.
struct VehicleState {
    BodyState chassis;  ///< as in World::states()
    /// Wheels, axle by axle from front to rear, left before right.
    std::vector<WheelState> wheels;
    /// Whether the vehicle has been in contact for one second since it was last upright. It is upright if it is tilted
    /// by at most 70 degrees, or by at most 45 degrees if no wheel is in contact.
    bool is_rolled_over = false;
};

/// Settings of a PathDriver. Fixed once it is created.
struct PathDriverSettings {
    double cruise_speed = 12.0;  ///< largest speed, m/s, 0.1 to 1000
    /// Maximum lateral acceleration in corners, m/s^2, 0.1 to 100. Reduced for vehicles with low friction or a high
    /// centre of mass.
    double lateral_acceleration = 2.5;
    double deceleration = 2.0;  ///< braking before corners and the end, m/s^2, 0.1 to 100
};

/// What a driver is doing.
enum class DriverStatus : std::uint8_t {
    driving,  ///< follows the path
    stuck,  ///< no progress for 5 s: backs off, and tries lines beside the path until it progresses
    rolled_over,  ///< the vehicle lies on its side or roof: throttle 0, brakes on
    finished,     ///< the end of the path was reached: brakes on; final
};

/// Drives a vehicle along a polyline by pure pursuit. Brakes in time for corners and the end of the path, and slows
/// down on descents and side slopes. It does not look at the ground ahead: it will drive over a cliff at up to the
/// cruise speed. On a climb that holds the vehicle back, the throttle rises until it moves. Tracks are steered by the
/// rate of turn, against the friction across them; a climb that holds them back they climb before they turn. A vehicle
/// that makes no progress for 5 s backs off and tries a line 4 m to the left of the path, then one to the right, then
/// farther lines.
///
/// Threads: one at a time.
class PathDriver {
public:
    /// @param points_world x and y of the path, metres, in the order of travel; a point within 1 mm of the previous one
    ///                     is dropped
    ///
    /// Fails: invalid_argument, naming the point or the field, for fewer than two distinct points, coordinates that are
    ///        not finite or beyond 2e9 m, and settings out of range
    static Result<PathDriver> create(std::vector<Eigen::Vector2d> points_world,
                                     const PathDriverSettings& settings);

    /// The controls for the vehicle's next step: see World::vehicle() and World::vehicle_settings().
    ///
    /// @param dt seconds since the previous call, >= 0; measures how long the vehicle makes no progress. Other values
    ///           count as 0
    ///
    /// Allocates: nothing
    /// Cost:      linear in the points from 5 m behind the vehicle to 25 m ahead, along the path
    VehicleControls drive(const VehicleSettings& settings, const VehicleState& vehicle, double dt);

    /// Status after the last drive().
    DriverStatus status() const { return status_; }
    /// Whether the vehicle has come within 3 m of the last point or passed it; never reset. The driver then brakes to a
    /// stop.
    bool is_finished() const { return is_finished_; }
    /// Share of the path's length that the vehicle has passed, 0 to 1; never decreases.
    double path_share() const;
    /// Total time that the vehicle was stuck, seconds: from its last progress to its next one, for each time that this
    /// took more than 5 s.
    double stuck_time() const { return stuck_time_; }
    /// The vehicle's place in plan when it was last found to be stuck; none if it never was.
    std::optional<WorldVec2> stuck_place_world() const { return stuck_place_world_; }

private:
    struct Vertex {
        WorldVec2 p_world = WorldVec2::Zero();
        double along = 0.0;  // metres from the start of the path
        // Squared speed limits: of this corner alone, and with braking for all later corners.
        double corner = 0.0, braked = 0.0;
    };

    PathDriver(std::vector<Vertex> path, const PathDriverSettings& settings);
    double advance(const Eigen::Vector2d& here);
    std::size_t segment_at(double along, std::size_t end) const;
    Eigen::Vector2d point_at(double along, std::size_t end) const;
    double corner_speed(double along, double share) const;
    void watch(double along, const Eigen::Vector2d& here, double dt);
    Eigen::Vector2d line_point(double along) const;

    std::vector<Vertex> path_;
    PathDriverSettings settings_;
    std::size_t next_ = 1;  // end of the segment that the vehicle is on
    bool is_finished_ = false;
    DriverStatus status_ = DriverStatus::driving;
    double progress_ = 0.0;      // metres along the path: the last progress
    double still_time_ = 0.0;    // seconds since then
    double patience_ = 0.0;      // `still_time_` at which the next attempt begins, seconds
    double backing_time_ = 0.0;  // seconds left of backing off
    int attempts_ = 0;           // lines tried beside the path; 0 once the obstacle is passed
    double stuck_along_ = 0.0;   // metres along the path: the obstacle
    double stuck_time_ = 0.0;
    double push_ = 0.0;  // throttle added on ground that holds the vehicle back
    std::optional<WorldVec2> stuck_place_world_;
};

}  // namespace terrane
