// SPDX-License-Identifier: MIT
#include "bodies/body_checks.h"
#include "bodies/body_world_state.h"

#include <terrane/collision/bodies.h>
#include <terrane/terrain/assert.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

namespace terrane {
namespace {

using internal::check_state;
using internal::check_value;
using internal::check_vector;
using internal::RigidBody;

constexpr double kReachTime = 0.1;  // seconds: the longest step that needs() allows for

Result<void> check_settings(const BodySettings& settings) {
    if (auto ok = check(settings.shape); !ok) return ok;
    if (auto ok = check_value("mass", settings.mass, 1e-9, 1e12, "kg"); !ok) return ok;
    if (auto ok = check_value("friction", settings.friction, 0.0, 1e6); !ok) return ok;
    if (auto ok = check_value("restitution", settings.restitution, 0.0, 1.0); !ok) return ok;
    if (auto ok = check_value("contact_tolerance", settings.contact_tolerance, 0.0, 1e3, "m");
        !ok) {
        return ok;
    }
    if (settings.contact_tolerance == 0.0 && !(default_contact_tolerance(settings.shape) > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "contact_tolerance must be given for a shape without thickness, got 0");
    }
    return {};
}

Result<void> check_index(std::size_t body, std::size_t count) {
    if (body < count) return {};
    return fail(ErrorCode::invalid_argument,
                "body must be below " + std::to_string(count) + ", got " + std::to_string(body));
}

/// @param shape that of the settings, centred
RigidBody make_body(const BodySettings& settings, const Shape& shape) {
    RigidBody body;
    body.radius = bounding_radius(shape);
    body.thickness = smallest_half_extent(shape);
    body.mass = internal::make_mass_properties(shape, settings.mass);
    body.friction = settings.friction;
    body.restitution = settings.restitution;
    body.tolerance = settings.contact_tolerance;
    return body;
}

void mix(std::uint64_t& hash, std::uint64_t value) {
    hash = (hash ^ value) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 29;
}

void mix(std::uint64_t& hash, const Eigen::Vector3d& value) {
    for (int axis = 0; axis < 3; ++axis) mix(hash, std::bit_cast<std::uint64_t>(value[axis]));
}

}  // namespace

BodyWorld::BodyWorld(std::unique_ptr<State> state) : state_(std::move(state)) {}
BodyWorld::BodyWorld(BodyWorld&&) noexcept = default;
BodyWorld& BodyWorld::operator=(BodyWorld&&) noexcept = default;
BodyWorld::~BodyWorld() = default;

Result<BodyWorld> BodyWorld::create(const BodyWorldSettings& settings) {
    if (auto ok = check_vector("gravity", settings.gravity, 1e4, "m/s^2"); !ok) {
        return tl::unexpected<Error>(ok.error());
    }
    if (auto ok = check_value("max_substep", settings.max_substep, 1e-5, 1.0, "s"); !ok) {
        return tl::unexpected<Error>(ok.error());
    }
    if (auto ok = check_value("worker_count", settings.worker_count, 1, 64); !ok) {
        return tl::unexpected<Error>(ok.error());
    }
    return BodyWorld(std::make_unique<State>(settings));
}

Result<std::size_t> BodyWorld::add(const BodySettings& settings, const BodyState& state) {
    if (auto ok = check_settings(settings); !ok) return tl::unexpected<Error>(ok.error());
    if (auto ok = check_state(state); !ok) return tl::unexpected<Error>(ok.error());
    BodySettings complete = settings;
    if (complete.contact_tolerance == 0.0) {
        complete.contact_tolerance = default_contact_tolerance(settings.shape);
    }
    Result<internal::CentredShape> centred = internal::make_centred(settings.shape);
    if (!centred) return tl::unexpected<Error>(centred.error());
    const RigidBody body = make_body(complete, centred->shape);
    return state_->add(body, std::move(*centred), complete, state);
}

Result<void> BodyWorld::set_state(std::size_t body, const BodyState& state) {
    if (auto ok = check_index(body, state_->bodies.size()); !ok) return ok;
    if (auto ok = check_state(state); !ok) return ok;
    state_->replace(body, state);
    return {};
}

Result<void> BodyWorld::apply_impulse(std::size_t body, const WorldPos& point_world,
                                      const Eigen::Vector3d& impulse) {
    if (auto ok = check_index(body, state_->bodies.size()); !ok) return ok;
    if (auto ok = check_vector("point_world", point_world, 2e9, "m"); !ok) return ok;
    if (auto ok = check_vector("impulse", impulse, 1e18, "N s"); !ok) return ok;
    BodyState pushed = state_->states[body];
    const RigidBody& rigid = state_->bodies[body];
    const Eigen::Vector3d moment = internal::cross(point_world - rigid.pose.translation, impulse);
    pushed.velocity = rigid.velocity.linear + rigid.mass.inverse_mass * impulse;
    pushed.angular_velocity =
        rigid.velocity.angular +
        internal::apply_tensor(rigid.pose.rotation, rigid.mass.inverse_inertia, moment);
    if (auto ok = check_state(pushed); !ok) return ok;
    state_->set_velocity(body, {pushed.velocity, pushed.angular_velocity});
    return {};
}

std::span<const BodyState> BodyWorld::states() const { return state_->states; }

std::span<const BodySettings> BodyWorld::settings() const { return state_->body_settings; }

std::span<const BodyNeed> BodyWorld::needs() {
    for (std::size_t i = 0; i < state_->bodies.size(); ++i) {
        const RigidBody& body = state_->bodies[i];
        // An impact may turn a body anywhere, so the reach of a long step counts in every direction.
        const double speed = internal::length(body.velocity.linear) +
                             body.radius * internal::length(body.velocity.angular);
        state_->needs[i] = {body.pose.translation, body.velocity.linear,
                            body.radius + body.tolerance + kReachTime * speed};
    }
    return state_->needs;
}

StepReport BodyWorld::step(const Ground& ground, double dt) {
    TERRANE_ASSERT(dt > 0.0 && dt <= 1.0, "dt must be > 0 and at most 1 s");
    return state_->step(ground, dt);
}

std::uint64_t BodyWorld::state_hash() const {
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

}  // namespace terrane
