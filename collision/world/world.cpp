// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "broadphase/body_queries.h"
#include "world/solver/body_checks.h"
#include "world/world_state.h"

#include <terrane/base/text.h>
#include <terrane/collision/world.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <utility>

namespace terrane {
namespace {

using internal::check_value;
using internal::check_vector;
using internal::RigidBody;

constexpr double kReachTime = 0.1;  // seconds: longest step assumed by needs()
constexpr double kMostImpulse = 1e18;
constexpr double kMostArmPlace =
    2.0 * internal::kMaxPlace;  // largest coordinate of a point of application, metres

void mix(std::uint64_t& hash, std::uint64_t value) {
    hash = (hash ^ value) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 29;
}

void mix(std::uint64_t& hash, const Eigen::Vector3d& value) {
    for (int axis = 0; axis < 3; ++axis) mix(hash, std::bit_cast<std::uint64_t>(value[axis]));
}

/// Settings with the default tolerance filled in, and the shape, centred if the body is dynamic.
struct MadeBody {
    BodySettings settings;
    internal::CentredShape shape;
};

Result<MadeBody> make_body(const BodySettings& settings, const BodyPlacement& placement) {
    TERRANE_TRY(internal::check_body(settings, placement));
    MadeBody made{settings, {settings.shape, {}}};
    if (settings.contact_tolerance == 0.0) {
        made.settings.contact_tolerance = default_contact_tolerance(settings.shape);
    }
    if (settings.type != BodyType::dynamic_body) return made;
    TERRANE_TRY(internal::CentredShape centred, internal::make_centred(settings.shape));
    made.shape = std::move(centred);
    return made;
}

}  // namespace

World::World(std::unique_ptr<State> state) : state_(std::move(state)) {}
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

Result<World> World::create(const WorldSettings& settings) {
    TERRANE_TRY(internal::check_world(settings));
    return World(std::make_unique<State>(settings));
}

Result<BodyId> World::add(const BodySettings& settings, const BodyPlacement& placement) {
    TERRANE_TRY(MadeBody made, make_body(settings, placement));
    return state_->add(made.settings, std::move(made.shape), placement);
}

Result<void> World::State::check_body_id(BodyId body) const {
    if (ids.contains(body)) return {};
    const bool is_stale = body.index < ids.slot_count();
    return fail(ErrorCode::invalid_argument,
                "body must be in the world, got " +
                    (body.is_valid() ? "index " + std::to_string(body.index) + ", generation " +
                                           std::to_string(body.generation)
                                     : std::string("no body")) +
                    (is_stale ? ", which was removed" : ""));
}

Result<void> World::State::check_dynamic(BodyId body) const {
    TERRANE_TRY(check_body_id(body));
    if (type(body.index) == BodyType::dynamic_body) return {};
    return fail(ErrorCode::invalid_argument, "body must be dynamic, got a " +
                                                 internal::to_string(type(body.index)) +
                                                 " body of index " + std::to_string(body.index));
}

Result<BodyId> World::add_vehicle(const VehicleSettings& settings, const Pose& world_from_chassis) {
    TERRANE_TRY(internal::check_vehicle(settings));
    auto vehicle = std::make_unique<internal::Vehicle>(settings);
    TERRANE_TRY(Compound shape, internal::make_chassis_shape(settings, vehicle->wheels()));
    const double tolerance = std::min(default_contact_tolerance(Box{settings.chassis_half_extents}),
                                      default_contact_tolerance(Sphere{settings.wheel_radius}));
    const BodySettings body{.shape = shape,
                            .mass = settings.mass,
                            .friction = settings.friction,
                            .restitution = settings.restitution,
                            .contact_tolerance = tolerance,
                            .filter = settings.filter};
    BodyState state;
    state.pose = world_from_chassis;
    TERRANE_TRY(internal::check_body(body, state));
    return state_->add_vehicle(std::move(vehicle), body, std::move(shape), state);
}

Result<void> World::set_controls(BodyId vehicle, const VehicleControls& controls) {
    TERRANE_TRY(state_->check_body_id(vehicle));
    internal::Vehicle* const driven = state_->vehicle(vehicle);
    if (driven == nullptr) {
        return fail(ErrorCode::invalid_argument, "body must be a vehicle, got the body of index " +
                                                     std::to_string(vehicle.index));
    }
    if (driven->set_controls(controls)) state_->wake(vehicle.index);
    return {};
}

Result<BodyId> World::add_character(const CharacterSettings& settings,
                                    const WorldPos& place_world) {
    TERRANE_TRY(internal::check_character(settings));
    const Capsule capsule{settings.radius, settings.half_height};
    BodySettings body{.shape = capsule,
                      .mass = settings.mass,
                      .friction = 0.0,
                      .restitution = 0.0,
                      .contact_tolerance = settings.contact_tolerance,
                      .filter = settings.filter,
                      .rotates = false};
    if (body.contact_tolerance == 0.0) body.contact_tolerance = default_contact_tolerance(capsule);
    BodyState state;
    state.pose.translation = place_world;
    TERRANE_TRY(internal::check_body(body, state));
    return state_->add_character(settings, body, state);
}

Result<void> World::set_controls(BodyId character, const CharacterControls& controls) {
    TERRANE_TRY(state_->check_body_id(character));
    internal::Character* const driven = state_->character(character);
    if (driven == nullptr) {
        return fail(
            ErrorCode::invalid_argument,
            "body must be a character, got the body of index " + std::to_string(character.index));
    }
    if (driven->set_controls(controls)) state_->wake(character.index);
    return {};
}

const CharacterState* World::character(BodyId body) const {
    const internal::Character* const character = state_->character(body);
    return character == nullptr ? nullptr : &character->state();
}

const CharacterSettings* World::character_settings(BodyId body) const {
    const internal::Character* const character = state_->character(body);
    return character == nullptr ? nullptr : &character->settings();
}

const VehicleState* World::vehicle(BodyId body) const {
    const internal::Vehicle* const vehicle = state_->vehicle(body);
    return vehicle == nullptr ? nullptr : &vehicle->state();
}

const VehicleSettings* World::vehicle_settings(BodyId body) const {
    const internal::Vehicle* const vehicle = state_->vehicle(body);
    return vehicle == nullptr ? nullptr : &vehicle->settings();
}

Result<void> World::remove(BodyId body) {
    TERRANE_TRY(state_->check_body_id(body));
    state_->remove(body);
    return {};
}

Result<void> World::change(BodyId body, const BodySettings& settings) {
    TERRANE_TRY(state_->check_body_id(body));
    if (state_->vehicle(body) != nullptr || state_->character(body) != nullptr) {
        return fail(ErrorCode::invalid_argument,
                    "body must be neither a vehicle nor a character, got that of index " +
                        std::to_string(body.index));
    }
    BodyState state = state_->states[body.index];
    if (settings.type == BodyType::static_body) {
        state.velocity = state.angular_velocity = Eigen::Vector3d::Zero();
    }
    if (!settings.rotates) state.angular_velocity.setZero();
    TERRANE_TRY(MadeBody made, make_body(settings, state));
    state_->change(body.index, made.settings, std::move(made.shape), state);
    return {};
}

Result<void> World::teleport(BodyId body, const BodyPlacement& placement) {
    TERRANE_TRY(state_->check_body_id(body));
    TERRANE_TRY(internal::check_body(state_->body_settings[body.index], placement));
    state_->place(body.index, placement);
    return {};
}

Result<BodyMove> World::move_to(BodyId body, const Pose& world_from_shape, const Ground& ground) {
    TERRANE_TRY(state_->check_dynamic(body));
    BodyState state;
    state.pose = world_from_shape;
    TERRANE_TRY(internal::check_state(state));
    return state_->move_to(body.index, world_from_shape, ground);
}

Result<void> World::move_kinematic(BodyId body, const Pose& world_from_shape, double dt) {
    TERRANE_TRY(state_->check_body_id(body));
    if (state_->type(body.index) != BodyType::kinematic_body) {
        return fail(ErrorCode::invalid_argument, "body must be kinematic, got a " +
                                                     internal::to_string(state_->type(body.index)) +
                                                     " body of index " +
                                                     std::to_string(body.index));
    }
    TERRANE_TRY(check_value("dt", dt, 1e-6, kMostStep, "s"));
    BodyState state;
    state.pose = world_from_shape;
    const Pose& now = state_->bodies[body.index].pose;
    state.velocity = (world_from_shape.translation - now.translation) / dt;
    TERRANE_TRY(internal::check_state(state));
    state.angular_velocity = rotation_vector_between(now.rotation, world_from_shape.rotation) / dt;
    TERRANE_TRY(internal::check_state(state));
    state_->set_velocity(body.index, {state.velocity, state.angular_velocity});
    if (state.velocity.isZero(0.0) && state.angular_velocity.isZero(0.0)) {
        // The body is already there up to rounding: it does not move, and sleepers on it stay asleep.
        state_->bodies[body.index].pose = state_->states[body.index].pose = world_from_shape;
        state_->island_solver.forget_bounds(body.index);
        return {};
    }
    state_->records[body.index].target = {world_from_shape, dt};
    return {};
}

Result<void> World::set_velocity(BodyId body, const Eigen::Vector3d& velocity,
                                 const Eigen::Vector3d& angular_velocity) {
    TERRANE_TRY(state_->check_body_id(body));
    BodyState state = state_->states[body.index];
    state.velocity = velocity;
    state.angular_velocity = angular_velocity;
    TERRANE_TRY(internal::check_body(state_->body_settings[body.index], state));
    state_->set_velocity(body.index, {velocity, angular_velocity});
    return {};
}

Result<void> World::apply_impulse(BodyId body, const WorldPos& point_world,
                                  const Eigen::Vector3d& impulse) {
    TERRANE_TRY(state_->check_dynamic(body));
    TERRANE_TRY(check_vector("point_world", point_world, kMostArmPlace, "m"));
    TERRANE_TRY(check_vector("impulse", impulse, kMostImpulse, "N s"));
    const RigidBody& rigid = state_->bodies[body.index];
    return state_->push(body, impulse,
                        internal::cross(point_world - rigid.pose.translation, impulse));
}

Result<void> World::apply_angular_impulse(BodyId body, const Eigen::Vector3d& angular_impulse) {
    TERRANE_TRY(state_->check_dynamic(body));
    TERRANE_TRY(check_vector("angular_impulse", angular_impulse, kMostImpulse, "N m s"));
    return state_->push(body, Eigen::Vector3d::Zero(), angular_impulse);
}

Result<void> World::State::push(BodyId body, const Eigen::Vector3d& impulse,
                                const Eigen::Vector3d& angular_impulse) {
    const RigidBody& rigid = bodies[body.index];
    BodyState pushed = states[body.index];
    pushed.velocity = rigid.velocity.linear + rigid.mass.inverse_mass * impulse;
    pushed.angular_velocity =
        rigid.velocity.angular +
        internal::apply_tensor(rigid.pose.rotation, rigid.mass.inverse_inertia, angular_impulse);
    TERRANE_TRY(internal::check_state(pushed));
    set_velocity(body.index, {pushed.velocity, pushed.angular_velocity});
    return {};
}

Result<void> World::add_force(BodyId body, const WorldPos& point_world,
                              const Eigen::Vector3d& force) {
    TERRANE_TRY(state_->check_dynamic(body));
    TERRANE_TRY(check_vector("point_world", point_world, kMostArmPlace, "m"));
    const Eigen::Vector3d arm = point_world - state_->bodies[body.index].pose.translation;
    const Eigen::Vector3d before = state_->records[body.index].force;
    TERRANE_TRY(add_force(body, force));
    auto ok = add_torque(body, internal::cross(arm, force));
    if (!ok) state_->records[body.index].force = before;  // leave everything unchanged
    return ok;
}

// Forces and torques are limited so that a step of one second keeps velocities in range.

Result<void> World::State::check_force(std::size_t index, const Eigen::Vector3d& force) const {
    const double inverse_mass = bodies[index].mass.inverse_mass;
    const double most = inverse_mass > 0.0 ? internal::kMaxSpeed / inverse_mass : 0.0;
    return check_vector("force", force, most, "N");
}

Result<void> World::State::check_torque(std::size_t index, const Eigen::Vector3d& torque) const {
    const double inverse_inertia = bodies[index].mass.inverse_inertia.maxCoeff();
    const double most = internal::kMaxSpin / std::max(inverse_inertia, 1e-12);
    return check_vector("torque", torque, most, "N m");
}

Result<void> World::add_force(BodyId body, const Eigen::Vector3d& force) {
    TERRANE_TRY(state_->check_dynamic(body));
    const Eigen::Vector3d sum = state_->records[body.index].force + force;
    TERRANE_TRY(state_->check_force(body.index, sum));
    state_->records[body.index].force = sum;
    state_->wake(body.index);
    return {};
}

Result<void> World::add_torque(BodyId body, const Eigen::Vector3d& torque) {
    TERRANE_TRY(state_->check_dynamic(body));
    const Eigen::Vector3d sum = state_->records[body.index].torque + torque;
    TERRANE_TRY(state_->check_torque(body.index, sum));
    state_->records[body.index].torque = sum;
    state_->wake(body.index);
    return {};
}

Result<void> World::wake(BodyId body) {
    TERRANE_TRY(state_->check_body_id(body));
    state_->wake(body.index);
    return {};
}

void World::wake(const Aabb& box_world) {
    for (std::size_t i = 0; i < state_->bodies.size(); ++i) {
        if (!state_->is_asleep(i)) continue;
        const WorldPos& centre = state_->bodies[i].pose.translation;
        const Eigen::Vector3d reach = Eigen::Vector3d::Constant(state_->reach(i));
        if (internal::overlap(box_world, {centre - reach, centre + reach}, 0.0)) state_->wake(i);
    }
}

bool World::contains(BodyId body) const { return state_->ids.contains(body); }

BodyId World::id(std::size_t index) const { return state_->ids.id(index); }

const BodyState& World::state(BodyId body) const {
    static const BodyState absent = [] {
        BodyState state;
        state.condition = BodyCondition::removed;
        return state;
    }();
    return contains(body) ? state_->states[body.index] : absent;
}

const BodySettings& World::settings(BodyId body) const {
    TERRANE_ASSERT(contains(body), "the id names no body of this world");
    static const BodySettings absent{};
    return contains(body) ? state_->body_settings[body.index] : absent;
}

std::span<const BodyState> World::states() const { return state_->states; }

std::span<const BodySettings> World::settings() const { return state_->body_settings; }

std::span<const BodyNeed> World::needs() {
    state_->needs.clear();
    for (std::size_t i = 0; i < state_->bodies.size(); ++i) {
        if (!state_->ids.is_used(i) || state_->type(i) != BodyType::dynamic_body) continue;
        const RigidBody& body = state_->bodies[i];
        // An impact may deflect a body in any direction, so its largest motion in kReachTime is added to the radius.
        const double speed = internal::greatest_speed(body);
        state_->needs.push_back({.centre_world = body.pose.translation,
                                 .velocity = body.velocity.linear,
                                 .radius = state_->reach(i) + kReachTime * speed,
                                 .is_waiting = state_->steps[i].is_parked});
    }
    return state_->needs;
}

Result<void> World::set_max_substep(double max_substep) {
    TERRANE_TRY(internal::check_substep(max_substep));
    state_->settings.max_substep = max_substep;
    return {};
}

StepReport World::step(const Ground& ground, double dt) { return state_->step(ground, dt); }

std::span<const ContactEvent> World::contact_events() const { return state_->contacts.events(); }

std::span<const ContactPoint> World::contact_points(const ContactEvent& event) const {
    return state_->contacts.points(event);
}

std::uint64_t World::state_hash() const {
    std::uint64_t hash = state_->states.size();
    for (const BodyState& state : state_->states) {
        for (int column = 0; column < 3; ++column) {
            const Eigen::Vector3d axis = state.pose.rotation.col(column);
            mix(hash, axis);
        }
        mix(hash, state.pose.translation);
        mix(hash, state.velocity);
        mix(hash, state.angular_velocity);
        mix(hash, static_cast<std::uint64_t>(state.condition));
    }
    return hash;
}

// Spatial queries. The first query after a change builds the tree, so that a world without queries has none.

namespace {

/// Number of refits after which the tree is rebuilt: bodies that have moved far enlarge its boxes.
constexpr int kMaxRefits = 32;

}  // namespace

internal::QueryScene World::State::scene(const Ground& ground) const {
    if (!queries.is_current.load(std::memory_order_acquire)) {
        const std::lock_guard lock(queries.mutex);
        if (!queries.is_current.load(std::memory_order_relaxed)) {
            queries.update(ids, bodies);
            queries.is_current.store(true, std::memory_order_release);
        }
    }
    return {queries.bodies, &queries.tree, &ground};
}

void World::State::QueryCache::update(const internal::SlotIds& slots,
                                      std::span<const RigidBody> of_world) {
    bodies.resize(of_world.size());
    bounds.resize(of_world.size());
    for (std::size_t i = 0; i < of_world.size(); ++i) {
        bodies[i] = {};
        bounds[i] = internal::empty_box();
        if (!slots.is_used(i)) continue;
        const RigidBody& body = of_world[i];
        bodies[i] = {body.shape,  body.pose,      slots.id(i),
                     body.filter, body.is_sensor, body.friction};
        bounds[i] = internal::compute_aabb(*body.shape, body.pose);
    }
    if (tree.slot_count() == of_world.size() && ++refit_count < kMaxRefits) {
        tree.refit(bounds);
    } else {
        tree.build(bounds);
        refit_count = 0;
    }
}

RayQueryAnswer World::ray(const Ground& ground, const WorldPos& from, const WorldPos& to,
                          const QueryFilter& filter) const {
    return internal::query_ray(state_->scene(ground), from, to, filter);
}

RayQueryAnswer World::ray(const RayFan& ground, const WorldPos& from, const WorldPos& to,
                          const QueryFilter& filter) const {
    if (ground.ground() == nullptr) return {};
    internal::QueryScene scene = state_->scene(*ground.ground());
    scene.fan = &ground;
    return internal::query_ray(scene, from, to, filter);
}

CastQueryAnswer World::cast(const Ground& ground, const Shape& shape, const Motion& motion,
                            const QueryFilter& filter) const {
    return internal::query_cast(state_->scene(ground), shape, motion, filter);
}

OverlapQueryAnswer World::overlaps(const Ground& ground, const Shape& shape,
                                   const Pose& world_from_shape, std::span<BodyId> bodies_out,
                                   const QueryFilter& filter) const {
    return internal::query_overlaps(state_->scene(ground), shape, world_from_shape, filter,
                                    bodies_out);
}

NearestQueryAnswer World::nearest(const Ground& ground, const Shape& shape,
                                  const Pose& world_from_shape, double max_distance,
                                  const QueryFilter& filter) const {
    return internal::query_nearest(state_->scene(ground), shape, world_from_shape, max_distance,
                                   filter);
}

}  // namespace terrane
