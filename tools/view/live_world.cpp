// SPDX-License-Identifier: MIT
#include "view/live_world.h"

#include "record/run_bodies.h"

#include <terrane/collision/ground_queries.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace terrane::tools {
namespace {

constexpr double kCrateHalfSide = 0.4;     // metres
constexpr double kCrateMass = 25.0;        // kilograms
constexpr double kJumpSpeed = 4.5;         // m/s
constexpr double kWalkerClearance = 0.02;  // metres above the ground at the start
constexpr double kTruckHalfLength = 2.3;   // metres; the camera's defaults fit it

const CharacterSettings kWalker;  // the defaults

Eigen::Vector2d unit_or(const Eigen::Vector2d& v, const Eigen::Vector2d& otherwise) {
    return v.norm() > 1e-6 ? Eigen::Vector2d(v.normalized()) : otherwise;
}

// The contact tolerance of a body; the body's own if its shape is flat.
double tolerance_of(const BodySettings& body, const LiveSettings& settings) {
    constexpr double kShare = 0.1;  // of the smallest half extent
    const double most = kShare * smallest_half_extent(body.shape);
    return most > 0.0 ? std::min(settings.contact_tolerance, most) : body.contact_tolerance;
}

}  // namespace

LiveWorld::LiveWorld(const Terrain& terrain, World world, ObjectBodies objects)
    : terrain_(&terrain), world_(std::move(world)), objects_(std::move(objects)) {}

Result<LiveWorld> LiveWorld::create(const Terrain& terrain, bool has_bodies) {
    WorldSettings settings;
    settings.report_contacts = true;
    TERRANE_TRY(World world, World::create(settings));
    TERRANE_TRY(ObjectBodies objects, ObjectBodies::create(terrain.source, terrain.objects.get()));
    LiveWorld made(terrain, std::move(world), std::move(objects));
    if (has_bodies) {
        TERRANE_TRY(add_bodies(terrain.bodies, made.world_));
        made.scene_count_ = terrain.bodies.size();
    }
    TERRANE_TRY(add_bodies(made.objects_.placed(), made.world_));
    return made;
}

WorldPos LiveWorld::floor_at(const WorldVec2& place_world) const {
    return {place_world.x(), place_world.y(),
            terrain_->source->height(place_world.x(), place_world.y())};
}

std::span<const BodyNeed> LiveWorld::needs() {
    const std::span<const BodyNeed> of_bodies = world_.needs();
    needs_.assign(of_bodies.begin(), of_bodies.end());
    constexpr double kReach = 4.0;  // metres around a vehicle or character that waits
    if (entry_) needs_.push_back({.centre_world = floor_at(entry_->place_world), .radius = kReach});
    return needs_;
}

void LiveWorld::drive(VehicleKind kind, const WorldVec2& place_world, double below,
                      const Eigen::Vector2d& along_world) {
    leave();
    being_ = Being::driver;
    kind_ = kind;
    entry_ = LiveEntry{place_world, below, unit_or(along_world, Eigen::Vector2d::UnitY())};
}

void LiveWorld::walk(const WorldVec2& place_world, double below,
                     const Eigen::Vector2d& along_world) {
    leave();
    being_ = Being::walker;
    entry_ = LiveEntry{place_world, below, unit_or(along_world, Eigen::Vector2d::UnitY())};
}

void LiveWorld::leave() {
    // a valid id can be removed
    if (body_.is_valid()) (void)world_.remove(body_);
    body_ = {};
    entry_.reset();
    camera_.reset();
    being_ = Being::camera;
    input_ = {};
}

// Puts what waits on the ground if that is resident.
void LiveWorld::enter(const Ground& ground) {
    const Eigen::Vector2d place = entry_->place_world, along = entry_->along_world;
    const HeightAnswer found = ground.height_below(place.x(), place.y(), entry_->below);
    if (found.status == QueryStatus::not_resident) return;
    WorldPos floor = floor_at(entry_->place_world);
    const double rise = found.status == QueryStatus::ok ? found.height - floor.z() : 0.0;
    floor.z() += rise;
    if (being_ == Being::driver) {
        const VehicleSettings settings = make_vehicle(kind_);
        Pose sloped = slope_pose(*terrain_->source, place, along, settings);
        sloped.translation.z() += rise;
        const Result<Pose> pose = pose_on_ground(settings, sloped, ground);
        if (!pose) return;
        const Result<BodyId> added = world_.add_vehicle(settings, *pose);
        if (!added) return;
        body_ = *added;
        ChaseCameraSettings camera;
        camera.behind += 2.0 * (settings.chassis_half_extents.x() - kTruckHalfLength);
        camera_.emplace(*terrain_->source, *pose, camera);
    } else {
        Pose at;
        at.translation = floor;
        at.translation.z() += kWalker.radius + kWalker.half_height;
        const Shape shape = Capsule{.radius = kWalker.radius, .half_height = kWalker.half_height};
        const LiftAnswer lift = compute_lift(shape, at, ground);
        if (lift.status != QueryStatus::ok || !std::isfinite(lift.lift)) return;
        at.translation.z() += lift.lift + kWalkerClearance;
        const Result<BodyId> added = world_.add_character(kWalker, at.translation);
        if (!added) return;
        body_ = *added;
        input_.heading = along;
        gait_ = {.heading = along};
        camera_.emplace(*terrain_->source, pose(),
                        ChaseCameraSettings{.behind = 6.0, .above = 1.8, .target_above = 0.5});
    }
    entry_.reset();
}

void LiveWorld::right(const Ground& ground) {
    const VehicleSettings* settings = world_.vehicle_settings(body_);
    if (settings == nullptr) return;
    const Pose& now = world_.state(body_).pose;
    const Eigen::Vector2d along = unit_or(now.rotation.col(0).head<2>(), Eigen::Vector2d::UnitY());
    const Result<Pose> upright = pose_on_ground(
        *settings, slope_pose(*terrain_->source, now.translation.head<2>(), along, *settings),
        ground);
    // the id and the pose are valid: the call cannot fail
    if (upright) (void)world_.teleport(body_, {.pose = *upright});
}

void LiveWorld::steer(const VehicleControls& controls) { input_.vehicle = controls; }

void LiveWorld::steer(const WorldVec2& velocity, bool jumps) {
    input_.walker = {.velocity = velocity, .jump_speed = jumps ? kJumpSpeed : 0.0};
}

void LiveWorld::set_input(const LiveInput& input) { input_ = input; }

Result<void> LiveWorld::set(const LiveSettings& settings) {
    if (settings.substeps < 1 || settings.substeps > LiveSettings::kMostSubsteps) {
        return fail(ErrorCode::invalid_argument,
                    fmt::format("substeps must be 1 to {}, got {}", LiveSettings::kMostSubsteps,
                                settings.substeps));
    }
    TERRANE_TRY(world_.set_max_substep(kStep / settings.substeps));
    const bool has_tolerance = settings.contact_tolerance != settings_.contact_tolerance;
    for (std::size_t i = 0; has_tolerance && i < world_.states().size(); ++i) {
        const BodyId id = world_.id(i);
        if (!id.is_valid() || world_.settings(id).type != BodyType::dynamic_body) continue;
        if (world_.vehicle(id) != nullptr || world_.character(id) != nullptr) continue;
        BodySettings body = world_.settings(id);
        body.contact_tolerance = tolerance_of(body, settings);
        TERRANE_TRY(world_.change(id, body));
    }
    settings_ = settings;
    return {};
}

LiveState LiveWorld::save() const {
    return {.world = world_.save(),
            .settings = settings_,
            .input = input_,
            .being = being_,
            .kind = kind_,
            .entry = entry_,
            .body = body_,
            .gait = gait_,
            .camera = camera_,
            .thrown = thrown_,
            .last = figures_of(last_),
            .world_hash = world_.state_hash()};
}

Result<void> LiveWorld::restore(const LiveState& state) {
    TERRANE_TRY(world_, World::load(state.world));
    settings_ = state.settings;
    objects_.take_over();
    input_ = state.input;
    being_ = state.being;
    kind_ = state.kind;
    entry_ = state.entry;
    body_ = state.body;
    gait_ = state.gait;
    camera_ = state.camera;
    thrown_ = state.thrown;
    return {};
}

void LiveWorld::turn(double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    input_.heading = Eigen::Vector2d(c * input_.heading.x() - s * input_.heading.y(),
                                     s * input_.heading.x() + c * input_.heading.y())
                         .normalized();
}

Result<BodyId> LiveWorld::throw_crate(const WorldPos& from_world, const Eigen::Vector3d& velocity) {
    BodyPlacement placement;
    placement.pose.translation = from_world;
    placement.velocity = velocity;
    if (thrown_.size() >= kMostThrown) {
        std::rotate(thrown_.begin(), thrown_.begin() + 1, thrown_.end());
        TERRANE_TRY(world_.teleport(thrown_.back(), placement));
        return thrown_.back();
    }
    BodySettings settings;
    settings.shape = Box{Eigen::Vector3d::Constant(kCrateHalfSide)};
    settings.mass = kCrateMass;
    settings.contact_tolerance = tolerance_of(settings, settings_);
    TERRANE_TRY(const BodyId added, world_.add(settings, placement));
    thrown_.push_back(added);
    return added;
}

void LiveWorld::grab(BodyId body, const WorldPos& point_world) {
    if (!world_.contains(body) || body == body_) return;
    if (world_.settings(body).type != BodyType::dynamic_body) return;
    const Pose& pose = world_.state(body).pose;
    input_.grabbed = body;
    input_.grip_body = pose.rotation.transpose() * (point_world - pose.translation);
    input_.hand_world = point_world;
}

WorldPos LiveWorld::grip_world() const {
    return world_.state(input_.grabbed).pose * input_.grip_body;
}

std::vector<RunAction> actions_of(const LiveInput& input, Being being, BodyId body) {
    std::vector<RunAction> actions;
    if (body.is_valid() && being == Being::driver)
        actions.emplace_back(DriveVehicle{body, input.vehicle});
    if (body.is_valid() && being == Being::walker)
        actions.emplace_back(WalkCharacter{body, input.walker, input.heading});
    if (input.grabbed.is_valid())
        actions.emplace_back(PullBody{input.grabbed, input.grip_body, input.hand_world});
    return actions;
}

Result<void> LiveWorld::step(const Ground& ground) {
    if (entry_) enter(ground);
    TERRANE_TRY(objects_.follow(world_, ground));
    const std::vector<RunAction> actions = actions_of(input_, being_, body_);
    // valid ids and controls within their ranges cannot fail
    for (const RunAction& action : actions) (void)apply(action, world_);
    last_ = world_.step(ground, kStep);
    ++totals_.steps;
    totals_.fell_through += last_.too_deep;
    totals_.placed_deep += last_.placed_deep;
    totals_.max_depth_m = std::max(totals_.max_depth_m, last_.max_depth_m);
    for (const RunAction& action : actions) {
        if (const auto* walk = std::get_if<WalkCharacter>(&action))
            advance_gait(*walk, *world_.character(body_), kStep, gait_);
    }
    if (camera_) {
        camera_->set_bearing(input_.bearing);
        camera_->follow(pose(), kStep, ground, world_, body_);
    }
    return {};
}

Eigen::Vector3d LiveWorld::velocity() const {
    return body_.is_valid() ? world_.state(body_).velocity
                            : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

void LiveWorld::place_anew(const Aabb& box_world) {
    for (std::size_t i = 0; i < world_.states().size(); ++i) {
        const BodyId id = world_.id(i);
        if (!id.is_valid() || world_.settings(id).type != BodyType::dynamic_body) continue;
        const BodyState state = world_.state(id);
        const Eigen::Vector3d reach =
            Eigen::Vector3d::Constant(bounding_radius(world_.settings(id).shape));
        const WorldPos& p = state.pose.translation;
        const bool is_apart = ((p + reach).array() < box_world.low.array()).any() ||
                              ((p - reach).array() > box_world.high.array()).any();
        // the id and the state are valid: the call cannot fail
        if (!is_apart) (void)world_.teleport(id, state);
    }
}

void LiveWorld::change_ground(const Aabb& box_world) {
    if (!(box_world.low.x() <= box_world.high.x())) return;
    world_.wake(box_world);
    place_anew(box_world);
}

Pose LiveWorld::pose() const {
    Pose pose;
    if (!body_.is_valid()) return pose;
    pose = world_.state(body_).pose;
    return being_ == Being::walker
               ? CharacterGait{.heading = input_.heading}.world_from_capsule(pose.translation)
               : pose;
}

View LiveWorld::view(const View& picture) const {
    return camera_ ? camera_->view(picture) : picture;
}

Result<void> LiveWorld::show(BodyNodes& nodes) {
    return show_view(world_, {input_.heading, gait_.walked}, scene_count_, nodes);
}

}  // namespace terrane::tools
