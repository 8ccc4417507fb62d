// SPDX-License-Identifier: MIT
//
// A walker is a body of infinite inertia. The controls set its velocity along the supporting surface, less the
// component into contacts that are too steep to climb; the solver and the offset surface of body_step do the rest. A
// standing walker that is stopped tests a step from max_step higher up; where it could stand there it moves up and on.
#include "bodies/body_checks.h"
#include "bodies/step/body_depth.h"
#include "bodies/step/body_step.h"
#include "character/walker_state.h"

#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/walker.h>
#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::dot;
using internal::length;
using internal::RigidBody;
using internal::SolverContact;

constexpr double kMaxSubstep = 1.0 / 120.0;
constexpr double kTerminalSpeed = 1e4;  // metres a second
constexpr int kMaxSlides = 4;           // of a substep
/// A walker that moves less than this share of the wanted distance is stopped.
constexpr double kStoppedShare = 0.9;

Result<void> check_settings(const WalkerSettings& s) {
    const internal::FieldRange fields[] = {
        {"radius", s.radius, 1e-3, 1e3, "m"},
        {"half_height", s.half_height, 0.0, 1e3, "m"},
        {"max_slope", s.max_slope, 0.0, 1.57, "rad"},
        {"max_step", s.max_step, 0.0, 1e3, "m"},
        {"air_acceleration", s.air_acceleration, 0.0, 1e6, "m/s^2"},
        {"contact_tolerance", s.contact_tolerance, 0.0, 1e3, "m"},
    };
    return internal::check_fields(fields);
}

bool is_good(const WalkerControls& controls) {
    constexpr double kMaxControl = 1e4;  // metres a second
    return std::abs(controls.velocity.x()) <= kMaxControl &&
           std::abs(controls.velocity.y()) <= kMaxControl && controls.jump_speed >= 0.0 &&
           controls.jump_speed <= kMaxControl;
}

/// Cosine with the same bits on every C library.
double cosine_of(double angle) {
    const Motion turn{{}, Eigen::Vector3d::Zero(), Eigen::Vector3d(angle, 0.0, 0.0)};
    return turn.at(1.0).rotation(1, 1);
}

}  // namespace

Walker::Walker(std::unique_ptr<State> state) : state_(std::move(state)) {}
Walker::Walker(Walker&&) noexcept = default;
Walker& Walker::operator=(Walker&&) noexcept = default;
Walker::~Walker() = default;

Result<Walker> Walker::create(const WalkerSettings& settings, const WorldPos& place_world) {
    if (auto ok = check_settings(settings); !ok) return tl::unexpected<Error>(ok.error());
    BodyState start;
    start.pose.translation = place_world;
    if (auto ok = internal::check_state(start); !ok) return tl::unexpected<Error>(ok.error());

    auto state = std::make_unique<State>();
    state->settings = settings;
    state->state.place_world = place_world;
    const Capsule capsule{settings.radius, settings.half_height};
    RigidBody& body = state->body;
    state->capsule.shape = capsule;
    body.parts = {&state->capsule, 1};
    body.radius = bounding_radius(capsule);
    body.thickness = settings.radius;
    body.mass.inverse_mass = 1.0;  // and no inverse inertia: it stays upright
    body.tolerance = settings.contact_tolerance > 0.0 ? settings.contact_tolerance
                                                      : default_contact_tolerance(capsule);
    body.pose = start.pose;
    body.acceleration.z() = -internal::kGravity;
    state->least_cosine = cosine_of(settings.max_slope);
    state->contacts.reserve(kMaxWalkerContacts);
    state->rows.resize(kMaxWalkerContacts);
    return Walker(std::move(state));
}

const WalkerState& Walker::state() const { return state_->state; }
const WalkerSettings& Walker::settings() const { return state_->settings; }

BodyNeed Walker::need() const {
    const RigidBody& body = state_->body;
    return {body.pose.translation, body.velocity.linear,
            body.radius + state_->settings.max_step + body.tolerance};
}

/// Sets the velocity from the controls, without its component into contacts that are too steep to climb.
void Walker::State::apply_controls(double substep) {
    Eigen::Vector3d& velocity = body.velocity.linear;
    const SolverContact* const support = find_support();
    const bool jumps = controls.jump_speed > 0.0 && (support != nullptr || is_stepping_up);
    state.stands = (support != nullptr || is_stepping_up) && !jumps;
    double x = controls.velocity.x(), y = controls.velocity.y();
    if (!state.stands) {
        const double dx = x - velocity.x(), dy = y - velocity.y();
        const double size = std::sqrt(dx * dx + dy * dy);
        const double most = settings.air_acceleration * substep;
        const double share = size > most ? most / size : 1.0;
        x = velocity.x() + share * dx;
        y = velocity.y() + share * dy;
    }
    for (const SolverContact& contact : contacts) {
        if (is_walkable(contact) ||
            contact.gap > contact.rest_gap + kStandingGap * body.tolerance) {
            continue;
        }
        const double nx = contact.normal.x(), ny = contact.normal.y();
        const double into = (x * nx + y * ny) / (nx * nx + ny * ny);
        if (!(into < 0.0)) continue;
        x -= into * nx;
        y -= into * ny;
    }
    if (jumps) {
        velocity = {x, y, controls.jump_speed};
    } else if (support != nullptr) {
        const Eigen::Vector3d& n = support->normal;
        velocity = {x, y, -(n.x() * x + n.y() * y) / n.z()};
    } else if (is_stepping_up) {
        velocity = {x, y, 0.0};
    } else {
        velocity = {x, y, std::max(velocity.z() - internal::kGravity * substep, -kTerminalSpeed)};
    }
}

void Walker::State::advance_substep(const Ground& ground, std::span<const Obstacle> obstacles,
                                    double substep, StepReport& report) {
    gather(ground, obstacles);
    if (!ground_contacts.is_resident()) {
        report.parked = 1;
        return;
    }
    if (internal::is_too_deep(body, ground_contacts)) {
        report.parked =
            internal::step_body(body, ground_contacts, ground, substep).resident ? 0 : 1;
        report.simulated_time += substep;
        is_stepping_up = false;
        return;
    }
    depenetrate(ground, obstacles, substep);
    apply_controls(substep);
    is_stepping_up = false;
    const Eigen::Vector3d wanted(controls.velocity.x(), controls.velocity.y(), 0.0);
    double left = substep;
    for (int slide = 0; left > 0.0; ++slide) {
        if (slide == kMaxSlides) {
            report.lost_time += left;
            return;
        }
        solve(left);
        const Eigen::Vector3d displacement = body.velocity.linear * left;
        const WorldPos from = body.pose.translation;
        const internal::MoveAnswer moved = move(ground, obstacles, displacement);
        if (!moved.resident) {
            report.parked = 1;
            return;
        }
        const Eigen::Vector3d gone = body.pose.translation - from;
        const double speed = length(wanted);
        const bool is_stopped =
            state.stands && speed > 0.0 && dot(gone, wanted) < kStoppedShare * speed * speed * left;
        report.simulated_time += moved.fraction * left;
        left *= 1.0 - moved.fraction;
        if (is_stopped) {
            const Eigen::Vector3d ahead = (2.0 * settings.radius / speed) * wanted;
            if (could_step(ground, obstacles, ahead)) {
                // As much up as it would have gone on, then on.
                const Eigen::Vector3d on = wanted * substep - gone;
                move(ground, obstacles,
                     Eigen::Vector3d(0.0, 0.0, std::min(settings.max_step, length(on))));
                move(ground, obstacles, on);
                body.velocity.linear = wanted;
                is_stepping_up = true;
                report.simulated_time += left;
                return;
            }
        }
        if (left > 0.0) {
            ++report.impacts;
            gather(ground, obstacles);
        }
    }
}

StepReport Walker::step(const Ground& ground, std::span<const Obstacle> obstacles,
                        const WalkerControls& controls, double dt) {
    TERRANE_ASSERT(dt > 0.0 && dt <= 1.0, "dt must be > 0 and at most 1 s");
    State& s = *state_;
    if (is_good(controls)) s.controls = controls;
    const internal::BodyMotion before = s.body;
    s.ground_contacts.invalidate();
    StepReport report;
    const double substep_count = internal::count_substeps(dt, kMaxSubstep);
    const double substep = dt / substep_count;
    for (double done = 0.0; done < substep_count; done += 1.0) {
        s.advance_substep(ground, obstacles, substep, report);
        if (report.parked == 0) continue;
        static_cast<internal::BodyMotion&>(s.body) = before;
        s.state.condition = BodyCondition::parked;
        report = {};
        report.parked = 1;
        return report;
    }
    report.max_depth_m =
        internal::deepest(s.body, ground, internal::greatest_lift(s.body, ground), 0.0);
    if (report.max_depth_m > s.body.tolerance && !s.body.started_deep) report.too_deep = 1;
    const bool is_outside =
        !s.state.stands && internal::is_outside(ground, s.body.pose.translation);
    (is_outside ? report.left_world : report.awake) = 1;
    s.state.condition = is_outside ? BodyCondition::left_world : BodyCondition::awake;
    s.state.place_world = s.body.pose.translation;
    s.state.velocity = s.body.velocity.linear;
    return report;
}

}  // namespace terrane
