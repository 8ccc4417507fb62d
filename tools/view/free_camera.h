// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/playback/camera_path.h>
#include <terrane/terrain/view.h>

#include <functional>
#include <optional>

namespace terrane::tools {

/// How a user steers a FreeCamera during a frame.
struct CameraControls {
    /// Motion along the view's right, its forward direction and world z, each -1 to 1.
    Eigen::Vector3d move = Eigen::Vector3d::Zero();
    double turn = 0.0;   ///< to the right, radians
    double lift = 0.0;   ///< upwards, radians
    double wheel = 0.0;  ///< notches: speed, or the distance from the centre of an orbit
    bool is_fast = false;
};

/// A camera that flies freely, flies to a point, or orbits a point.
///
/// At a speed_factor() of 1 its speed is the height above the ground in a second, but at least 8 m/s. It never comes
/// nearer to the ground than kClearance, as far as the ground is known.
class FreeCamera {
public:
    /// Least distance from the ground, metres.
    static constexpr double kClearance = 1.0;

    /// Where a motion of the eye ends that does not enter the ground: `to_world`, or a point nearer to `from_world`.
    using Stopper = std::function<WorldPos(const WorldPos& from_world, const WorldPos& to_world)>;

    /// @param pose its `up` is replaced by the one without roll
    explicit FreeCamera(const CameraPose& pose) { jump_to(pose); }

    /// Continues from a pose at once, and ends orbits and flights to points.
    void jump_to(const CameraPose& pose);
    /// Flies to a point in kFlightTime, and stops at a distance from it, looking at it.
    void fly_to(const WorldPos& target_world, double distance);
    /// Orbits a point at the present distance; controls then turn the eye around it.
    void orbit(const WorldPos& centre_world);
    void stop_orbit() { centre_.reset(); }
    bool is_orbiting() const { return centre_.has_value(); }
    /// Turns the view to an azimuth, radians clockwise from world y, keeping its elevation.
    void look_along(double azimuth);

    /// Moves the camera by dt seconds.
    ///
    /// @param height above the ground, metres; absent if unknown
    void move(const CameraControls& controls, double dt, std::optional<double> height,
              const Stopper& stop);

    CameraPose pose() const;
    double speed_factor() const { return speed_factor_; }

    /// Duration of a flight to a point, seconds.
    static constexpr double kFlightTime = 1.2;

private:
    struct Flight {
        CameraPose from;
        WorldPos to_world = WorldPos::Zero();
        double azimuth = 0.0, elevation = 0.0;  // at the end
        double from_azimuth = 0.0, from_elevation = 0.0;
        double time = 0.0;  // since its start, seconds
    };

    Eigen::Vector3d forward() const;
    void face(const Eigen::Vector3d& direction);
    WorldPos wanted_eye(const CameraControls& controls, double dt, std::optional<double> height);

    WorldPos eye_world_ = WorldPos::Zero();
    double azimuth_ = 0.0, elevation_ = 0.0;
    Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
    double speed_factor_ = 1.0;
    std::optional<WorldPos> centre_;  // of the orbit
    std::optional<Flight> flight_;
};

}  // namespace terrane::tools
