// SPDX-License-Identifier: MIT
#include "view/free_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace terrane::tools {
namespace {

constexpr double kSteepest = 0.5 * std::numbers::pi - 0.01;  // elevation, radians
constexpr double kLeastSpeed = 8.0;                          // m/s
constexpr double kSpeedPerHeight = 1.0;                      // 1/s
constexpr double kFast = 5.0;                                // factor of the speed
constexpr double kNotch = 1.25;                              // factor of speed and distance
constexpr double kLeastFactor = 0.01, kMostFactor = 1000.0;
constexpr double kNearestOrbit = 2.0, kFarthestOrbit = 1e6;  // metres
constexpr double kSmoothing = 0.08;  // time constant of the velocity, seconds
constexpr double kFarthest = 1e9;    // of the eye from the origin, metres

double wrapped(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

}  // namespace

Eigen::Vector3d FreeCamera::forward() const {
    const double c = std::cos(elevation_);
    return {c * std::sin(azimuth_), c * std::cos(azimuth_), std::sin(elevation_)};
}

void FreeCamera::face(const Eigen::Vector3d& direction) {
    const double length = direction.norm();
    if (!(length > 0.0)) return;
    if (direction.head<2>().norm() > 1e-9 * length)
        azimuth_ = std::atan2(direction.x(), direction.y());
    elevation_ =
        std::clamp(std::asin(std::clamp(direction.z() / length, -1.0, 1.0)), -kSteepest, kSteepest);
}

void FreeCamera::jump_to(const CameraPose& pose) {
    eye_world_ = pose.eye_world;
    velocity_.setZero();
    flight_.reset();
    centre_.reset();
    face(pose.forward);
}

void FreeCamera::fly_to(const WorldPos& target_world, double distance) {
    const Eigen::Vector3d way = target_world - eye_world_;
    const double length = way.norm();
    if (!(length > 0.0)) return;
    centre_.reset();
    Flight flight;
    flight.from = pose();
    flight.from_azimuth = azimuth_;
    flight.from_elevation = elevation_;
    flight.to_world = target_world - std::min(distance, length) / length * way;
    // the end looks at the target from where it stops
    FreeCamera end = *this;
    end.face(way);
    flight.azimuth = azimuth_ + wrapped(end.azimuth_ - azimuth_);
    flight.elevation = end.elevation_;
    flight_ = flight;
}

void FreeCamera::orbit(const WorldPos& centre_world) {
    if (!((centre_world - eye_world_).norm() > 0.0)) return;
    flight_.reset();
    centre_ = centre_world;
    face(centre_world - eye_world_);
}

void FreeCamera::look_along(double azimuth) {
    flight_.reset();
    centre_.reset();
    azimuth_ = wrapped(azimuth);
}

WorldPos FreeCamera::wanted_eye(const CameraControls& controls, double dt,
                                std::optional<double> height) {
    if (flight_) {
        Flight& flight = *flight_;
        flight.time = std::min(flight.time + dt, kFlightTime);
        const double t = flight.time / kFlightTime;
        const double share = t * t * (3.0 - 2.0 * t);
        azimuth_ = wrapped(flight.from_azimuth + share * (flight.azimuth - flight.from_azimuth));
        elevation_ = flight.from_elevation + share * (flight.elevation - flight.from_elevation);
        const WorldPos at =
            flight.from.eye_world + share * (flight.to_world - flight.from.eye_world);
        if (flight.time >= kFlightTime || !controls.move.isZero()) flight_.reset();
        return at;
    }
    azimuth_ = wrapped(azimuth_ + controls.turn);
    elevation_ = std::clamp(elevation_ + controls.lift, -kSteepest, kSteepest);
    if (centre_) {
        const double now = (*centre_ - eye_world_).norm();
        const double closer = std::pow(kNotch, -controls.wheel) *
                              std::exp(-controls.move.y() * dt * (controls.is_fast ? kFast : 1.0));
        const double distance = std::clamp(now * closer, kNearestOrbit, kFarthestOrbit);
        azimuth_ = wrapped(azimuth_ - controls.move.x() * dt);
        elevation_ = std::clamp(elevation_ - controls.move.z() * dt, -kSteepest, kSteepest);
        return *centre_ - distance * forward();
    }
    speed_factor_ =
        std::clamp(speed_factor_ * std::pow(kNotch, controls.wheel), kLeastFactor, kMostFactor);
    const double speed = speed_factor_ * (controls.is_fast ? kFast : 1.0) *
                         std::max(kLeastSpeed, kSpeedPerHeight * std::abs(height.value_or(0.0)));
    const Eigen::Vector3d ahead = forward();
    const Eigen::Vector3d right(std::cos(azimuth_), -std::sin(azimuth_), 0.0);
    const Eigen::Vector3d wanted = speed * (controls.move.x() * right + controls.move.y() * ahead +
                                            controls.move.z() * Eigen::Vector3d::UnitZ());
    velocity_ += (1.0 - std::exp(-dt / kSmoothing)) * (wanted - velocity_);
    if (wanted.isZero() && velocity_.norm() < 1e-3 * kLeastSpeed) velocity_.setZero();
    return eye_world_ + dt * velocity_;
}

void FreeCamera::move(const CameraControls& controls, double dt, std::optional<double> height,
                      const Stopper& stop) {
    if (!(dt > 0.0)) return;
    const bool is_led = flight_ || centre_;
    WorldPos wanted = wanted_eye(controls, dt, height);
    for (double& part : wanted) part = std::clamp(part, -kFarthest, kFarthest);
    const WorldPos reached = stop(eye_world_, wanted);
    if (is_led) velocity_ = (reached - eye_world_) / dt;
    // the ground takes the motion into it, and leaves that along it
    if (!is_led && reached != wanted) velocity_ = (reached - eye_world_) / dt;
    if (is_led && !flight_ && !centre_) velocity_.setZero();  // has arrived
    eye_world_ = reached;
    if (centre_) face(*centre_ - eye_world_);
}

CameraPose FreeCamera::pose() const {
    CameraPose pose;
    pose.eye_world = eye_world_;
    pose.forward = forward().normalized();
    const Eigen::Vector3d right(std::cos(azimuth_), -std::sin(azimuth_), 0.0);
    pose.up = Eigen::Vector3d(right.y() * pose.forward.z() - right.z() * pose.forward.y(),
                              right.z() * pose.forward.x() - right.x() * pose.forward.z(),
                              right.x() * pose.forward.y() - right.y() * pose.forward.x())
                  .normalized();
    pose.velocity = velocity_;
    return pose;
}

}  // namespace terrane::tools
