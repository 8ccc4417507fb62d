// SPDX-License-Identifier: MIT
//
// Sources:    Macklin et al. Small steps in physics simulation. SCA 2019 (substeps instead of iterations).
//             Catto. Iterative dynamics with temporal coherence. GDC 2005 (sequential impulses, warm start).
//             Catto. Solver2D. 2024 (contact detection once a step; restitution in a pass after contacts have closed).
// Deviations: restitution returns at most the energy that the contacts have removed, and the island's total energy
//             (potential energy included) never exceeds that at the start of the step. Small islands are solved to
//             convergence.
#include "world/island_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

/// Small islands are solved until no velocity changes in a sweep by more than the tolerance, m/s, which grows with the
/// speed of the island. Large islands stop after kMaxRowSolves contact updates (fewer above kManyContacts contacts),
/// but not before kLeastIterations sweeps: warm-started stacks converge over several substeps.
constexpr double kTolerance = 1e-5;
constexpr double kRelativeTolerance = 1e-3;  // of the mean speed
constexpr std::size_t kMaxRowSolves = 40'000;
constexpr std::size_t kManyContacts = 2000;
constexpr std::size_t kLeastIterations = 8;
/// A solve that improves by less than a tenth in this number of sweeps has stalled: its targets are taken as
/// infeasible. Even a converging solve of a pile improves by less than a hundredth per sweep.
constexpr int kPatience = 100;
/// Islands with a mass ratio of heaviest to lightest body above kWideMassRatio are solved along conjugate directions:
/// sweeps alone reduce the error by only about the inverse of this ratio per sweep, and stall. Islands with a ratio
/// above kWidestMassRatio are not, because the rounding of the heaviest body's impulses would accelerate the lightest.
constexpr double kWideMassRatio = 100.0;
constexpr double kWidestMassRatio = 1e7;
/// Rule for an island of one body. A box on four corners converges by about a third per sweep. A body that rolls on
/// two points may have infeasible targets; then `patience` stops the solver.
constexpr StoppingRule kLoneBodyRule{.iterations = 100, .tolerance = 5e-7, .patience = 8};
/// An island below the speed kSlow, m/s, gets angular damping at the rate kRollingLoss, 1/s, so that it can sleep:
/// nothing else damps rolling and rocking.
constexpr double kSlow = 0.3;
constexpr double kRollingLoss = 4.0;
/// Relative rounding error of energies and heights, subtracted so that rounding cannot make the total energy grow.
constexpr double kEnergyRounding = 0x1p-51;
/// Threads take islands in blocks of this size.
constexpr std::size_t kIslandBlock = 8;

/// @param mean_speed   mean, over the bodies, of the speed of a body's fastest point, m/s
/// @param is_conjugate whether the island is solved along conjugate directions, which do not converge steadily
StoppingRule stopping_rule(std::size_t body_count, std::size_t contact_count, double mean_speed,
                           bool is_conjugate) {
    if (body_count == 1) return kLoneBodyRule;
    const std::size_t row_solves =
        kMaxRowSolves * kManyContacts / std::max(kManyContacts, contact_count);
    const std::size_t sweeps =
        std::max(kLeastIterations, row_solves / std::max<std::size_t>(1, contact_count));
    return {.iterations = static_cast<int>(sweeps),
            .tolerance = std::max(kTolerance, kRelativeTolerance * mean_speed),
            .patience = is_conjugate ? std::numeric_limits<int>::max() : kPatience};
}

}  // namespace

void IslandSolver::step(std::span<RigidBody> bodies, std::span<GroundGate> gates,
                        const BodyActuators& actuators, const StepSpan& span, WorkerTeam& team) {
    solver_bodies_.resize(bodies.size());
    struck_.assign(bodies.size(), 0);
    scratch_.resize(static_cast<std::size_t>(team.size()));
    if (records_impulses_) {
        pair_impulses_.assign(manifolds_.size(), Eigen::Vector3d::Zero());
        ground_impulses_.assign(bodies.size(), Eigen::Vector3d::Zero());
    }
    // A body that belongs to no island may touch several islands, so no island writes it.
    for (const BodyPair& link : links_) {
        for (const std::uint32_t i : {link.a, link.b}) {
            if (moves_[i] != 0) continue;
            const bool is_prescribed = prescribed_index_[i] != kNone;
            solver_bodies_[i].set_fixed(bodies[i].pose,
                                        is_prescribed ? bodies[i].velocity : Twist{});
        }
    }
    const Scene scene{bodies, gates, actuators, span};
    const std::size_t count = islands_.count();
    team.run((count + kIslandBlock - 1) / kIslandBlock, [&](std::size_t block, int worker) {
        const std::size_t end = std::min(count, (block + 1) * kIslandBlock);
        for (std::size_t island = block * kIslandBlock; island < end; ++island) {
            step_island(island, scratch_[static_cast<std::size_t>(worker)], scene);
        }
    });
}

void IslandSolver::step_island(std::size_t island, Scratch& scratch, const Scene& scene) {
    const std::span<const std::uint32_t> members = islands_.bodies(island);
    const std::span<const std::uint32_t> links = islands_.links(island);
    const std::span<RigidBody> bodies = scene.bodies;
    const StepSpan& span = scene.span;
    const double substep = span.substep();
    const std::size_t contact_count = count_contacts(island, scene);
    const bool has_wheels = !scene.actuators.wheels.empty() &&
                            std::any_of(members.begin(), members.end(), [&](std::uint32_t member) {
                                return scene.actuators.wheels[member] != nullptr;
                            });
    if (contact_count == 0 && !has_wheels) {
        for (const std::uint32_t member : members) {
            for (int i = 0; i < span.substep_count; ++i) {
                bodies[member].velocity.linear += bodies[member].acceleration * substep;
                integrate(bodies[member], substep, true);
            }
        }
        return;
    }

    if (scratch.rows.size() < contact_count) scratch.rows.resize(contact_count);
    scratch.impacts.resize(contact_count);
    scratch.separating_speeds.assign(contact_count, -1.0);
    const WorldPos origin = bodies[members.front()].pose.translation;
    double most_energy = total_energy(island, origin, scene);
    double mean_speed = 0.0, acceleration = 0.0;
    double least_inverse_mass = bodies[members.front()].mass.inverse_mass;
    double greatest_inverse_mass = least_inverse_mass;
    for (const std::uint32_t member : members) {
        mean_speed += greatest_speed(bodies[member]);
        acceleration = std::max(acceleration, length(bodies[member].acceleration));
        const double inverse_mass = bodies[member].mass.inverse_mass;
        least_inverse_mass = std::min(least_inverse_mass, inverse_mass);
        greatest_inverse_mass = std::max(greatest_inverse_mass, inverse_mass);
    }
    const double mass_ratio = greatest_inverse_mass / least_inverse_mass;
    const bool is_conjugate = mass_ratio > kWideMassRatio && mass_ratio <= kWidestMassRatio;
    mean_speed /= static_cast<double>(members.size());
    const StoppingRule rule =
        stopping_rule(members.size(), contact_count, mean_speed, is_conjugate);
    const double least_bounce = least_bounce_speed(acceleration, substep);
    for (const std::uint32_t member : members) {
        solver_bodies_[member].set(bodies[member].mass, bodies[member].pose, {});
    }
    ContactSolver solver(solver_bodies_, scratch.rows);
    add_contacts(island, solver, scratch, scene);
    if (is_conjugate) {
        scratch.directions.resize(contact_count);
        solver.use_conjugate_directions(members, scratch.directions);
    }
    double removed = 0.0;
    bool bounces = false;
    for (int i = 0; i < span.substep_count; ++i) {
        for (const std::uint32_t member : members) {
            bodies[member].velocity.linear += bodies[member].acceleration * substep;
            solver_bodies_[member].velocity = bodies[member].velocity;
        }
        if (has_wheels) most_energy += apply_wheels(members, i, scene);
        if (i > 0) follow(island, i, solver, scene);
        solver.turn_fixed_bodies(i > 0 ? substep : 0.5 * substep);
        const bool overlaps = begin_impacts(contact_count, solver, scratch, scene);
        double removed_now = 0.0;
        if (solver.solve_plastic(members, substep, rule, removed_now)) {
            removed += removed_now;
            for (std::size_t contact = 0; contact < contact_count; ++contact) {
                const Impact& impact = scratch.impacts[contact];
                const double approach = solver.approach_speed(contact);
                // Restitution applies only to the part of the closing speed that the wheels did not cause.
                const double bouncing = approach - impact.pushed_speed;
                if (!(solver.normal_impulse(contact) > 0.0) || bouncing <= least_bounce ||
                    approach * substep <= impact.gap) {
                    continue;
                }
                if (impact.b == kNone) struck_[impact.a] = 1;
                if (!(impact.restitution > 0.0)) continue;
                // The impact precedes the end of the substep, so the acceleration acted for less time.
                const double excess = impact.acceleration * (substep - impact.gap / approach);
                double& separating = scratch.separating_speeds[contact];
                separating =
                    std::max(separating, impact.restitution * std::max(0.0, bouncing - excess));
                bounces = true;
            }
        }
        for (const std::uint32_t member : members) {
            bodies[member].velocity = solver_bodies_[member].velocity;
        }
        for (const std::uint32_t member : members) {
            const bool is_flying = links.empty() && !scene.ground_contacts(member).has_contacts();
            integrate(bodies[member], substep, is_flying);
        }
        const bool is_last = i + 1 == span.substep_count;
        if (is_last) store_impulses(island, solver, scene);
        if (is_last && bounces) {
            const double left = most_energy - total_energy(island, origin, scene);
            bounce(island, solver, scratch, scene, std::clamp(left, 0.0, removed), rule);
        }
        if (records_impulses_) record_impulses(island, solver, scene);
        if (!is_last) continue;
        if (overlaps) separate(island, solver, scene);
        limit_energy(island, solver, scene, origin, most_energy);
    }

    const bool is_slow = std::all_of(members.begin(), members.end(), [&](std::uint32_t member) {
        return greatest_speed(bodies[member]) < kSlow;
    });
    if (!is_slow || contact_count == 0) return;
    const double kept = std::max(0.0, 1.0 - kRollingLoss * span.duration);
    for (const std::uint32_t member : members) bodies[member].velocity.angular *= kept;
}

/// Applies the foot drive of a character to a contact.
/// @param b kNone for the ground
void IslandSolver::drive_feet(SolverContact& contact, std::uint32_t a, std::uint32_t b,
                              const Scene& scene) {
    if (scene.actuators.feet.empty()) return;
    const double substep = scene.span.substep();
    if (const FootDrive* const feet = scene.actuators.feet[a]) feet->drive(contact, 1.0, substep);
    if (b == kNone) return;
    if (const FootDrive* const feet = scene.actuators.feet[b]) feet->drive(contact, -1.0, substep);
}

/// The closing speed that wheel forces cause at a contact in the substep, m/s, >= 0.
double IslandSolver::pushed_speed(std::size_t contact, const Impact& impact,
                                  const ContactSolver& solver, const Scene& scene) const {
    const auto before = [&](std::uint32_t body) {
        return body != kNone && moves_[body] != 0 ? &scene.bodies[body].velocity : nullptr;
    };
    return std::max(0.0, solver.closing_speed(contact, before(impact.a), before(impact.b)));
}

/// Applies wheel forces for a substep. Returns the energy that they add to the island by the end of the substep, J:
/// kinetic energy, minus the work of the accelerations along the added displacements.
double IslandSolver::apply_wheels(std::span<const std::uint32_t> members, int substep,
                                  const Scene& scene) {
    double added = 0.0;
    for (const std::uint32_t member : members) {
        WheelSet* const wheels = scene.actuators.wheels[member];
        if (wheels == nullptr) continue;
        for (WheelContact& contact : wheels->contacts()) {
            if (!contact.touches || contact.body == kNone) continue;
            contact.body_pose = body_at(contact.body, substep, scene).pose;
        }
        added +=
            wheels->apply(solver_bodies_, member, scene.bodies[member].pose, scene.span.substep());
    }
    for (const std::uint32_t member : members) {
        const RigidBody& body = scene.bodies[member];
        const Eigen::Vector3d change =
            solver_bodies_[member].velocity.linear - body.velocity.linear;
        added -= dot(body.acceleration, change) * scene.span.substep() / body.mass.inverse_mass;
    }
    return added;
}

/// A body of a link, at its pose in a substep: for a prescribed body, which islands do not step, the precomputed pose.
const RigidBody& IslandSolver::body_at(std::uint32_t body, int substep, const Scene& scene) const {
    const bool is_later = substep > 0 && moves_[body] == 0 && prescribed_index_[body] != kNone;
    if (!is_later) return scene.bodies[body];
    return later_prescribed_[prescribed_index_[body] + static_cast<std::size_t>(substep - 1)];
}

std::size_t IslandSolver::count_contacts(std::size_t island, const Scene& scene) const {
    std::size_t count = 0;
    for (const std::uint32_t link : islands_.links(island)) {
        count += contact_count(link);
    }
    for (const std::uint32_t member : islands_.bodies(island)) {
        count += scene.ground_contacts(member).count();
    }
    return count;
}

/// Adds the contacts to the solver, for the poses at the start of the collision step.
void IslandSolver::add_contacts(std::size_t island, ContactSolver& solver, Scratch& scratch,
                                const Scene& scene) {
    const std::span<const std::uint32_t> members = islands_.bodies(island);
    const std::span<const std::uint32_t> links = islands_.links(island);
    std::size_t index = 0;
    const auto add = [&](const SolverContact& contact, double acceleration) {
        Impact& impact = scratch.impacts[index++];
        impact.a = contact.a;
        impact.b = contact.b == SolverContact::kGround ? kNone : contact.b;
        impact.acceleration = acceleration;
        impact.restitution = contact.restitution;
        solver.add(contact);
    };
    for (const std::uint32_t link : links) {
        if (manifold(link) == nullptr) continue;
        const PairManifold& manifold = *this->manifold(link);
        const auto [a, b] = manifold.pair;
        for (std::size_t i = 0; i < manifold.count(); ++i) {
            SolverContact contact = manifold.contact(i, scene.bodies[a], scene.bodies[b]);
            drive_feet(contact, a, b, scene);
            add(contact, 0.0);
        }
    }
    // The ground is last, so that its constraints are satisfied best.
    for (const std::uint32_t member : members) {
        const GroundContactCache& cache = scene.ground_contacts(member);
        // No warm start for a lone body with changed contacts: redistributing old impulses would take many sweeps.
        const bool is_warm = members.size() > 1 || !links.empty() || cache.has_same_contacts();
        for (std::size_t i = 0; i < cache.count(); ++i) {
            SolverContact contact = cache.contact(i, scene.bodies[member], member);
            if (!is_warm) contact.initial_impulse.setZero();
            drive_feet(contact, member, kNone, scene);
            add(contact, std::max(0.0, -dot(contact.normal, scene.bodies[member].acceleration)));
        }
    }
}

/// Updates the gaps of the contacts for a later substep, keeping their planes and points.
void IslandSolver::follow(std::size_t island, int substep, ContactSolver& solver,
                          const Scene& scene) {
    std::size_t row = 0;
    for (const std::uint32_t link : islands_.links(island)) {
        if (manifold(link) == nullptr) continue;
        PairManifold& manifold = *this->manifold(link);
        const auto [a, b] = manifold.pair;
        manifold.follow(body_at(a, substep, scene), body_at(b, substep, scene));
        for (std::size_t i = 0; i < manifold.count(); ++i) {
            solver.set_gap(row++, manifold.solved_gap(i, scene.bodies[a], scene.bodies[b]));
        }
    }
    for (const std::uint32_t member : islands_.bodies(island)) {
        GroundContactCache& cache = scene.ground_contacts(member);
        cache.follow(scene.bodies[member]);
        for (std::size_t i = 0; i < cache.count(); ++i) solver.set_gap(row++, cache.gap(i));
    }
}

/// Sets gap and pushed_speed of the impacts for a substep. Returns whether a contact needs separation.
bool IslandSolver::begin_impacts(std::size_t contact_count, const ContactSolver& solver,
                                 Scratch& scratch, const Scene& scene) const {
    bool overlaps = false;
    for (std::size_t i = 0; i < contact_count; ++i) {
        Impact& impact = scratch.impacts[i];
        impact.gap = std::max(0.0, solver.gap_to_rest(i));
        impact.pushed_speed =
            scene.actuators.wheels.empty() ? 0.0 : pushed_speed(i, impact, solver, scene);
        overlaps = overlaps || solver.is_below_target(i);
    }
    return overlaps;
}

void IslandSolver::store_impulses(std::size_t island, const ContactSolver& solver,
                                  const Scene& scene) {
    std::size_t row = 0;
    for (const std::uint32_t link : islands_.links(island)) {
        PairManifold* const contacts = manifold(link);
        for (std::size_t i = 0; i < contact_count(link); ++i) {
            contacts->set_impulse(i, solver.impulse(row++));
        }
    }
    for (const std::uint32_t member : islands_.bodies(island)) {
        GroundContactCache& cache = scene.ground_contacts(member);
        for (std::size_t i = 0; i < cache.count(); ++i) cache.set_impulse(i, solver.impulse(row++));
    }
}

/// Adds the impulses of a substep to the recorded impulses of the step.
void IslandSolver::record_impulses(std::size_t island, const ContactSolver& solver,
                                   const Scene& scene) {
    std::size_t row = 0;
    for (const std::uint32_t link : islands_.links(island)) {
        for (std::size_t i = 0; i < contact_count(link); ++i) {
            pair_impulses_[link_manifolds_[link]] += solver.impulse(row++);
        }
    }
    for (const std::uint32_t member : islands_.bodies(island)) {
        for (std::size_t i = 0; i < scene.ground_contacts(member).count(); ++i) {
            ground_impulses_[member] += solver.impulse(row++);
        }
    }
}

/// Opens contacts whose gaps are below the target, at bounded speed and without changing velocities.
void IslandSolver::separate(std::size_t island, ContactSolver& solver, const Scene& scene) {
    const std::span<const std::uint32_t> members = islands_.bodies(island);
    for (const std::uint32_t member : members) solver_bodies_[member].velocity = {};
    const double distance = kSeparationSpeed * scene.span.duration;
    solver.solve_separation(distance, true);
    for (const std::uint32_t member : members) {
        RigidBody& body = scene.bodies[member];
        const WorldPos before = body.pose.translation;
        const Twist displacement =
            clamp_displacement(solver_bodies_[member].velocity, body.radius, distance);
        const Motion motion{body.pose, displacement.linear, displacement.angular};
        body.pose = motion.at(1.0);
        compensate_height_gain(body, before);
    }
}

/// Applies restitution to the contacts that have closed in the step.
void IslandSolver::bounce(std::size_t island, ContactSolver& solver, Scratch& scratch,
                          const Scene& scene, double max_energy, const StoppingRule& rule) {
    const std::span<const std::uint32_t> members = islands_.bodies(island);
    for (const std::uint32_t member : members) {
        solver_bodies_[member].velocity = scene.bodies[member].velocity;
    }
    solver.solve_restitution(members, scratch.separating_speeds, max_energy, rule);
    for (const std::uint32_t member : members) {
        scene.bodies[member].velocity = solver_bodies_[member].velocity;
    }
}

/// Scales the velocities down if the total energy has grown: contacts that keep their planes over a curved surface may
/// lift bodies.
void IslandSolver::limit_energy(std::size_t island, ContactSolver& solver, const Scene& scene,
                                const WorldPos& origin, double most) {
    const std::span<const std::uint32_t> members = islands_.bodies(island);
    double excess = total_energy(island, origin, scene) - most;
    double kinetic = 0.0;
    for (const std::uint32_t member : members) {
        const RigidBody& body = scene.bodies[member];
        solver_bodies_[member].set(body.mass, body.pose, body.velocity);
        const double energy = kinetic_energy(body.mass, body.pose, body.velocity);
        const double potential =
            std::abs(dot(body.acceleration, body.pose.translation)) / body.mass.inverse_mass;
        kinetic += energy;
        excess += kEnergyRounding * (energy + potential);
    }
    if (!(excess > 0.0)) return;
    solver.limit_kinetic_energy(members, kinetic - excess);
    for (const std::uint32_t member : members) {
        scene.bodies[member].velocity = solver_bodies_[member].velocity;
    }
}

/// Kinetic energy of an island plus the potential energy of its bodies' accelerations relative to an origin, J.
double IslandSolver::total_energy(std::size_t island, const WorldPos& origin,
                                  const Scene& scene) const {
    double energy = 0.0;
    for (const std::uint32_t member : islands_.bodies(island)) {
        const RigidBody& body = scene.bodies[member];
        energy += kinetic_energy(body.mass, body.pose, body.velocity);
        energy -= dot(body.acceleration, body.pose.translation - origin) / body.mass.inverse_mass;
    }
    return energy;
}

}  // namespace terrane::internal
