// SPDX-License-Identifier: MIT
//
// A walker is a body that never turns. What it wants is made a velocity along what it stands on; what it must
// not climb takes the part of that velocity that leads into it; the solver and the gate of body_step do the rest.
// Where it is stopped on foot it looks whether the way is free from max_step higher up, and whether it could
// stand there: then it rises by as much as it walks.
#include "body_checks.h"
#include "body_step.h"

#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/walker.h>
#include <terrane/terrain/assert.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace terrane {
namespace {

using internal::dot;
using internal::kStopGap;
using internal::length;
using internal::RigidBody;
using internal::SolverContact;

constexpr double kGravity = 9.81;
constexpr double kMaxSubstep = 1.0 / 120.0;
constexpr double kTerminalSpeed = 1e4;  // metres a second
constexpr int kMaxSlides = 4;           // of a substep
constexpr std::size_t kMaxContacts = 128;
constexpr std::size_t kMaxOfObstacle = 24;
constexpr std::array<std::uint32_t, 1> kAlone{0};
constexpr internal::SolverEffort kEffort{.iterations = 100, .tolerance = 1e-11};
/// A walker stands on contacts that are not wider than this beyond where bodies rest, in tolerances.
constexpr double kStandingGap = 1.0 / 8.0;
/// Stopped is who comes less far than this share of the way.
constexpr double kStoppedShare = 0.9;

Result<void> check_settings(const WalkerSettings& s) {
    const struct {
        const char* name;
        double value, low, high;
    } fields[] = {
        {"radius", s.radius, 1e-3, 1e3},
        {"half_height", s.half_height, 0.0, 1e3},
        {"max_slope", s.max_slope, 0.0, 1.57},
        {"max_step", s.max_step, 0.0, 1e3},
        {"air_acceleration", s.air_acceleration, 0.0, 1e6},
        {"contact_tolerance", s.contact_tolerance, 0.0, 1e3},
    };
    for (const auto& field : fields) {
        if (auto ok = internal::check_value(field.name, field.value, field.low, field.high); !ok) {
            return ok;
        }
    }
    return {};
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

struct Walker::State {
    WalkerSettings settings;
    WalkerState state;
    WalkerControls controls;
    RigidBody body;
    internal::GroundLook look;
    double least_cosine = 0.0;  // of what it stands on
    bool rises = false;         // onto a step
    std::vector<SolverContact> contacts;
    std::vector<internal::ContactRows> rows;

    void live_substep(const Ground& ground, std::span<const Obstacle> obstacles, double substep,
                      StepReport& report);
    void gather(const Ground& ground, std::span<const Obstacle> obstacles);
    bool is_walkable(const SolverContact& contact) const {
        return contact.normal.z() >= least_cosine;
    }
    const SolverContact* find_support() const;
    void want(double substep);
    void solve(double duration);
    internal::MoveAnswer move(const Ground& ground, std::span<const Obstacle> obstacles,
                              const Eigen::Vector3d& way);
    bool could_step(const Ground& ground, std::span<const Obstacle> obstacles,
                    const Eigen::Vector3d& forward);
};

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
    body.parts[0].shape = capsule;
    body.radius = bounding_radius(capsule);
    body.thickness = settings.radius;
    body.mass.inverse_mass = 1.0;  // and no inverse inertia: it stays upright
    body.tolerance = settings.contact_tolerance > 0.0 ? settings.contact_tolerance
                                                      : default_contact_tolerance(capsule);
    body.pose = start.pose;
    state->least_cosine = cosine_of(settings.max_slope);
    state->rows.resize(kMaxContacts);
    return Walker(std::move(state));
}

const WalkerState& Walker::state() const { return state_->state; }
const WalkerSettings& Walker::settings() const { return state_->settings; }

BodyNeed Walker::need() const {
    const RigidBody& body = state_->body;
    return {body.pose.translation, body.velocity.linear,
            body.radius + state_->settings.max_step + body.tolerance};
}

/// Everything that touches the walker, the ground first.
void Walker::State::gather(const Ground& ground, std::span<const Obstacle> obstacles) {
    look.update(body, ground);
    contacts.clear();
    for (std::size_t i = 0; i < look.count(); ++i) contacts.push_back(look.contact(i, body, 0));
    std::array<PairContact, kMaxOfObstacle> found;
    for (const Obstacle& obstacle : obstacles) {
        const PairContactAnswer answer =
            find_contacts(body.parts[0].shape, body.pose, obstacle.shape, obstacle.pose,
                          internal::kContactMargin * body.tolerance, found);
        for (std::size_t i = 0; i < answer.count; ++i) {
            SolverContact contact;
            contact.point_a = found[i].point_world;
            contact.normal = found[i].normal;
            contact.rounding = settings.radius;
            contact.gap = -found[i].depth;
            contact.rest_gap = internal::kRestGap * body.tolerance;
            contact.wanted_gap = internal::kSeparationGap * body.tolerance;
            contacts.push_back(contact);
        }
    }
    if (contacts.size() > kMaxContacts) contacts.resize(kMaxContacts);
}

/// The flattest of what it stands on; null in the air.
const SolverContact* Walker::State::find_support() const {
    const SolverContact* support = nullptr;
    for (const SolverContact& contact : contacts) {
        if (!is_walkable(contact)) continue;
        if (contact.gap > contact.rest_gap + kStandingGap * body.tolerance) continue;
        if (support == nullptr || contact.normal.z() > support->normal.z()) support = &contact;
    }
    return support;
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
        velocity = {x, y, std::max(velocity.z() - kGravity * substep, -kTerminalSpeed)};
    }
}

void Walker::State::solve(double duration) {
    if (contacts.empty()) return;
    std::array<internal::SolverBody, 1> bodies;
    bodies[0].mass = body.mass;
    bodies[0].pose = body.pose;
    bodies[0].velocity = body.velocity;
    internal::ContactSolver solver(bodies, rows);
    for (const SolverContact& contact : contacts) {
        SolverContact smooth = contact;
        smooth.friction = smooth.restitution = 0.0;
        smooth.guess.setZero();
        solver.add(smooth);
    }
    solver.solve_velocity(kAlone, internal::bounce_speed(kGravity, duration), duration, kEffort);
    body.velocity = bodies[0].velocity;
}

/// Moves the walker until obstacles or the ground stop it.
internal::MoveAnswer Walker::State::move(const Ground& ground, std::span<const Obstacle> obstacles,
                                         const Eigen::Vector3d& way) {
    double fraction = 1.0;
    const Motion motion{body.pose, way, Eigen::Vector3d::Zero()};
    for (const Obstacle& obstacle : obstacles) {
        // Closer than a stop it may still move along: half of what is left is let go.
        double gap = kStopGap * body.tolerance;
        for (const SolverContact& contact : contacts) gap = std::min(gap, 0.5 * contact.gap);
        const PairCastAnswer hit =
            cast(body.parts[0].shape, motion, obstacle.shape, Motion{obstacle.pose},
                 {.tolerance = std::max(1e-11, gap), .skip_separating = true});
        if (hit.hit) fraction = std::min(fraction, hit.fraction);
    }
    internal::MoveAnswer answer =
        internal::move_body(body, look, ground, {fraction * way, Eigen::Vector3d::Zero()});
    answer.fraction *= fraction;
    return answer;
}

/// Whether the way from higher up leads onto something higher that can be stood on.
bool Walker::State::could_step(const Ground& ground, std::span<const Obstacle> obstacles,
                               const Eigen::Vector3d& forward) {
    const internal::BodyMotion before = body;
    const Eigen::Vector3d up(0.0, 0.0, settings.max_step);
    const double highest = before.pose.translation.z() - settings.radius - settings.half_height +
                           settings.max_step + body.tolerance;
    const double rise = move(ground, obstacles, up).fraction;
    gather(ground, obstacles);
    move(ground, obstacles, forward);
    gather(ground, obstacles);
    // Where its round foot met an edge it steps back until its side is beside it, to come down there.
    double back = 0.0;
    for (const SolverContact& contact : contacts) {
        const Eigen::Vector3d& n = contact.normal;
        if (dot(n, forward) >= 0.0) continue;
        const double level = std::sqrt(n.x() * n.x() + n.y() * n.y());
        back = std::max(back, settings.radius * (1.0 - level) + body.tolerance);
    }
    if (back > 0.0) move(ground, obstacles, forward * (-back / length(forward)));
    gather(ground, obstacles);
    const double fall = move(ground, obstacles, -rise * up).fraction;
    gather(ground, obstacles);
    const bool is_higher = body.pose.translation.z() > before.pose.translation.z() + body.tolerance;
    const SolverContact* const support = find_support();
    const bool could =
        fall < 1.0 && is_higher && support != nullptr && support->point_a.z() <= highest;
    static_cast<internal::BodyMotion&>(body) = before;
    look.forget();
    return could;
}

void Walker::State::live_substep(const Ground& ground, std::span<const Obstacle> obstacles,
                                 double substep, StepReport& report) {
    gather(ground, obstacles);
    if (!look.is_resident()) {
        report.parked = 1;
        return;
    }
    if (internal::is_too_deep(body, look)) {
        report.parked = internal::step_body(body, look, ground, kGravity, substep).resident ? 0 : 1;
        report.lived_time += substep;
        rises = false;
        return;
    }
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
        report.lived_time += moved.fraction * left;
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
                report.lived_time += left;
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
    const double substep_count = std::max(1.0, std::ceil(dt / kMaxSubstep - 1e-9));
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
    report.max_depth_m = internal::deepest(s.body, ground, 0.0);
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
