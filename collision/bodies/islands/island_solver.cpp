// SPDX-License-Identifier: MIT
#include "bodies/islands/island_solver.h"

#include "bodies/step/body_step.h"
#include "ground/frame/local_body.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr std::uint32_t kNotFirst = kNone - 1;
/// Impulses are kept from substep to substep, so that stacks converge over many of them. Small islands are solved
/// until no velocity changes by more than this, m/s; large ones as far as so many pushes go, or so many sweeps.
constexpr double kTolerance = 1e-5;
constexpr std::size_t kMaxPushes = 40'000;
constexpr std::size_t kLeastIterations = 20;
/// Piles settle by less than a hundredth a sweep; what has not by a tenth in this many asks for the impossible.
constexpr int kPatience = 100;
/// What rolls or rocks on others meets no friction, and would never come to rest: where a whole island is slower
/// than this, m/s, spins lose this share of themselves a second.
constexpr double kSlow = 0.3;
constexpr double kRollingLoss = 4.0;
/// Islands are handed out to threads one by one, pairs in blocks of this many.
constexpr std::size_t kBlock = 32;

/// How far a shape reaches from its centre along the world's axes, metres, for any of its rotations within a turn.
Eigen::Vector3d half_box(const RigidBody& body, double turn_way) {
    const Shape& shape = body.parts[0].shape;
    const Eigen::Matrix3d& r = body.pose.rotation;
    Eigen::Vector3d half;
    if (std::holds_alternative<ConvexHull>(shape) || std::holds_alternative<Compound>(shape)) {
        const LocalBody placed(shape, r, Eigen::Vector3d::Zero());
        const LocalShape& whole = placed.whole();
        for (int axis = 0; axis < 3; ++axis) {
            const double reach = std::abs(whole.centre[axis]) + whole.bounds[axis];
            half[axis] = std::min(body.radius, reach + turn_way);
        }
        return half;
    }
    for (int axis = 0; axis < 3; ++axis) {
        double reach = body.radius;
        if (const auto* box = std::get_if<Box>(&shape)) {
            const Eigen::Vector3d& h = box->half_extents;
            reach = std::abs(r(axis, 0)) * h.x() + std::abs(r(axis, 1)) * h.y() +
                    std::abs(r(axis, 2)) * h.z();
        } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
            reach = capsule->radius + std::abs(r(axis, 2)) * capsule->half_height;
        }
        half[axis] = std::min(body.radius, reach + turn_way);
    }
    return half;
}

}  // namespace

void Meetings::place_bounds(std::span<const RigidBody> bodies, double duration) {
    bounds_.resize(bodies.size());
    balls_.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const RigidBody& body = bodies[i];
        const Eigen::Vector3d way = body.velocity.linear * duration;
        const double turn_way = body.radius * length(body.velocity.angular) * duration;
        const Eigen::Vector3d half = half_box(body, turn_way);
        const double margin = body.tolerance;
        const WorldPos& centre = body.pose.translation;
        for (int axis = 0; axis < 3; ++axis) {
            bounds_[i].low[axis] = centre[axis] - half[axis] - margin + std::min(0.0, way[axis]);
            bounds_[i].high[axis] = centre[axis] + half[axis] + margin + std::max(0.0, way[axis]);
        }
        balls_[i] = {centre, body.radius + margin + length(way)};
    }
}

/// Makes a touch of every pair that may touch, with where it was a substep ago.
void Meetings::take_pairs(std::span<const RigidBody> bodies, std::span<const Mobility> mobility,
                          double duration) {
    std::swap(touches_, touches_before_);
    touches_.clear();
    before_.clear();
    const auto is_earlier = [](const BodyPair& a, const BodyPair& b) {
        return a.a != b.a ? a.a < b.a : a.b < b.b;
    };
    std::size_t old = 0;
    for (const BodyPair& pair : broadphase_->find_pairs()) {
        const RigidBody &a = bodies[pair.a], &b = bodies[pair.b];
        const bool rests =
            mobility[pair.a] != Mobility::moving && mobility[pair.b] != Mobility::moving;
        const double reach = a.radius + b.radius + a.tolerance + b.tolerance +
                             duration * length(a.velocity.linear - b.velocity.linear);
        const Eigen::Vector3d between = a.pose.translation - b.pose.translation;
        if (dot(between, between) > reach * reach) continue;
        while (old < touches_before_.size() && is_earlier(touches_before_[old].pair, pair)) ++old;
        const bool was = old < touches_before_.size() && touches_before_[old].pair == pair;
        if (rests && !was) continue;
        before_.push_back(was ? static_cast<std::uint32_t>(old) : kNone);
        const std::size_t most = PairTouch::most(a, b);
        for (std::size_t i = 0; i < most; ++i) touches_.emplace_back().pair = pair;
        before_.resize(touches_.size(), kNotFirst);
    }
}

/// Forgets pairs without contacts. Of the others all touches are kept, empty ones too.
void Meetings::erase_apart() {
    std::size_t kept = 0;
    bool touches = false;
    for (std::size_t i = 0; i < touches_.size(); ++i) {
        const bool is_first = i == 0 || !(touches_[i].pair == touches_[i - 1].pair);
        if (is_first) touches = touches_[i].count() > 0;
        if (!touches) continue;
        if (kept != i) touches_[kept] = touches_[i];
        ++kept;
    }
    touches_.resize(kept);
}

void Meetings::wake(std::span<const std::uint32_t> groups, std::span<Mobility> mobility) {
    bool any = false;
    wakes_.assign(mobility.size(), 0);
    for (const PairTouch& touch : touches_) {
        if (touch.count() == 0) continue;
        const auto [a, b] = touch.pair;
        if (mobility[a] == Mobility::asleep && mobility[b] == Mobility::moving) {
            wakes_[groups[a]] = 1;
            any = true;
        }
        if (mobility[b] == Mobility::asleep && mobility[a] == Mobility::moving) {
            wakes_[groups[b]] = 1;
            any = true;
        }
    }
    if (!any) return;
    for (std::size_t i = 0; i < mobility.size(); ++i) {
        if (mobility[i] == Mobility::asleep && wakes_[groups[i]] != 0) {
            mobility[i] = Mobility::moving;
        }
    }
}

void Meetings::find(std::span<const RigidBody> bodies, std::span<const std::uint32_t> groups,
                    std::span<Mobility> mobility, double duration, WorkerTeam& team) {
    place_bounds(bodies, duration);
    broadphase_->update(bounds_, balls_);
    take_pairs(bodies, mobility, duration);
    team.run_blocks(touches_.size(), kBlock, [&](std::size_t i) {
        if (before_[i] == kNotFirst) return;  // another thread may have it
        const auto [a, b] = touches_[i].pair;
        const std::size_t most = PairTouch::most(bodies[a], bodies[b]);
        const std::span<PairTouch> touches = std::span(touches_).subspan(i, most);
        std::span<PairTouch> before;
        if (before_[i] != kNone) before = std::span(touches_before_).subspan(before_[i], most);
        if (mobility[a] != Mobility::moving && mobility[b] != Mobility::moving) {
            std::copy(before.begin(), before.end(), touches.begin());
        } else {
            PairTouch::update(touches, bodies[a], bodies[b], before, duration);
        }
    });
    erase_apart();
    wake(groups, mobility);

    links_.clear();
    link_touches_.clear();
    pair_count_ = 0;
    for (std::size_t i = 0; i < touches_.size(); ++i) {
        const BodyPair& pair = touches_[i].pair;
        if (mobility[pair.a] != Mobility::moving && mobility[pair.b] != Mobility::moving) continue;
        if (links_.empty() || !(links_.back() == pair)) ++pair_count_;
        links_.push_back(pair);
        link_touches_.push_back(static_cast<std::uint32_t>(i));
    }
    moves_.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) moves_[i] = mobility[i] == Mobility::moving;
    islands_.build(links_, moves_);
}

/// What all islands share.
struct Meetings::Scene {
    std::span<RigidBody> bodies;
    std::span<GroundLook> looks;
    std::span<SubstepAnswer> answers;
    const Ground& ground;
    double gravity;
    double duration;
};

void Meetings::solve(std::span<RigidBody> bodies, std::span<GroundLook> looks,
                     std::span<SubstepAnswer> answers, const Ground& ground, double gravity,
                     double duration, WorkerTeam& team) {
    if (islands_.count() == 0) return;
    solver_bodies_.resize(bodies.size());
    flights_.resize(bodies.size());
    rows_.resize(static_cast<std::size_t>(team.size()));
    // What does not move may belong to several islands: no island writes it.
    for (const BodyPair& link : links_) {
        for (const std::uint32_t i : {link.a, link.b}) {
            if (moves_[i] != 0) continue;
            solver_bodies_[i].pose = bodies[i].pose;
            solver_bodies_[i].mass = {.inverse_mass = 0.0};
            solver_bodies_[i].velocity = {};
        }
    }
    const Scene scene{bodies, looks, answers, ground, gravity, duration};
    team.run(islands_.count(), [&](std::size_t island, int worker) {
        fly_to_impacts(island, scene);
        solve_island(island, worker, scene);
    });
}

/// Lets bodies that fly at each other live until they meet: what they have then is what they bounce with. What else
/// they meet in this substep they only slow down for.
void Meetings::fly_to_impacts(std::size_t island, const Scene& scene) {
    const double least_speed = bounce_speed(scene.gravity, scene.duration);
    const auto is_first = [&](std::uint32_t body, double share) {
        return share > 0.0 && share < flights_[body];
    };
    bool any = false;
    for (const std::uint32_t member : islands_.bodies(island)) flights_[member] = 1.0;
    for (const std::uint32_t link : islands_.links(island)) {
        const PairTouch& touch = touches_[link_touches_[link]];
        const auto [a, b] = touch.pair;
        const double share =
            touch.first_impact(scene.bodies[a], scene.bodies[b], least_speed, scene.duration);
        for (const std::uint32_t body : {a, b}) {
            if (moves_[body] == 0 || !is_first(body, share)) continue;
            flights_[body] = share;
            any = true;
        }
    }
    if (!any) return;

    for (const std::uint32_t member : islands_.bodies(island)) {
        if (flights_[member] >= 1.0) continue;
        scene.answers[member] = step_body(scene.bodies[member], scene.looks[member], scene.ground,
                                          scene.gravity, flights_[member] * scene.duration);
    }
    for (const std::uint32_t link : islands_.links(island)) {
        if (link > 0 && links_[link - 1] == links_[link]) continue;  // went with the first
        const auto [a, b] = links_[link];
        const bool flew =
            (moves_[a] != 0 && flights_[a] < 1.0) || (moves_[b] != 0 && flights_[b] < 1.0);
        if (!flew) continue;
        const std::span<PairTouch> touches = std::span(touches_).subspan(
            link_touches_[link], PairTouch::most(scene.bodies[a], scene.bodies[b]));
        PairTouch::update_again(touches, scene.bodies[a], scene.bodies[b], scene.duration);
    }
}

void Meetings::solve_island(std::size_t island, int worker, const Scene& scene) {
    const double duration = scene.duration;
    const std::span<RigidBody> bodies = scene.bodies;
    const std::span<GroundLook> looks = scene.looks;
    const std::span<const std::uint32_t> members = islands_.bodies(island);
    const std::span<const std::uint32_t> links = islands_.links(island);
    std::size_t row_count = 0;
    for (const std::uint32_t link : links) row_count += touches_[link_touches_[link]].count();
    for (const std::uint32_t member : members) {
        SolverBody& body = solver_bodies_[member];
        body.pose = bodies[member].pose;
        body.mass = bodies[member].mass;
        body.velocity = bodies[member].velocity;
        looks[member].update(bodies[member], scene.ground);
        row_count += looks[member].count();
    }
    std::vector<ContactRows>& rows = rows_[static_cast<std::size_t>(worker)];
    if (rows.size() < row_count) rows.resize(row_count);

    ContactSolver solver(solver_bodies_, rows);
    bool overlaps = false;
    const auto add = [&](const SolverContact& contact) {
        overlaps = overlaps || contact.gap < contact.wanted_gap;
        solver.add(contact);
    };
    for (const std::uint32_t link : links) {
        const PairTouch& touch = touches_[link_touches_[link]];
        const auto [a, b] = touch.pair;
        for (std::size_t i = 0; i < touch.count(); ++i) {
            add(touch.contact(i, bodies[a], bodies[b]));
        }
    }
    // The ground comes last, and has the last word.
    for (const std::uint32_t member : members) {
        for (std::size_t i = 0; i < looks[member].count(); ++i) {
            add(looks[member].contact(i, bodies[member], member));
        }
    }

    const std::size_t iterations =
        std::max(kLeastIterations, kMaxPushes / std::max<std::size_t>(1, row_count));
    solver.solve_velocity(members, bounce_speed(scene.gravity, scene.duration), duration,
                          {.iterations = static_cast<int>(iterations),
                           .tolerance = kTolerance,
                           .patience = kPatience});
    std::size_t row = 0;
    for (const std::uint32_t link : links) {
        PairTouch& touch = touches_[link_touches_[link]];
        for (std::size_t i = 0; i < touch.count(); ++i) touch.set_impulse(i, solver.impulse(row++));
    }
    for (const std::uint32_t member : members) {
        for (std::size_t i = 0; i < looks[member].count(); ++i) {
            looks[member].set_impulse(i, solver.impulse(row++));
        }
        bodies[member].velocity = solver_bodies_[member].velocity;
    }
    const bool is_slow = std::all_of(members.begin(), members.end(), [&](std::uint32_t member) {
        return greatest_speed(bodies[member]) < kSlow;
    });
    if (is_slow) {
        const double kept = std::max(0.0, 1.0 - kRollingLoss * duration);
        for (const std::uint32_t member : members) bodies[member].velocity.angular *= kept;
    }
    if (!overlaps) return;

    for (const std::uint32_t member : members) solver_bodies_[member].velocity = {};
    solver.solve_separation(kSeparationSpeed * duration, true);
    for (const std::uint32_t member : members) {
        const Twist& way = solver_bodies_[member].velocity;
        // Where ground is not loaded the body stays, and parks in its own step.
        push_body(bodies[member], looks[member], scene.ground, way, scene.gravity, duration);
    }
}

}  // namespace terrane::internal
