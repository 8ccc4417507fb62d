// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>
#include <terrane/terrain/body_need.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <memory>
#include <span>

namespace terrane::tools {

/// All numbers that a camera carries from one follow() to the next. They have a meaning for the camera only.
template <std::size_t count>
using CameraState = std::array<double, count>;

/// The view from another eye position towards a target; field of view and size are kept. The orientation is kept if eye
/// and target coincide.
inline View look_towards(View view, const WorldPos& eye_world, const WorldPos& target_world) {
    const Result<View> looking =
        look_at(eye_world, target_world, view.vertical_fov, view.width_px, view.height_px);
    view.eye_world = eye_world;
    if (looking) {
        view.forward = looking->forward;
        view.up = looking->up;
    }
    return view;
}

/// Position of a ChaseCamera relative to its target, metres.
struct ChaseCameraSettings {
    double behind = 11.0;       ///< horizontal distance behind the target
    double above = 3.2;         ///< height of the eye above the target's centre
    double target_above = 0.8;  ///< height of the look-at point above that centre
    double bearing = 0.0;       ///< of the eye around the target, radians clockwise from behind
};

/// A camera that follows a vehicle or character from behind and above, with a lag that smooths its motion. It stays
/// above the ground and rises over crests between itself and its target. In front of what stands between them, such as
/// a tree, a house or the wall of a cave, it comes nearer, with bounded acceleration: it looks ahead, so that it is
/// usually there before its target is hidden. It returns slowly.
class ChaseCamera {
public:
    /// @param source must outlive the camera
    /// @param pose_world of the target: x forward, z up
    ChaseCamera(const HeightSource& source, const Pose& pose_world,
                const ChaseCameraSettings& settings = {});

    /// Follows for dt seconds. The first call starts from the height and the distance that the eye wants there.
    ///
    /// @param world of the bodies that the camera avoids, with the target's own body
    /// Cost:  three casts of a sphere over the distance to the target
    void follow(const Pose& pose_world, double dt, const Ground& ground, const World& world,
                BodyId own = {});

    /// Moves the eye around the target: ChaseCameraSettings::bearing from the next follow() on.
    void set_bearing(double bearing) { settings_.bearing = bearing; }

    /// `view` with the camera's position and orientation; field of view and size are kept.
    View view(const View& view) const;
    /// Mean velocity of the eye during the last follow(), m/s.
    const Eigen::Vector3d& velocity() const { return velocity_; }

    /// The need for the ground that the next follow() asks about.
    BodyNeed need() const;
    /// Whether the ground that the last follow() asked about was resident. If so, equal calls give equal bits, whatever
    /// other ground is resident.
    bool is_complete() const { return is_complete_; }

    static constexpr std::size_t kStateSize = 24;
    /// A camera with the same source and settings, and this state, continues with the same bits.
    CameraState<kStateSize> state() const;
    void restore(const CameraState<kStateSize>& state);

private:
    double floor_at(double x, double y, const Pose& pose_world, const Ground* ground);
    WorldPos target_of(const Pose& pose_world) const;
    WorldPos wanted_eye(const Pose& pose_world, const Eigen::Vector3d& heading,
                        const Ground* ground);
    double wanted_approach(const Pose& pose_world, const Eigen::Vector3d& ahead,
                           const Ground& ground, const World& world, BodyId own);
    template <class Camera, class Visit>
    static void visit_state(Camera& camera, const Visit& visit);

    const HeightSource* source_;
    ChaseCameraSettings settings_;
    Eigen::Vector3d heading_ = Eigen::Vector3d::UnitX();  // horizontal, length about 1
    WorldPos place_world_ = WorldPos::Zero();             // of the target, in the last follow()
    Eigen::Vector3d motion_ = Eigen::Vector3d::Zero();    // smoothed velocity of the target, m/s
    bool is_following_ = false;  // since the first follow(), from which on the ground is known
    bool is_complete_ = true;
    WorldPos free_eye_world_ = WorldPos::Zero();  // the eye if nothing hides the target
    double approach_ = 0.0;        // distance from there towards the target, metres, >= 0
    double approach_speed_ = 0.0;  // m/s
    WorldPos eye_world_ = WorldPos::Zero();
    WorldPos target_world_ = WorldPos::Zero();
    Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

/// A camera that looks at the mean position of the bodies that move, circles slowly around it, and stays above the
/// ground.
class DropCamera {
public:
    /// @param bodies at the start, at least one; their spread sets the distance of the camera
    DropCamera(std::shared_ptr<const HeightSource> source, std::span<const BodyState> bodies);

    /// Follows for dt seconds.
    void follow(std::span<const BodyState> bodies, double dt);

    /// `view` with the camera's position and orientation; field of view and size are kept.
    View view(const View& view) const;
    /// Mean velocity of the eye during the last follow(), m/s.
    const Eigen::Vector3d& velocity() const { return velocity_; }

    static constexpr std::size_t kStateSize = 14;
    /// A camera with the same source and this state continues with the same bits.
    CameraState<kStateSize> state() const;
    void restore(const CameraState<kStateSize>& state);

private:
    template <class Camera, class Visit>
    static void visit_state(Camera& camera, const Visit& visit);
    WorldPos find_eye() const;
    WorldPos clear_of_ground(WorldPos eye, double clearance) const;

    std::shared_ptr<const HeightSource> source_;
    double distance_ = 0.0;  // metres from the target
    double heading_ = 0.0;   // direction from the target to the eye, radians from east
    Eigen::Vector3d motion_ = Eigen::Vector3d::Zero();  // smoothed velocity of the bodies, m/s
    WorldPos target_world_ = WorldPos::Zero();
    WorldPos eye_world_ = WorldPos::Zero();
    Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace terrane::tools
