// SPDX-License-Identifier: MIT
// Contacts of a walker, and its motion along them.
#include "bodies/step/body_step.h"
#include "character/walker_state.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane {
namespace {

using internal::dot;
using internal::kStopGap;
using internal::length;
using internal::SolverContact;

constexpr std::size_t kMaxOfObstacle = 24;
constexpr std::array<std::uint32_t, 1> kAlone{0};
constexpr internal::StoppingRule kStoppingRule{.iterations = 100, .tolerance = 1e-11};

}  // namespace

/// Finds the walker's contacts with the ground, then those with obstacles.
void Walker::State::gather(const Ground& ground, std::span<const Obstacle> obstacles) {
    ground_contacts.update(body, ground);
    contacts.clear();
    for (std::size_t i = 0; i < ground_contacts.count(); ++i) {
        contacts.push_back(ground_contacts.contact(i, body, 0));
    }
    std::array<PairContact, kMaxOfObstacle> found;
    for (const Obstacle& obstacle : obstacles) {
        const PairContactAnswer answer =
            find_contacts(body.parts[0].shape, body.pose, obstacle.shape, obstacle.pose,
                          internal::kContactMargin * body.tolerance, found);
        for (std::size_t i = 0; i < answer.count && contacts.size() < kMaxWalkerContacts; ++i) {
            SolverContact contact;
            contact.point_a = found[i].point_world;
            contact.normal = found[i].normal;
            contact.rounding = settings.radius;
            contact.gap = -found[i].depth;
            contact.rest_gap = internal::kRestGap * body.tolerance;
            contact.target_gap = internal::kSeparationGap * body.tolerance;
            contacts.push_back(contact);
        }
    }
}

/// The flattest contact that it stands on; null in the air.
const SolverContact* Walker::State::find_support() const {
    const SolverContact* support = nullptr;
    for (const SolverContact& contact : contacts) {
        if (!is_walkable(contact)) continue;
        if (contact.gap > contact.rest_gap + kStandingGap * body.tolerance) continue;
        if (support == nullptr || contact.normal.z() > support->normal.z()) support = &contact;
    }
    return support;
}

/// Solver of the walker's contacts, without friction or restitution.
class Walker::State::Solver {
public:
    Solver(State& walker, const internal::Twist& velocity) : solver_(bodies_, walker.rows) {
        bodies_[0].mass = walker.body.mass;
        bodies_[0].pose = walker.body.pose;
        bodies_[0].velocity = velocity;
        for (SolverContact contact : walker.contacts) {
            contact.friction = contact.restitution = 0.0;
            contact.initial_impulse.setZero();
            solver_.add(contact);
        }
    }
    internal::ContactSolver& operator*() { return solver_; }
    const internal::Twist& velocity() const { return bodies_[0].velocity; }

private:
    std::array<internal::SolverBody, 1> bodies_;
    internal::ContactSolver solver_;
};

void Walker::State::solve(double duration) {
    if (contacts.empty()) return;
    Solver solver(*this, body.velocity);
    (*solver).solve_velocity(kAlone, internal::bounce_speed(internal::kGravity, duration), duration,
                             kStoppingRule);
    body.velocity = solver.velocity();
}

/// Opens contacts below the separation gap, and moves the walker out of obstacles that were moved into it.
void Walker::State::depenetrate(const Ground& ground, std::span<const Obstacle> obstacles,
                                double substep) {
    const bool is_close =
        std::any_of(contacts.begin(), contacts.end(),
                    [](const SolverContact& contact) { return contact.gap < contact.target_gap; });
    if (!is_close) return;
    Solver solver(*this, {});
    (*solver).solve_separation(internal::kSeparationSpeed * substep, false);
    move(ground, obstacles, solver.velocity().linear);
    gather(ground, obstacles);
}

/// Moves the walker by a displacement, or until obstacles or the ground stop it.
internal::MoveAnswer Walker::State::move(const Ground& ground, std::span<const Obstacle> obstacles,
                                         const Eigen::Vector3d& displacement) {
    double fraction = 1.0;
    const Motion motion{body.pose, displacement, Eigen::Vector3d::Zero()};
    // A walker closer than the stop gap may still slide: casts stop at half of its gap.
    double gap = kStopGap * body.tolerance;
    for (const SolverContact& contact : contacts) gap = std::min(gap, 0.5 * contact.gap);
    for (const Obstacle& obstacle : obstacles) {
        const PairCastAnswer hit =
            cast(body.parts[0].shape, motion, obstacle.shape, Motion{obstacle.pose},
                 {.tolerance = std::max(1e-11, gap), .skip_separating = true});
        if (hit.hit) fraction = std::min(fraction, hit.fraction);
    }
    internal::MoveAnswer answer = internal::move_body(
        body, ground_contacts, ground, {fraction * displacement, Eigen::Vector3d::Zero()});
    answer.fraction *= fraction;
    return answer;
}

/// Whether a step up leads onto something higher that can be stood on. Leaves the walker where it was.
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
    // If the lower cap hit an edge, move back until the cylindrical side is flush with it, then step down.
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
    ground_contacts.invalidate();
    return could;
}

}  // namespace terrane
