// SPDX-License-Identifier: MIT
//
// Sources:    Ericson. Real-Time Collision Detection. 2005, section 9.5 (lowering instead of inflating).
// Deviations: instead of lowering the surface by L, the cast shape is raised by L. A body that does not penetrate the
//             surface lowered by L separates by moving up by L, so its penetration depth is at most L. Near volumes the
//             body is shrunk instead, which also holds below ceilings and next to walls: the shrunk body never touches
//             a triangle, so no overlap along a normal exceeds the offset.
#include "world/solver/body_step.h"

#include "ground/column/ground_lift.h"
#include "ground/heightfield/heightfield_queries.h"
#include "ground/joined_queries.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {
namespace {

/// Swept tests are tried on pieces halved down to this share of the motion; the remainder is cast.
constexpr double kLeastProved = 1.0 / 16.0;
/// Least stop gap, metres, slightly above rounding, so that a body closer than kStopGap may move away.
constexpr double kLeastStopGap = 1e-11;

/// Skips leading pieces of a motion that the swept test proves clear, usually most of it, and casts the remainder.
CastAnswer find_hit(const Shape& shape, const Motion& motion, const Ground& ground,
                    double tolerance, HitSearch hits) {
    const auto piece = [&](double from, double share) -> Motion {
        return {motion.at(from), share * motion.translation, share * motion.rotation_vector};
    };
    double clear = 0.0;
    for (double share = 1.0; share >= kLeastProved && clear < 1.0; share *= 0.5) {
        if (is_sweep_clear(shape, piece(clear, share), ground, tolerance)) clear += share;
    }
    CastAnswer answer;
    answer.status = QueryStatus::complete;
    if (clear == 1.0) return answer;
    if (clear > 0.0 && hits == HitSearch::stop_at_proved) {
        answer.hit = true;
        answer.fraction = clear;
        return answer;
    }
    answer = columns::cast(shape, piece(clear, 1.0 - clear), ground,
                           {.tolerance = tolerance, .skip_separating = true});
    answer.fraction = clear + answer.fraction * (1.0 - clear);
    return answer;
}

/// advance() near volumes: casts the shrunk body against all triangles.
MoveAnswer advance_on_mesh(RigidBody& body, const Ground& ground, const Motion& motion,
                           const Pose& end, OffsetSurface& surface) {
    if (!surface.is_mesh) {
        // The contacts were found against the heightfield, farther from the volumes.
        const MeshOffset first = find_mesh_offset(body, ground, surface.index);
        if (first.is_missing) return {.resident = false, .hit = false, .fraction = 0.0};
        if (first.index == kOffsetCount) return {.resident = true, .hit = true, .fraction = 0.0};
        surface.index = first.index;
        surface.is_mesh = true;
        surface.stop_gap = std::max(
            kLeastStopGap, 0.5 * std::min(first.distance, 2.0 * kStopGap * body.tolerance));
    }
    Motion path{body.pose, end.translation - body.pose.translation, Eigen::Vector3d::Zero()};
    if (!std::holds_alternative<Sphere>(*body.shape)) path.rotation_vector = motion.rotation_vector;
    const MeshSweepAnswer met =
        sweep_mesh(*body.shape, path, ground, offset_depth(body, surface.index), surface.stop_gap);
    if (met.is_missing) return {.resident = false, .hit = false, .fraction = 0.0};
    const MoveAnswer answer{
        .resident = true, .hit = met.hit, .fraction = met.hit ? met.fraction : 1.0};
    if (answer.fraction > 0.0) body.pose = answer.fraction < 1.0 ? motion.at(answer.fraction) : end;
    return answer;
}

}  // namespace

OffsetSurface make_offset_surface(const RigidBody& body, const GroundContactCache& cache, int from,
                                  int index) {
    if (cache.is_on_mesh()) {
        const int first = std::min(std::max(index, cache.mesh_offset()), kOffsetCount - 1);
        const double room = std::min(cache.mesh_distance(), 2.0 * kStopGap * body.tolerance);
        return {first, true, std::max(kLeastStopGap, 0.5 * room), cache.clear_distance(0.0)};
    }
    const double extra_offset = offset_depth(body, index) - offset_depth(body, from);
    const double gap = cache.least_gap(extra_offset, 2.0 * kStopGap * body.tolerance);
    return {index, false, std::max(kLeastStopGap, 0.5 * gap), cache.clear_distance(extra_offset)};
}

// The lift decreases by exactly the depth of the offset surface, so that one contact query serves all surfaces.
int first_clear_offset(const RigidBody& body, const GroundContactCache& cache) {
    if (cache.is_on_mesh()) return cache.mesh_offset();
    const double clear = kStopGap * body.tolerance;
    int index = 0;
    for (; index < kOffsetCount; ++index) {
        const double extra_offset = offset_depth(body, index) - offset_depth(body, 0);
        if (cache.lift() > extra_offset) continue;
        if (index + 1 == kOffsetCount || cache.least_gap(extra_offset, clear) >= clear) break;
        // The steps to all later surfaces are smaller than the required gap: take this one.
        if (offset_depth(body, index + 1) - offset_depth(body, index) < 2.0 * clear) break;
    }
    return index;
}

bool is_swept_sphere_clear(const RigidBody& body, const Ground& ground,
                           const Eigen::Vector3d& displacement) {
    const LocalGround local(ground, body.pose.translation);
    const Eigen::Vector3d half_move = 0.5 * displacement;
    const Eigen::Vector3d centre = local.to_local(body.pose.translation) + half_move;
    const Eigen::Vector3d half =
        half_move.cwiseAbs() + Eigen::Vector3d::Constant(body.radius + body.tolerance);
    return is_finite(half) && is_finite(body.velocity.angular) &&
           centre.z() - half.z() > bound_ground(local, centre, half);
}

MoveAnswer advance(RigidBody& body, const Ground& ground, const Twist& displacement,
                   OffsetSurface& surface, HitSearch hits) {
    const Motion motion{body.pose, displacement.linear, displacement.angular};
    const Pose end = motion.at(1.0);
    MoveAnswer answer;
    const double reach = length(displacement.linear) + body.radius * length(displacement.angular);
    if (reach <= surface.clear_distance) {
        surface.clear_distance -= reach;
        body.pose = end;
        return answer;
    }
    surface.clear_distance = 0.0;
    if (surface.is_mesh || may_meet_volume(ground, body.pose.translation,
                                           body.radius + body.tolerance, displacement.linear)) {
        return advance_on_mesh(body, ground, motion, end, surface);
    }
    Motion path{raised(body.pose, offset_depth(body, surface.index)),
                end.translation - body.pose.translation, Eigen::Vector3d::Zero()};
    if (!std::holds_alternative<Sphere>(*body.shape)) path.rotation_vector = displacement.angular;
    const CastAnswer hit = find_hit(*body.shape, path, ground, surface.stop_gap, hits);
    if (hit.status == QueryStatus::not_resident || hit.status == QueryStatus::invalid) {
        return {.resident = false, .hit = false, .fraction = 0.0};
    }
    answer.hit = hit.hit;
    if (hit.hit) answer.fraction = std::min(answer.fraction, hit.fraction);
    if (answer.fraction > 0.0) {
        body.pose = answer.fraction < 1.0 ? motion.at(answer.fraction) : end;
    }
    return answer;
}

MoveAnswer move_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                     const Twist& displacement) {
    cache.update(body, ground,
                 length(displacement.linear) + body.radius * length(displacement.angular));
    if (!cache.is_resident()) return {.resident = false, .hit = false, .fraction = 0.0};
    const int index = first_clear_offset(body, cache);
    if (index == kOffsetCount) return {.resident = true, .hit = true, .fraction = 0.0};
    OffsetSurface surface = make_offset_surface(body, cache, 0, index);
    return advance(body, ground, displacement, surface);
}

CastAnswer cast_wheel(const Shape& shape, const Motion& motion, const Ground& ground,
                      double tolerance) {
    if (may_meet_volume(ground, motion.start.translation, bounding_radius(shape),
                        motion.translation)) {
        const MeshSweepAnswer met =
            sweep_mesh(shape, motion, ground, kFirstOffset * tolerance, kStopGap * tolerance);
        CastAnswer answer;
        answer.status = met.is_missing ? QueryStatus::not_resident : QueryStatus::complete;
        answer.hit = met.hit;
        answer.fraction = met.fraction;
        answer.contact.normal = met.normal;
        answer.contact.point_world = met.on_shape_world;
        return answer;
    }
    Motion path = motion;
    path.start = raised(motion.start, kFirstOffset * tolerance);
    return columns::cast(shape, path, ground,
                         {.tolerance = kStopGap * tolerance, .skip_separating = false});
}

// Sources:    Mirtich. Timewarp and impulse-based simulation of rigid bodies. PhD thesis 1996, chapters 2 and 3
//             (conservative advancement, sequential impacts).
// Deviations: after each impact of a substep the next lower offset surface is used, so that a body stopped just above
//             one surface starts the next piece clear of it.

namespace {

constexpr int kMaxImpacts = 8;     // of an interval
constexpr int kMaxPieces = 64;     // of an interval
constexpr int kMaxIntervals = 32;  // of a substep
/// Rotation after which contacts are found anew, radians: they are solved for points with straight paths.
constexpr double kContactTurn = 0.1;
/// Least share of the interval for which impacts are solved.
constexpr double kLeastSolveShare = 0.01;
/// Largest rotation of a piece of motion, radians.
constexpr double kMaxTurn = 0.5;
/// Speed of recovery of bodies that are too deep, m/s. Recovery leaves them at rest.
constexpr double kRecoverySpeed = 2.0;
/// If a separation achieves less than this share of its displacement, the next mode is tried.
constexpr double kUsefulShare = 0.1;
/// Velocity factor for a body with more impacts in an interval than are simulated.
constexpr double kUnfollowedSlowing = 0.5;

constexpr std::array<std::uint32_t, 1> kAlone{0};
// A box on four corners converges by about a third per iteration. The targets of a body that rolls on two points may be
// infeasible for a rigid body; then `patience` stops the solver.
constexpr StoppingRule kStoppingRule{.iterations = 100, .tolerance = 1e-12, .patience = 8};

bool turns_matter(const RigidBody& body) { return !std::holds_alternative<Sphere>(*body.shape); }

bool spins_freely(const RigidBody& body) {
    const Eigen::Vector3d& inertia = body.mass.inertia;
    return inertia.x() == inertia.y() && inertia.y() == inertia.z();
}

bool has_constant_spin(const RigidBody& body) {
    return spins_freely(body) || body.velocity.angular.isZero(0.0);
}

/// Spin for an angular momentum at a given rotation.
Eigen::Vector3d spin_at(const RigidBody& body, const Eigen::Matrix3d& rotation,
                        const Eigen::Vector3d& momentum) {
    return apply_tensor(rotation, body.mass.inverse_inertia, momentum);
}

double spin_energy(const RigidBody& body, const Eigen::Matrix3d& rotation,
                   const Eigen::Vector3d& spin) {
    return 0.5 * dot(spin, apply_tensor(rotation, body.mass.inertia, spin));
}

/// Rotation vector over an interval: in flight from the spin at its middle, in contact from the solved spin at its
/// start.
Eigen::Vector3d rotation_in(const RigidBody& body, double duration, bool is_flying) {
    const Eigen::Vector3d spin = body.velocity.angular;
    if (!is_flying || has_constant_spin(body)) return spin * duration;
    const Eigen::Vector3d momentum = apply_tensor(body.pose.rotation, body.mass.inertia, spin);
    const Motion half{body.pose, Eigen::Vector3d::Zero(), 0.5 * duration * spin};
    return spin_at(body, half.at(1.0).rotation, momentum) * duration;
}

/// Like integrate(), but moves the body against an offset surface.
MoveAnswer move_piece(RigidBody& body, const Ground& ground, double duration,
                      OffsetSurface& surface, bool is_flying) {
    const Eigen::Matrix3d rotation = body.pose.rotation;
    const Twist displacement{body.velocity.linear * duration,
                             rotation_in(body, duration, is_flying)};
    const MoveAnswer answer = advance(body, ground, displacement, surface);
    if (answer.fraction > 0.0) conserve_momentum(body, rotation);
    return answer;
}

/// Solver for the ground contacts of one body.
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

/// Without warm start, because the velocity may include the impulses of an earlier solve.
void solve(RigidBody& body, const GroundContactCache& cache, double duration) {
    if (!cache.has_contacts()) return;
    GroundSolver solver(body, cache);
    solver.velocity() = body.velocity;
    (*solver).solve_velocity(kAlone, bounce_speed(length(body.acceleration), duration), duration,
                             kStoppingRule);
    body.velocity = solver.velocity();
}

enum class SeparationMode { rigid, translation, vertical };

/// Opens contacts below the separation gap at bounded speed. False: ground needed for the result is not resident.
bool separate(RigidBody& body, const Ground& ground, const GroundContactCache& cache,
              OffsetSurface& surface, double duration) {
    const double target_gap = kSeparationGap * body.tolerance;
    if (cache.least_gap(0.0, target_gap) >= target_gap) return true;
    const double distance = kSeparationSpeed * duration;
    const WorldPos before = body.pose.translation;
    // A rotation may move another corner into the ground, and an unconverged translation may hit the opposite wall of a
    // crack. The vertical translation is always clear.
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

/// Finds and solves the ground contacts, and advances the body by `duration`, or less if it has rotated so far that its
/// contacts must be found anew.
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
            // Impacts that are not simulated must also dissipate energy, or a body spinning in a crack would never come
            // to rest.
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
    constexpr double kSlack = 1e-9;  // rounding: 2.0000001 counts as 2
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

// Sources:    Mirtich. Impulse-based dynamic simulation of rigid body systems. PhD thesis 1996, chapters 2 and 3.
//             Catto. Solver2D and the soft step. 2024 (contact detection once per step, substeps on these contacts).
// Deviations: the poses of substeps are scratch. Only the net displacement is applied, and only as far as it is proved
//             clear of an offset surface.

namespace {

/// Search distance for contacts of a collision step beyond the contact margin, metres: the distance that the body may
/// move, at most its smallest half extent and the spacing of the ground.
double contact_reach(const RigidBody& body, const Ground& ground, const StepSpan& span) {
    const double most = std::min(body.thickness, ground.spacing());
    const double fall = length(body.acceleration) * span.duration * span.duration;
    return std::min(most, greatest_speed(body) * span.duration + fall);
}

}  // namespace

StepStart begin_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                               const Ground* ground_before, const StepSpan& span) {
    StepStart start;
    start.pose = body.pose;
    const Eigen::Vector3d reach =
        body.velocity.linear * span.duration + body.acceleration * (span.duration * span.duration);
    // A body with contacts is near the ground, where the test would fail.
    if (!cache.has_contacts() && is_swept_sphere_clear(body, ground, reach)) {
        cache.set_out_of_reach();
    } else {
        const double travel =
            length(reach) + body.radius * length(body.velocity.angular) * span.duration;
        cache.refresh_for_step(body, ground, ground_before, contact_reach(body, ground, span),
                               travel);
        if (!cache.is_resident()) {
            start.kind = StepStart::Kind::unresident;
            return start;
        }
    }
    const int offset = first_clear_offset(body, cache);
    const bool is_deep = offset == kOffsetCount;
    if (body.is_fresh || !is_deep) body.started_deep = is_deep;
    body.is_fresh = false;
    if (is_deep) {
        start.kind = StepStart::Kind::too_deep;
        return start;
    }
    body.escape_translation.setZero();
    start.surface = make_offset_surface(body, cache, 0, offset);
    return start;
}

SubstepAnswer end_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                                 const StepStart& start, const StepSpan& span) {
    SubstepAnswer answer;
    answer.simulated_time = span.duration;
    answer.touches = cache.is_near(body);
    const Pose end = body.pose;
    Twist displacement{end.translation - start.pose.translation, Eigen::Vector3d::Zero()};
    if (!(end.rotation == start.pose.rotation)) {
        displacement.angular = rotation_vector_between(start.pose.rotation, end.rotation);
    }
    body.pose = start.pose;
    OffsetSurface surface = start.surface;
    if (cache.is_out_of_reach()) {
        // Other bodies may have pushed the body out of the space that was clear at the start of the step.
        const bool is_clear = is_swept_sphere_clear(body, ground, displacement.linear);
        if (!is_clear) surface.clear_distance = 0.0;
    }
    const MoveAnswer moved =
        advance(body, ground, displacement, surface, HitSearch::stop_at_proved);
    if (!moved.resident) {
        answer.resident = false;
        return answer;
    }
    if (!moved.hit) {
        if (surface.index == 0 && !surface.is_mesh) cache.set_proved_clear(body);
        return answer;
    }
    const double left = (1.0 - moved.fraction) * span.duration;
    answer.simulated_time = span.duration - left;
    ++answer.impacts;
    answer.touches = true;
    conserve_momentum(body, end.rotation);
    cache.invalidate();
    if (!(left > 0.0)) return answer;
    const double pieces = std::ceil(left / span.substep());
    for (double piece = 0.0; piece < pieces && answer.resident; piece += 1.0) {
        answer.add(step_body(body, cache, ground, left / pieces));
    }
    // The velocity includes the work of gravity down to the end, which was not reached.
    if (answer.resident) compensate_height_gain(body, end.translation);
    return answer;
}

SubstepAnswer recover_for_step(RigidBody& body, const Ground& ground, const StepSpan& span) {
    SubstepAnswer answer;
    answer.touches = true;
    answer.resident = recover(body, ground, span.duration);
    answer.simulated_time = span.duration;
    return answer;
}

}  // namespace terrane::internal
