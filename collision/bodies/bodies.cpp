// SPDX-License-Identifier: MIT
#include "body_world_state.h"

#include <terrane/collision/bodies.h>
#include <terrane/terrain/assert.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

namespace terrane {
namespace {

using internal::RigidBody;

constexpr double kMaxPlace = 1e9;        // metres
constexpr double kMaxSpeed = 1e6;        // metres a second
constexpr double kMaxSpin = 1e6;         // radians a second
constexpr double kRotationSlack = 1e-6;  // of a rotation's columns from orthonormal
constexpr double kReachTime = 0.1;       // seconds: the longest step that needs() looks ahead for

std::string spell(double value) { return std::to_string(value); }

Result<void> check_value(const char* name, double value, double low, double high) {
    if (value >= low && value <= high) return {};
    return fail(ErrorCode::invalid_argument, std::string(name) + " must be " + spell(low) + " to " +
                                                 spell(high) + ", got " + spell(value));
}

Result<void> check_vector(const char* name, const Eigen::Vector3d& value, double limit) {
    static constexpr const char* kAxes[] = {".x", ".y", ".z"};
    for (int axis = 0; axis < 3; ++axis) {
        const std::string component = std::string(name) + kAxes[axis];
        if (auto ok = check_value(component.c_str(), value[axis], -limit, limit); !ok) return ok;
    }
    return {};
}

Result<void> check_rotation(const Eigen::Matrix3d& rotation) {
    for (int a = 0; a < 3; ++a) {
        const Eigen::Vector3d column = rotation.col(a);
        if (auto ok = check_vector("pose.rotation", column, 1.0 + kRotationSlack); !ok) return ok;
    }
    double worst = 0.0;
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            const double product = internal::dot(rotation.col(a), rotation.col(b));
            worst = std::max(worst, std::abs(product - (a == b ? 1.0 : 0.0)));
        }
    }
    const double determinant =
        internal::dot(rotation.col(0), internal::cross(rotation.col(1), rotation.col(2)));
    if (worst <= kRotationSlack && determinant > 0.0) return {};
    return fail(ErrorCode::invalid_argument,
                "pose.rotation must be orthonormal with determinant 1, got determinant " +
                    spell(determinant) + " and columns off by " + spell(worst));
}

Result<void> check_state(const BodyState& state) {
    if (auto ok = check_vector("pose.translation", state.pose.translation, kMaxPlace); !ok)
        return ok;
    if (auto ok = check_rotation(state.pose.rotation); !ok) return ok;
    if (auto ok = check_vector("velocity", state.velocity, kMaxSpeed); !ok) return ok;
    return check_vector("angular_velocity", state.angular_velocity, kMaxSpin);
}

Result<void> check_settings(const BodySettings& settings) {
    if (auto ok = check(settings.shape); !ok) return ok;
    // Nothing computes the inertia of the others.
    const bool is_hull = std::holds_alternative<ConvexHull>(settings.shape);
    if (is_hull || std::holds_alternative<Compound>(settings.shape)) {
        return fail(ErrorCode::invalid_argument,
                    std::string("shape of a body must be a sphere, a capsule or a box, got a ") +
                        (is_hull ? "convex hull" : "compound"));
    }
    if (auto ok = check_value("mass", settings.mass, 1e-9, 1e12); !ok) return ok;
    if (auto ok = check_value("friction", settings.friction, 0.0, 1e6); !ok) return ok;
    if (auto ok = check_value("restitution", settings.restitution, 0.0, 1.0); !ok) return ok;
    if (auto ok = check_value("contact_tolerance", settings.contact_tolerance, 0.0, 1e3); !ok) {
        return ok;
    }
    if (settings.contact_tolerance == 0.0 && !(default_contact_tolerance(settings.shape) > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "contact_tolerance must be given for a shape without thickness, got 0");
    }
    return {};
}

RigidBody make_body(const BodySettings& settings, const BodyState& state) {
    RigidBody body;
    body.parts[0].shape = settings.shape;
    body.radius = bounding_radius(settings.shape);
    body.thickness = smallest_half_extent(settings.shape);
    body.mass = internal::make_mass_properties(settings.shape, settings.mass);
    body.friction = settings.friction;
    body.restitution = settings.restitution;
    body.tolerance = settings.contact_tolerance;
    body.pose = state.pose;
    body.velocity = {state.velocity, state.angular_velocity};
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
    if (auto ok = check_vector("gravity", settings.gravity, 1e4); !ok) {
        return tl::unexpected<Error>(ok.error());
    }
    if (auto ok = check_value("max_substep", settings.max_substep, 1e-5, 1.0); !ok) {
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
    return state_->add(make_body(complete, state), complete, state);
}

Result<void> BodyWorld::set_state(std::size_t body, const BodyState& state) {
    if (body >= state_->bodies.size()) {
        return fail(ErrorCode::invalid_argument, "body must be below " +
                                                     std::to_string(state_->bodies.size()) +
                                                     ", got " + std::to_string(body));
    }
    if (auto ok = check_state(state); !ok) return ok;
    state_->replace(body, make_body(state_->body_settings[body], state), state);
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
