// SPDX-License-Identifier: MIT
#pragma once

#include "flight/cameras.h"
#include "frames/body_nodes.h"
#include "scene/body_placement.h"
#include "scene/terrain_options.h"
#include "scene/vehicle_placement.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace terrane::tools {

/// What a user is in a view.
enum class Being { camera, walker, driver };

/// Sums over the steps of a LiveWorld.
struct LiveTotals {
    std::uint64_t steps = 0;
    std::uint64_t fell_through =
        0;                     ///< body steps that ended deeper in the ground than the tolerance
    double max_depth_m = 0.0;  ///< of any body
};

/// The bodies of a view: those of the scene, crates that the user throws, and the vehicle or character that the user
/// steers.
class LiveWorld {
public:
    /// Length of a step, seconds.
    static constexpr double kStep = 1.0 / 60.0;
    /// Largest number of crates; a new one then replaces the oldest.
    static constexpr std::size_t kMostThrown = 500;

    /// @param terrain    must outlive the world
    /// @param has_bodies whether the world has the bodies of the terrain's scene
    ///
    /// Fails: as ObjectBodies::create() and World::add()
    static Result<LiveWorld> create(const Terrain& terrain, bool has_bodies = true);

    World& world() { return world_; }
    const World& world() const { return world_; }

    /// The needs of all bodies, and of the vehicle or character that waits for its ground.
    std::span<const BodyNeed> needs();

    Being being() const { return being_; }
    /// Whether a vehicle or character waits until its ground is resident.
    bool is_waiting() const { return being_ != Being::camera && !body_.is_valid(); }
    /// The body that is steered; none for a camera, and while it waits.
    BodyId body() const { return body_; }

    /// Puts a vehicle on the ground, in place of what was steered before, as soon as the ground is resident.
    ///
    /// @param along_world heading, horizontal, not zero
    void drive(VehicleKind kind, const WorldVec2& place_world, const Eigen::Vector2d& along_world);
    /// Puts a character on the ground likewise.
    void walk(const WorldVec2& place_world, const Eigen::Vector2d& along_world);
    /// Removes the vehicle or character.
    void leave();
    /// Puts the vehicle on its wheels where it is.
    void right(const Ground& ground);

    void steer(const VehicleControls& controls);
    /// @param velocity horizontal, m/s, in the axes of the world
    void steer(const WorldVec2& velocity, bool jumps);

    /// Throws a crate.
    ///
    /// Fails: as World::add()
    Result<BodyId> throw_crate(const WorldPos& from_world, const Eigen::Vector3d& velocity);

    /// Begins to pull a dynamic body at a point of it; no effect for other bodies.
    void grab(BodyId body, const WorldPos& point_world);
    /// Moves the point towards which the grabbed body is pulled.
    void pull_to(const WorldPos& point_world) { hand_world_ = point_world; }
    void let_go() { grabbed_ = {}; }
    BodyId grabbed() const { return grabbed_; }
    /// The point of the grabbed body, and the point to which it is pulled.
    WorldPos grip_world() const;
    const WorldPos& hand_world() const { return hand_world_; }

    /// Simulates one step of kStep. Fails as ObjectBodies::follow()
    Result<void> step(const Ground& ground);

    /// A view from behind the vehicle or character; `picture` while it waits.
    View view(const View& picture) const;
    /// Pose of the vehicle or character, x forward.
    Pose pose() const;
    /// Turns the camera around the vehicle, radians clockwise.
    void turn_camera(double angle) { bearing_ += angle; }
    /// Turns the character, radians anticlockwise.
    void turn(double angle);

    const StepReport& last() const { return last_; }
    const LiveTotals& totals() const { return totals_; }
    /// Shows all bodies. Fails as BodyNodes::show()
    Result<void> show(BodyNodes& nodes);

private:
    struct Entry {
        WorldVec2 place_world;
        Eigen::Vector2d along_world;
    };

    LiveWorld(const Terrain& terrain, World world, ObjectBodies objects);
    void enter(const Ground& ground);
    void follow(const Ground& ground);
    void pull();
    WorldPos floor_at(const WorldVec2& place_world) const;

    const Terrain* terrain_;
    World world_;
    ObjectBodies objects_;
    std::vector<BodyId> scene_ids_, thrown_;
    std::vector<BodyNeed> needs_;  // scratch
    Being being_ = Being::camera;
    VehicleKind kind_ = VehicleKind::truck;
    std::optional<Entry> entry_;  // of a vehicle or character that waits for its ground
    BodyId body_{};
    Eigen::Vector2d heading_ = Eigen::Vector2d::UnitY();  // of the character
    double walked_ = 0.0;                                 // metres on its feet
    double bearing_ = 0.0;  // of the camera, radians clockwise from behind
    std::optional<ChaseCamera> camera_;
    BodyId grabbed_{};
    Eigen::Vector3d grip_body_ = Eigen::Vector3d::Zero();  // in the frame of the grabbed body
    WorldPos hand_world_ = WorldPos::Zero();
    StepReport last_;
    LiveTotals totals_;
};

}  // namespace terrane::tools
