// SPDX-License-Identifier: MIT
//
// A walker is a body that never turns. What it wants is made a velocity along what it stands on; what it must
// not climb takes the part of that velocity that leads into it; the solver and the gate of body_step do the rest.
// Where it is stopped on foot it looks whether the way is free from max_step higher up, and whether it could
// stand there: then it rises by as much as it walks.
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
/// Stopped is who comes less far than this share of the way.
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

/// Without the C library, whose last bits differ.
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

/// Sets the velocity that the controls ask for, without what must not be climbed.
void Walker::State::want(double substep) {
    Eigen::Vector3d& velocity = body.velocity.linear;
    const SolverContact* const support = find_support();
    const bool jumps = controls.jump_speed > 0.0 && (support != nullptr || rises);
    state.stands = (support != nullptr || rises) && !jumps;
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
    } else if (rises) {
        velocity = {x, y, 0.0};
    } else {
        velocity = {x, y, std::max(velocity.z() - internal::kGravity * substep, -kTerminalSpeed)};
    }
}

void Walker::State::live_substep(const Ground& ground, std::span<const Obstacle> obstacles,
                                 double substep, StepReport& report) {
    gather(ground, obstacles);
    if (!look.is_resident()) {
        report.parked = 1;
        return;
    }
    if (internal::is_too_deep(body, look)) {
        report.parked =
            internal::step_body(body, look, ground, internal::kGravity, substep).resident ? 0 : 1;
        report.simulated_time += substep;
        rises = false;
        return;
    }
    part(ground, obstacles, substep);
    want(substep);
    rises = false;
    const Eigen::Vector3d wanted(controls.velocity.x(), controls.velocity.y(), 0.0);
    double left = substep;
    for (int slide = 0; left > 0.0; ++slide) {
        if (slide == kMaxSlides) {
            report.lost_time += left;
            return;
        }
        solve(left);
        const Eigen::Vector3d way = body.velocity.linear * left;
        const WorldPos from = body.pose.translation;
        const internal::MoveAnswer moved = move(ground, obstacles, way);
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
                rises = true;
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
    s.look.forget();
    StepReport report;
    const double substep_count = internal::count_substeps(dt, kMaxSubstep);
    const double substep = dt / substep_count;
    for (double done = 0.0; done < substep_count; done += 1.0) {
        s.live_substep(ground, obstacles, substep, report);
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
