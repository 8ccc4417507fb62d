// SPDX-License-Identifier: MIT
#include "bodies/islands/island_solver.h"

#include "bodies/step/body_step.h"
#include "ground/frame/local_body.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr std::uint32_t kNotFirst = kNone - 1;
/// Warm-started stacks converge over several substeps. Small islands are solved until no velocity changes by more than
/// the tolerance, m/s; large ones stop at the larger of so many row solves and so many sweeps.
constexpr double kTolerance = 1e-5;
constexpr std::size_t kMaxRowSolves = 40'000;
constexpr std::size_t kLeastIterations = 20;
/// Piles converge by less than a hundredth a sweep. Stalled, treated as infeasible: less than a tenth in so many
/// sweeps.
constexpr int kPatience = 100;
/// Rolling and rocking have no friction and would never end: an island below this speed, m/s, gets angular damping at
/// this rate, 1/s, so that it can sleep.
constexpr double kSlow = 0.3;
constexpr double kRollingLoss = 4.0;
/// Threads take islands one by one, and pairs in blocks of this size.
constexpr std::size_t kBlock = 32;

/// Half extents of a shape's bounding box in world axes, metres, for all rotations that move no point by more than
/// `turn_distance`.
Eigen::Vector3d half_box(const RigidBody& body, double turn_distance) {
    const Shape& shape = body.parts[0].shape;
    const Eigen::Matrix3d& r = body.pose.rotation;
    Eigen::Vector3d half;
    if (std::holds_alternative<ConvexHull>(shape) || std::holds_alternative<Compound>(shape)) {
        const LocalBody placed(shape, r, Eigen::Vector3d::Zero());
        const LocalShape& whole = placed.whole();
        for (int axis = 0; axis < 3; ++axis) {
            const double reach = std::abs(whole.centre[axis]) + whole.bounds[axis];
            half[axis] = std::min(body.radius, reach + turn_distance);
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
        half[axis] = std::min(body.radius, reach + turn_distance);
    }
    return half;
}

}  // namespace

void IslandSolver::update_bounds(std::span<const RigidBody> bodies, double duration) {
    bounds_.resize(bodies.size());
    spheres_.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const RigidBody& body = bodies[i];
        const Eigen::Vector3d translation = body.velocity.linear * duration;
        const double turn_distance = body.radius * length(body.velocity.angular) * duration;
        const Eigen::Vector3d half = half_box(body, turn_distance);
        const double margin = body.tolerance;
        const WorldPos& centre = body.pose.translation;
        for (int axis = 0; axis < 3; ++axis) {
            bounds_[i].low[axis] =
                centre[axis] - half[axis] - margin + std::min(0.0, translation[axis]);
            bounds_[i].high[axis] =
                centre[axis] + half[axis] + margin + std::max(0.0, translation[axis]);
        }
        spheres_[i] = {centre, body.radius + margin + length(translation)};
    }
}

/// Makes the manifolds of all pairs that may touch, and finds those of the previous substep.
void IslandSolver::collect_pairs(std::span<const RigidBody> bodies,
                                 std::span<const Mobility> mobility, double duration) {
    std::swap(manifolds_, previous_manifolds_);
    manifolds_.clear();
    previous_index_.clear();
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
        while (old < previous_manifolds_.size() &&
               is_earlier(previous_manifolds_[old].pair, pair)) {
            ++old;
        }
        const bool was = old < previous_manifolds_.size() && previous_manifolds_[old].pair == pair;
        if (rests && !was) continue;
        previous_index_.push_back(was ? static_cast<std::uint32_t>(old) : kNone);
        const std::size_t most = PairManifold::max_count(a, b);
        for (std::size_t i = 0; i < most; ++i) manifolds_.emplace_back().pair = pair;
        previous_index_.resize(manifolds_.size(), kNotFirst);
    }
}

/// Removes pairs without contacts. The others keep all their manifolds, empty ones too.
void IslandSolver::remove_separated() {
    std::size_t kept = 0;
    bool has_contacts = false;
    for (std::size_t i = 0; i < manifolds_.size(); ++i) {
        const bool is_first = i == 0 || !(manifolds_[i].pair == manifolds_[i - 1].pair);
        if (is_first) has_contacts = manifolds_[i].count() > 0;
        if (!has_contacts) continue;
        if (kept != i) manifolds_[kept] = manifolds_[i];
        ++kept;
    }
    manifolds_.resize(kept);
}

void IslandSolver::wake(std::span<const std::uint32_t> groups, std::span<Mobility> mobility) {
    bool any = false;
    wakes_.assign(mobility.size(), 0);
    for (const PairManifold& manifold : manifolds_) {
        if (manifold.count() == 0) continue;
        const auto [a, b] = manifold.pair;
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

void IslandSolver::find(std::span<const RigidBody> bodies, std::span<const std::uint32_t> groups,
                        std::span<Mobility> mobility, double duration, WorkerTeam& team) {
    update_bounds(bodies, duration);
    broadphase_->update(bounds_, spheres_);
    collect_pairs(bodies, mobility, duration);
    team.run_blocks(manifolds_.size(), kBlock, [&](std::size_t i) {
        if (previous_index_[i] == kNotFirst) return;  // belongs to the pair's first manifold
        const auto [a, b] = manifolds_[i].pair;
        const std::size_t most = PairManifold::max_count(bodies[a], bodies[b]);
        const std::span<PairManifold> manifolds = std::span(manifolds_).subspan(i, most);
        std::span<PairManifold> previous;
        if (previous_index_[i] != kNone) {
            previous = std::span(previous_manifolds_).subspan(previous_index_[i], most);
        }
        if (mobility[a] != Mobility::moving && mobility[b] != Mobility::moving) {
            std::copy(previous.begin(), previous.end(), manifolds.begin());
        } else {
            PairManifold::update(manifolds, bodies[a], bodies[b], previous, duration);
        }
    });
    remove_separated();
    wake(groups, mobility);

    links_.clear();
    link_manifolds_.clear();
    pair_count_ = 0;
    for (std::size_t i = 0; i < manifolds_.size(); ++i) {
        const BodyPair& pair = manifolds_[i].pair;
        if (mobility[pair.a] != Mobility::moving && mobility[pair.b] != Mobility::moving) continue;
        if (links_.empty() || !(links_.back() == pair)) ++pair_count_;
        links_.push_back(pair);
        link_manifolds_.push_back(static_cast<std::uint32_t>(i));
    }
    moves_.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) moves_[i] = mobility[i] == Mobility::moving;
    islands_.build(links_, moves_);
}

/// The arguments of solve(), for all islands.
struct IslandSolver::Scene {
    std::span<RigidBody> bodies;
    std::span<GroundContactCache> ground_contacts;
    std::span<SubstepAnswer> answers;
    const Ground& ground;
    double gravity;
    double duration;
};

void IslandSolver::solve(std::span<RigidBody> bodies, std::span<GroundContactCache> ground_contacts,
                         std::span<SubstepAnswer> answers, const Ground& ground, double gravity,
                         double duration, WorkerTeam& team) {
    if (islands_.count() == 0) return;
    solver_bodies_.resize(bodies.size());
    impact_shares_.resize(bodies.size());
    rows_.resize(static_cast<std::size_t>(team.size()));
    // Bodies that do not move may be in contacts of several islands: no island writes them.
    for (const BodyPair& link : links_) {
        for (const std::uint32_t i : {link.a, link.b}) {
            if (moves_[i] != 0) continue;
            solver_bodies_[i].pose = bodies[i].pose;
            solver_bodies_[i].mass = {.inverse_mass = 0.0};
            solver_bodies_[i].velocity = {};
        }
    }
    const Scene scene{bodies, ground_contacts, answers, ground, gravity, duration};
    team.run(islands_.count(), [&](std::size_t island, int worker) {
        advance_to_impacts(island, scene);
        solve_island(island, worker, scene);
    });
}

/// Advances bodies that will bounce off each other to their time of impact, so that they bounce with the velocities
/// that they have then. Other contacts of the same substep only slow them down.
void IslandSolver::advance_to_impacts(std::size_t island, const Scene& scene) {
    const double least_speed = bounce_speed(scene.gravity, scene.duration);
    const auto is_first = [&](std::uint32_t body, double share) {
        return share > 0.0 && share < impact_shares_[body];
    };
    bool any = false;
    for (const std::uint32_t member : islands_.bodies(island)) impact_shares_[member] = 1.0;
    for (const std::uint32_t link : islands_.links(island)) {
        const PairManifold& manifold = manifolds_[link_manifolds_[link]];
        const auto [a, b] = manifold.pair;
        const double share =
            manifold.first_impact(scene.bodies[a], scene.bodies[b], least_speed, scene.duration);
        for (const std::uint32_t body : {a, b}) {
            if (moves_[body] == 0 || !is_first(body, share)) continue;
            impact_shares_[body] = share;
            any = true;
        }
    }
    if (!any) return;

    for (const std::uint32_t member : islands_.bodies(island)) {
        if (impact_shares_[member] >= 1.0) continue;
        scene.answers[member] =
            step_body(scene.bodies[member], scene.ground_contacts[member], scene.ground,
                      scene.gravity, impact_shares_[member] * scene.duration);
    }
    for (const std::uint32_t link : islands_.links(island)) {
        if (link > 0 && links_[link - 1] == links_[link]) {
            continue;  // updated with the pair's first
        }
        const auto [a, b] = links_[link];
        const bool has_advanced = (moves_[a] != 0 && impact_shares_[a] < 1.0) ||
                                  (moves_[b] != 0 && impact_shares_[b] < 1.0);
        if (!has_advanced) continue;
        const std::span<PairManifold> manifolds =
            std::span(manifolds_)
                .subspan(link_manifolds_[link],
                         PairManifold::max_count(scene.bodies[a], scene.bodies[b]));
        PairManifold::update_after_advance(manifolds, scene.bodies[a], scene.bodies[b],
                                           scene.duration);
    }
}

void IslandSolver::solve_island(std::size_t island, int worker, const Scene& scene) {
    const double duration = scene.duration;
    const std::span<RigidBody> bodies = scene.bodies;
    const std::span<GroundContactCache> ground_contacts = scene.ground_contacts;
    const std::span<const std::uint32_t> members = islands_.bodies(island);
    const std::span<const std::uint32_t> links = islands_.links(island);
    std::size_t row_count = 0;
    for (const std::uint32_t link : links) row_count += manifolds_[link_manifolds_[link]].count();
    for (const std::uint32_t member : members) {
        SolverBody& body = solver_bodies_[member];
        body.pose = bodies[member].pose;
        body.mass = bodies[member].mass;
        body.velocity = bodies[member].velocity;
        ground_contacts[member].update(bodies[member], scene.ground);
        row_count += ground_contacts[member].count();
    }
    std::vector<ContactRows>& rows = rows_[static_cast<std::size_t>(worker)];
    if (rows.size() < row_count) rows.resize(row_count);

    ContactSolver solver(solver_bodies_, rows);
    bool overlaps = false;
    const auto add = [&](const SolverContact& contact) {
        overlaps = overlaps || contact.gap < contact.target_gap;
        solver.add(contact);
    };
    for (const std::uint32_t link : links) {
        const PairManifold& manifold = manifolds_[link_manifolds_[link]];
        const auto [a, b] = manifold.pair;
        for (std::size_t i = 0; i < manifold.count(); ++i) {
            add(manifold.contact(i, bodies[a], bodies[b]));
        }
    }
    // The ground comes last, so that its constraints are met best.
    for (const std::uint32_t member : members) {
        for (std::size_t i = 0; i < ground_contacts[member].count(); ++i) {
            add(ground_contacts[member].contact(i, bodies[member], member));
        }
    }

    const std::size_t iterations =
        std::max(kLeastIterations, kMaxRowSolves / std::max<std::size_t>(1, row_count));
    solver.solve_velocity(members, bounce_speed(scene.gravity, scene.duration), duration,
                          {.iterations = static_cast<int>(iterations),
                           .tolerance = kTolerance,
                           .patience = kPatience});
    std::size_t row = 0;
    for (const std::uint32_t link : links) {
        PairManifold& manifold = manifolds_[link_manifolds_[link]];
        for (std::size_t i = 0; i < manifold.count(); ++i) {
            manifold.set_impulse(i, solver.impulse(row++));
        }
    }
    for (const std::uint32_t member : members) {
        for (std::size_t i = 0; i < ground_contacts[member].count(); ++i) {
            ground_contacts[member].set_impulse(i, solver.impulse(row++));
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
        const Twist& displacement = solver_bodies_[member].velocity;
        // Where ground is not loaded the body does not move here, and parks in its own step.
        apply_separation(bodies[member], ground_contacts[member], scene.ground, displacement,
                         scene.gravity, duration);
    }
}

}  // namespace terrane::internal
