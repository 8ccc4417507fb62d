// SPDX-License-Identifier: MIT
#pragma once

#include "flight/cameras.h"
#include "frames/body_nodes.h"
#include "record/run_record.h"
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

/// A vehicle or character that waits until its ground is resident.
struct LiveEntry {
    WorldVec2 place_world = WorldVec2::Zero();
    double below = 0.0;  ///< it enters on the highest ground at or below this height, metres
    WorldVec2 along_world = WorldVec2(0.0, 1.0);  ///< heading, unit
};

/// How the user steers during a step.
struct LiveInput {
    VehicleControls vehicle = {};
    CharacterControls walker = {};
    WorldVec2 heading = WorldVec2(0.0, 1.0);  ///< of the walker, unit
    double bearing = 0.0;                     ///< of the camera, radians clockwise from behind
    BodyId grabbed = {};
    Eigen::Vector3d grip_body = Eigen::Vector3d::Zero();  ///< in the frame of the grabbed body
    WorldPos hand_world = WorldPos::Zero();               ///< point to which it is pulled
};

/// How a LiveWorld simulates.
struct LiveSettings {
    static constexpr int kMostSubsteps = 16;
    int substeps = 2;  ///< of a step, 1 to kMostSubsteps
    /// Contact tolerance of dynamic bodies besides vehicles and characters, metres; thin bodies have at most a tenth of
    /// their smallest half extent.
    double contact_tolerance = 0.01;
    bool operator==(const LiveSettings&) const = default;
};

/// What acts on the world in a step in which the user steers so. `being` and `body` are those of the LiveWorld.
std::vector<RunAction> actions_of(const LiveInput& input, Being being, BodyId body);

/// Everything that a LiveWorld carries from one step to the next.
struct LiveState {
    std::vector<std::byte> world = {};  ///< World::save()
    LiveSettings settings = {};
    LiveInput input = {};
    Being being = Being::camera;
    VehicleKind kind = VehicleKind::truck;
    std::optional<LiveEntry> entry = {};
    BodyId body = {};
    CharacterGait gait = {};  ///< of the walker, in the last step
    std::optional<ChaseCamera> camera = {};
    std::vector<BodyId> thrown = {};
    StepFigures last = {};
    std::uint64_t world_hash = 0;  ///< World::state_hash()
};

/// Sums over the steps of a LiveWorld.
struct LiveTotals {
    std::uint64_t steps = 0;
    std::uint64_t fell_through =
        0;  ///< body steps that ended deeper in the ground than the tolerance
    std::uint64_t placed_deep = 0;  ///< bodies that changed ground covered
    double max_depth_m = 0.0;       ///< of any body
};

/// A world with the bodies of a scene, the crates that the user throws, and the vehicle or character that the user
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

    const LiveSettings& settings() const { return settings_; }
    /// Changes the settings from the next step on, those of the bodies at once.
    ///
    /// Fails: invalid_argument for settings out of range; bodies may have the new ones then
    Result<void> set(const LiveSettings& settings);

    /// The needs of all bodies, and of the vehicle or character that waits for its ground.
    std::span<const BodyNeed> needs();

    Being being() const { return being_; }
    /// Whether a vehicle or character waits until its ground is resident.
    bool is_waiting() const { return being_ != Being::camera && !body_.is_valid(); }
    /// The body that is steered; none for a camera, and while it waits.
    BodyId body() const { return body_; }

    /// Puts a vehicle on the ground, in place of what was steered before, as soon as the ground is resident.
    ///
    /// @param below       it enters on the highest ground at or below this height, metres, or on the heightfield
    /// @param along_world heading, horizontal, not zero
    void drive(VehicleKind kind, const WorldVec2& place_world, double below,
               const Eigen::Vector2d& along_world);
    /// Puts a character on the ground likewise.
    void walk(const WorldVec2& place_world, double below, const Eigen::Vector2d& along_world);
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
    void pull_to(const WorldPos& point_world) { input_.hand_world = point_world; }
    void let_go() { input_.grabbed = {}; }
    BodyId grabbed() const { return input_.grabbed; }
    /// The point of the grabbed body, and the point to which it is pulled.
    WorldPos grip_world() const;
    const WorldPos& hand_world() const { return input_.hand_world; }

    /// The ground has changed in a box: wakes the bodies there, and takes them as placed. Bodies that the ground now
    /// covers then come out of it, and do not count as fallen. A box with low > high has no effect.
    void change_ground(const Aabb& box_world);

    /// What the user steers in the next step.
    const LiveInput& input() const { return input_; }
    void set_input(const LiveInput& input);

    /// The state of everything.
    LiveState save() const;
    /// Returns to a state of this world. Fails as World::load()
    Result<void> restore(const LiveState& state);

    /// Simulates one step of kStep. Fails as ObjectBodies::follow()
    Result<void> step(const Ground& ground);

    /// A view from behind the vehicle or character; `picture` while it waits.
    View view(const View& picture) const;
    /// Velocity of the vehicle or character, m/s; zero without one.
    Eigen::Vector3d velocity() const;
    /// Pose of the vehicle or character, x forward.
    Pose pose() const;
    /// Turns the camera around the vehicle, radians clockwise.
    void turn_camera(double angle) { input_.bearing += angle; }
    /// Turns the character, radians anticlockwise.
    void turn(double angle);

    const StepReport& last() const { return last_; }
    const LiveTotals& totals() const { return totals_; }
    /// Shows all bodies. Fails as BodyNodes::show()
    Result<void> show(BodyNodes& nodes);

private:
    LiveWorld(const Terrain& terrain, World world, ObjectBodies objects);
    void enter(const Ground& ground);
    void place_anew(const Aabb& box_world);
    WorldPos floor_at(const WorldVec2& place_world) const;

    const Terrain* terrain_;
    World world_;
    LiveSettings settings_;
    ObjectBodies objects_;
    std::size_t scene_count_ = 0;  // of its bodies, which are the first ones
    std::vector<BodyId> thrown_;
    std::vector<BodyNeed> needs_;  // scratch
    Being being_ = Being::camera;
    VehicleKind kind_ = VehicleKind::truck;
    std::optional<LiveEntry> entry_;
    BodyId body_{};
    CharacterGait gait_;  // in the last step
    std::optional<ChaseCamera> camera_;
    LiveInput input_;
    StepReport last_;
    LiveTotals totals_;
};

}  // namespace terrane::tools
