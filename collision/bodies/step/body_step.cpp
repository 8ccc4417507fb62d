// SPDX-License-Identifier: MIT
//
// Sources:    Mirtich. Timewarp and impulse-based simulation of rigid bodies. PhD thesis 1996, chapters
//             2 and 3 (conservative advancement, impacts one after the other).
// Deviations: after each impact of a substep the next lower offset surface is used, so that a body that was stopped
//             just above one surface starts the next piece clear of it.
#include "bodies/step/body_step.h"

#include "bodies/step/body_depth.h"
#include "bodies/step/offset_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr int kMaxImpacts = 8;     // of an interval
constexpr int kMaxPieces = 64;     // of an interval
constexpr int kMaxIntervals = 32;  // of a substep
/// Contacts are found anew after a rotation by this, radians: they are solved for points that move straight.
constexpr double kContactTurn = 0.1;
/// Impacts are solved for at least this share of the time that the body was to move for.
constexpr double kLeastSolveShare = 0.01;
/// A piece of motion turns by at most this, radians.
constexpr double kMaxTurn = 0.5;
/// Speed at which bodies that are too deep move out of the ground, m/s. It leaves no velocity behind.
constexpr double kRecoverySpeed = 2.0;
/// A separation that moves by less than this share of its displacement is followed by the next mode.
constexpr double kUsefulShare = 0.1;
/// Factor of the velocity of a body that has more impacts in an interval than are simulated.
constexpr double kUnfollowedSlowing = 0.5;

constexpr std::array<std::uint32_t, 1> kAlone{0};
// A box on four corners converges by about a third an iteration. The targets of a body that rolls on two points may be
// infeasible for a rigid body: then nothing converges, and `patience` stops the solver.
constexpr StoppingRule kStoppingRule{.iterations = 100, .tolerance = 1e-12, .patience = 8};

bool turns_matter(const RigidBody& body) { return !std::holds_alternative<Sphere>(*body.shape); }

bool spins_freely(const RigidBody& body) {
    const Eigen::Vector3d& inertia = body.mass.inertia;
    return inertia.x() == inertia.y() && inertia.y() == inertia.z();
}

bool has_constant_spin(const RigidBody& body) {
    return spins_freely(body) || body.velocity.angular.isZero(0.0);
}

/// Spin at a rotation for an angular momentum.
Eigen::Vector3d spin_at(const RigidBody& body, const Eigen::Matrix3d& rotation,
                        const Eigen::Vector3d& momentum) {
    return apply_tensor(rotation, body.mass.inverse_inertia, momentum);
}

double spin_energy(const RigidBody& body, const Eigen::Matrix3d& rotation,
                   const Eigen::Vector3d& spin) {
    return 0.5 * dot(spin, apply_tensor(rotation, body.mass.inertia, spin));
}

/// The rotation of a body in a time: in flight with the spin of its middle, in contact with that of its start, which
/// was solved for.
Eigen::Vector3d rotation_in(const RigidBody& body, double duration, bool is_flying) {
    const Eigen::Vector3d spin = body.velocity.angular;
    if (!is_flying || has_constant_spin(body)) return spin * duration;
    const Eigen::Vector3d momentum = apply_tensor(body.pose.rotation, body.mass.inertia, spin);
    const Motion half{body.pose, Eigen::Vector3d::Zero(), 0.5 * duration * spin};
    return spin_at(body, half.at(1.0).rotation, momentum) * duration;
}

/// Advances a body against an offset surface for a time, as integrate() does without one.
MoveAnswer move_piece(RigidBody& body, const Ground& ground, double duration,
                      OffsetSurface& surface, bool is_flying) {
    const Eigen::Matrix3d rotation = body.pose.rotation;
    const Twist displacement{body.velocity.linear * duration,
                             rotation_in(body, duration, is_flying)};
    const MoveAnswer answer = advance(body, ground, displacement, surface);
    if (answer.fraction > 0.0) conserve_momentum(body, rotation);
    return answer;
}

/// The solver of one body's contacts with the ground.
class GroundSolver {
public:
    GroundSolver(const RigidBody& body, const GroundContactCache& cache) : solver_(bodies_, room_) {
        bodies_[0].set(body.mass, body.pose, {});
        for (std::size_t i = 0; i < cache.count(); ++i) {
            SolverContact contact = cache.contact(i, body, 0);
            contact.initial_impulse.setZero();
            solver_.add(contact);
        }
    }
    ContactSolver& operator*() { return solver_; }
    Twist& velocity() { return bodies_[0].velocity; }

private:
    std::array<SolverBody, 1> bodies_;
    std::array<ContactRows, GroundContactCache::kMaxCount> room_;
    ContactSolver solver_;
};

/// No warm start: the velocity may include the impulses of an earlier solve.
void solve(RigidBody& body, const GroundContactCache& cache, double duration) {
    if (!cache.has_contacts()) return;
    GroundSolver solver(body, cache);
    solver.velocity() = body.velocity;
    (*solver).solve_velocity(kAlone, bounce_speed(length(body.acceleration), duration), duration,
                             kStoppingRule);
    body.velocity = solver.velocity();
}

enum class SeparationMode { rigid, translation, vertical };

/// Opens contacts below the separation gap, at bounded speed. False: ground needed for the result is not resident.
bool separate(RigidBody& body, const Ground& ground, const GroundContactCache& cache,
              OffsetSurface& surface, double duration) {
    const double target_gap = kSeparationGap * body.tolerance;
    if (cache.least_gap(0.0, target_gap) >= target_gap) return true;
    const double distance = kSeparationSpeed * duration;
    const WorldPos before = body.pose.translation;
    // A rotation may bring another corner into the ground, and an unconverged translation may meet the opposite wall of
    // a crack. The vertical translation is always clear.
    for (const SeparationMode mode :
         {SeparationMode::rigid, SeparationMode::translation, SeparationMode::vertical}) {
        Twist displacement;
        if (mode == SeparationMode::vertical) {
            displacement.linear.z() = std::min(distance, std::max(0.0, cache.lift()) + target_gap);
        } else {
            GroundSolver solver(body, cache);
            (*solver).solve_separation(distance, mode == SeparationMode::rigid);
            displacement = clamp_displacement(solver.velocity(), body.radius, 2.0 * distance);
        }
        if (displacement.linear.isZero(0.0) && displacement.angular.isZero(0.0)) return true;
        const MoveAnswer moved = advance(body, ground, displacement, surface);
        if (!moved.resident) return false;
        if (moved.fraction >= kUsefulShare) break;
    }
    compensate_height_gain(body, before);
    return true;
}

/// The part of a substep between two contact queries.
struct Interval {
    bool resident = true;
    bool touches = false;
    bool is_last = false;  ///< ends with the substep
    int impacts = 0;
    double simulated_time = 0.0;
    double lost_time = 0.0;
};

/// Finds the ground contacts, solves them, and advances the body: by `duration`, or less where it has rotated so far
/// that its contacts must be found anew.
Interval advance_interval(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                          double duration) {
    if (is_swept_sphere_clear(body, ground, duration * body.velocity.linear)) {
        cache.set_out_of_reach();
    } else {
        cache.update(body, ground, duration * greatest_speed(body));
    }
    if (!cache.is_resident()) return {.resident = false};

    const int first_offset = first_clear_offset(body, cache);
    const bool is_deep = first_offset == kOffsetCount;
    if (body.is_fresh) body.started_deep = is_deep;
    body.is_fresh = false;
    Interval interval;
    interval.is_last = true;
    interval.touches = is_deep || cache.has_contacts();
    if (is_deep) {
        interval.resident = recover(body, ground, duration);
        interval.simulated_time = duration;
        return interval;
    }
    body.started_deep = false;
    body.escape_translation.setZero();
    OffsetSurface surface = make_offset_surface(body, cache, 0, first_offset);

    const auto rate = [&] { return turns_matter(body) ? length(body.velocity.angular) : 0.0; };
    double remaining = duration;
    if (interval.touches) {
        const double turn = rate() * remaining;
        interval.is_last = turn <= kContactTurn;
        if (!interval.is_last) remaining *= kContactTurn / turn;
        solve(body, cache, remaining);
        if (!separate(body, ground, cache, surface, remaining)) return {.resident = false};
    }

    for (int piece_count = 0; remaining > 0.0; ++piece_count) {
        if (piece_count == kMaxPieces || interval.impacts > kMaxImpacts) {
            // Impacts that are not simulated dissipate energy too, or a body that spins in a crack never comes to rest.
            if (interval.impacts > kMaxImpacts) {
                body.velocity.linear *= kUnfollowedSlowing;
                body.velocity.angular *= kUnfollowedSlowing;
            }
            interval.lost_time = remaining;
            return interval;
        }
        const double turn = rate() * remaining;
        const double share = turn > kMaxTurn ? kMaxTurn / turn : 1.0;
        const MoveAnswer moved =
            move_piece(body, ground, share * remaining, surface, !interval.touches);
        if (!moved.resident) return {.resident = false};
        const double advanced = moved.fraction * share * remaining;
        interval.simulated_time += advanced;
        remaining = moved.fraction * share < 1.0 ? remaining - advanced : 0.0;
        if (!moved.hit) continue;

        ++interval.impacts;
        interval.touches = true;
        cache.refresh(body, ground, surface.index);
        if (!cache.is_resident()) return {.resident = false};
        solve(body, cache, std::max(remaining, kLeastSolveShare * duration));
        surface = make_offset_surface(body, cache, surface.index,
                                      std::min(surface.index + 1, kOffsetCount - 1));
        if (advanced > 0.0 && rate() * remaining > kContactTurn) {
            interval.is_last = false;
            return interval;
        }
    }
    return interval;
}

}  // namespace

void conserve_momentum(RigidBody& body, const Eigen::Matrix3d& rotation_before) {
    if (has_constant_spin(body)) return;
    Eigen::Vector3d& spin = body.velocity.angular;
    const Eigen::Vector3d momentum = apply_tensor(rotation_before, body.mass.inertia, spin);
    const double energy = spin_energy(body, rotation_before, spin);
    spin = spin_at(body, body.pose.rotation, momentum);
    const double energy_after = spin_energy(body, body.pose.rotation, spin);
    if (energy_after > energy) spin *= std::sqrt(energy / energy_after);
}

Twist clamp_displacement(Twist displacement, double radius, double most) {
    const double reach = length(displacement.linear) + radius * length(displacement.angular);
    if (reach > most) {
        displacement.linear *= most / reach;
        displacement.angular *= most / reach;
    }
    return displacement;
}

void compensate_height_gain(RigidBody& body, const WorldPos& before) {
    const double work = -dot(body.acceleration, body.pose.translation - before);
    if (!(work > 0.0)) return;
    const double energy = kinetic_energy(body.mass, body.pose, body.velocity);
    const double left = energy - work / body.mass.inverse_mass;
    const double scale = left > 0.0 ? std::sqrt(left / energy) : 0.0;
    body.velocity.linear *= scale;
    body.velocity.angular *= scale;
}

void integrate(RigidBody& body, double duration, bool is_flying) {
    const Eigen::Matrix3d rotation = body.pose.rotation;
    const Motion motion{body.pose, body.velocity.linear * duration,
                        rotation_in(body, duration, is_flying)};
    body.pose = motion.at(1.0);
    conserve_momentum(body, rotation);
}

bool recover(RigidBody& body, const Ground& ground, double duration) {
    body.velocity = {};
    const Depth now = compute_depth(body, ground);
    if (!now.resident) return false;
    double left = length(body.escape_translation);
    if (left == 0.0 || now.depth < left) {
        body.escape_translation = now.depth * now.normal;
        left = now.depth;
    }
    const double share = left > 0.0 ? std::min(1.0, kRecoverySpeed * duration / left) : 0.0;
    body.pose.translation += share * body.escape_translation;
    body.escape_translation *= 1.0 - share;
    return true;
}

double count_substeps(double dt, double max_substep) {
    constexpr double kSlack = 1e-9;  // so that 2.0000001 is 2
    return std::max(1.0, std::ceil(dt / max_substep - kSlack));
}

double bounce_speed(double acceleration, double duration) {
    return std::max(0.1, 4.0 * acceleration * duration);
}

SubstepAnswer step_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                        double duration) {
    SubstepAnswer total;
    const Eigen::Vector3d velocity_before = body.velocity.linear;
    double remaining = duration;
    for (int count = 0; remaining > 0.0; ++count) {
        if (count == kMaxIntervals) {
            total.lost_time += remaining;
            break;
        }
        const Interval interval = advance_interval(body, cache, ground, remaining);
        total.resident = interval.resident;
        if (!interval.resident) break;
        total.touches = interval.touches;
        total.impacts += static_cast<std::uint64_t>(interval.impacts);
        total.simulated_time += interval.simulated_time;
        total.lost_time += interval.lost_time;
        remaining =
            interval.is_last ? 0.0 : remaining - interval.simulated_time - interval.lost_time;
    }
    total.impulse = (body.velocity.linear - velocity_before) / body.mass.inverse_mass;
    return total;
}

}  // namespace terrane::internal
