// SPDX-License-Identifier: MIT
//
// One body's step on the ground, from top to bottom: begin(), end(), and what end() does with a body that the ground
// stops.
//
// Sources:    Mirtich. Timewarp and impulse-based simulation of rigid bodies. PhD thesis 1996, chapters 2 and 3
//             (conservative advancement, sequential impacts).
//             Catto. Solver2D and the soft step. 2024 (contact detection once per step, substeps on these contacts).
// Deviations: substeps advance scratch poses. end() then moves the body by their net displacement, and only as far as
//             that motion is proved clear of an offset surface. After each impact the next lower offset surface is
//             used, so that a body stopped just above one surface starts the next piece clear of it.
#include "world/solver/ground_gate.h"

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
constexpr std::uint64_t kMaxImpacts = 8;  // of an interval
constexpr int kMaxPieces = 64;            // of an interval
constexpr int kMaxIntervals = 32;         // of a lone step
/// Rotation after which contacts are found anew, radians: the solver treats the paths of points as straight.
constexpr double kContactTurn = 0.1;
/// Impacts are solved for at least this share of the interval.
constexpr double kLeastSolveShare = 0.01;
/// Largest rotation of a piece of motion, radians.
constexpr double kMaxTurn = 0.5;
/// Speed of recovery of bodies that are too deep, m/s. Recovery leaves them at rest.
constexpr double kRecoverySpeed = 2.0;
/// If a separation achieves less than this share of its displacement, separate() tries its next mode.
constexpr double kUsefulShare = 0.1;
/// Velocity factor for a body with more impacts in an interval than are simulated.
constexpr double kExcessImpactDamping = 0.5;

constexpr std::array<std::uint32_t, 1> kOnlyBody{0};
// A box on four corners converges by about a third per iteration. The targets of a body that rolls on two points may be
// infeasible for a rigid body; then `patience` stops the solver.
constexpr StoppingRule kStoppingRule{.iterations = 100, .tolerance = 1e-12, .patience = 8};

constexpr MoveAnswer kNotResident{.resident = false, .hit = false, .fraction = 0.0};
constexpr MoveAnswer kStopped{.resident = true, .hit = true, .fraction = 0.0};

bool turns_matter(const RigidBody& body) { return !std::holds_alternative<Sphere>(*body.shape); }

/// Upper bound of the distance that a displacement moves a point of a body, metres.
double reach_of(const RigidBody& body, const Twist& displacement) {
    return length(displacement.linear) + body.radius * length(displacement.angular);
}

/// Search distance beyond the contact margin for the contacts of a collision step, metres: the distance that the body
/// may move, limited to its smallest half extent and to the spacing of the ground.
double contact_reach(const RigidBody& body, const Ground& ground, const StepSpan& span) {
    const double most = std::min(body.thickness, ground.spacing());
    const double fall = length(body.acceleration) * span.duration * span.duration;
    return std::min(most, greatest_speed(body) * span.duration + fall);
}

/// Conservative swept test: true only if the box around the bounding sphere's sweep is above all ground below it, so
/// that the body stays clear whatever its rotation.
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

/// Penetration of a body's deepest part.
struct Depth {
    bool resident = true;
    double depth = 0.0;                                 // metres, >= 0
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // escape direction
};

Depth compute_depth(const RigidBody& body, const Ground& ground) {
    Depth deepest;
    const DistanceAnswer answer = signed_distance(*body.shape, body.pose, ground, 0.0);
    deepest.resident = answer.status != QueryStatus::not_resident;
    if (!answer.has_ground || !(answer.distance < 0.0)) return deepest;
    deepest.depth = -answer.distance;
    deepest.normal = answer.normal;
    return deepest;
}

/// Recovers a body that penetrates all offset surfaces: moves it only along its escape translation, at bounded speed.
/// The remaining translation bounds the depth, so the depth decreases by the distance moved; only a shorter translation
/// replaces it.
GateAnswer recover(RigidBody& body, const Ground& ground, double duration) {
    GateAnswer answer{.touches = true, .simulated_time = duration};
    body.velocity = {};
    const Depth now = compute_depth(body, ground);
    if (!now.resident) {
        answer.resident = false;
        return answer;
    }
    double left = length(body.escape_translation);
    if (left == 0.0 || now.depth < left) {
        body.escape_translation = now.depth * now.normal;
        left = now.depth;
    }
    const double share = left > 0.0 ? std::min(1.0, kRecoverySpeed * duration / left) : 0.0;
    body.pose.translation += share * body.escape_translation;
    body.escape_translation *= 1.0 - share;
    return answer;
}

/// Solver for the ground contacts of one body.
class GroundSolver {
public:
    GroundSolver(const RigidBody& body, const GroundContactCache& contacts)
        : solver_(bodies_, room_) {
        bodies_[0].set(body.mass, body.pose, {});
        for (std::size_t i = 0; i < contacts.count(); ++i) {
            SolverContact contact = contacts.contact(i, body, 0);
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

}  // namespace

void GroundGate::undo_step() {
    contacts_.undo_step();
    forget_proof();
}

void GroundGate::reset() {
    contacts_.reset();
    forget_proof();
}

void GroundGate::begin(RigidBody& body, const Ground& ground, const Ground* ground_before,
                       const StepSpan& span) {
    start_ = body.pose;
    const Eigen::Vector3d reach =
        body.velocity.linear * span.duration + body.acceleration * (span.duration * span.duration);
    // A body with contacts is near the ground, where the test would fail.
    if (!contacts_.has_contacts() && is_swept_sphere_clear(body, ground, reach)) {
        contacts_.set_out_of_reach();
    } else {
        const double travel =
            length(reach) + body.radius * length(body.velocity.angular) * span.duration;
        const bool is_clear = is_proved_clear(body, ground, ground_before);
        forget_proof();
        contacts_.refresh(
            body, ground,
            {.reach = contact_reach(body, ground, span), .travel = travel, .is_clear = is_clear});
        if (!contacts_.is_resident()) {
            state_ = State::not_resident;
            return;
        }
    }
    state_ = choose_surface(body) ? State::open : State::too_deep;
}

/// Whether the end of the previous collision step proved the body, at exactly this pose and over the same chunks, clear
/// of the first offset surface.
bool GroundGate::is_proved_clear(const RigidBody& body, const Ground& ground,
                                 const Ground* ground_before) const {
    return clear_pose_ && ground_before != nullptr && clear_pose_->rotation == body.pose.rotation &&
           clear_pose_->translation == body.pose.translation &&
           ground.has_same_cells(*ground_before, cells_around(body, ground, 0.0));
}

/// Chooses the highest offset surface that the body does not penetrate. False if it penetrates all of them.
bool GroundGate::choose_surface(RigidBody& body) {
    const std::optional<OffsetSurface> surface = contacts_.highest_clear_surface(body);
    if (body.is_fresh || surface) body.started_deep = !surface;
    body.is_fresh = false;
    if (!surface) return false;
    body.escape_translation.setZero();
    surface_ = *surface;
    return true;
}

GateAnswer GroundGate::end(RigidBody& body, const Ground& ground, const StepSpan& span) {
    if (state_ == State::not_resident) return {.resident = false};
    const Pose end = body.pose;
    if (state_ == State::too_deep) {
        body.pose = start_;
        return recover(body, ground, span.duration);
    }
    GateAnswer answer{.touches = contacts_.is_near(body), .simulated_time = span.duration};
    Twist displacement{end.translation - start_.translation, Eigen::Vector3d::Zero()};
    if (!(end.rotation == start_.rotation)) {
        displacement.angular = rotation_vector_between(start_.rotation, end.rotation);
    }
    body.pose = start_;
    // Other bodies may have pushed the body out of the space that begin() tested.
    if (contacts_.is_out_of_reach() && !is_swept_sphere_clear(body, ground, displacement.linear)) {
        surface_.clear_distance = 0.0;
    }
    const MoveAnswer moved = advance(body, ground, displacement, HitSearch::stop_at_proved);
    if (!moved.resident) {
        answer.resident = false;
        return answer;
    }
    if (!moved.hit) {
        if (surface_.index == 0 && !surface_.is_mesh) clear_pose_ = body.pose;
        return answer;
    }
    const double left = (1.0 - moved.fraction) * span.duration;
    answer.simulated_time = span.duration - left;
    ++answer.impacts;
    answer.touches = true;
    conserve_momentum(body, end.rotation);
    contacts_.invalidate();
    if (!(left > 0.0)) return answer;
    const double pieces = std::ceil(left / span.substep());
    for (double piece = 0.0; piece < pieces && answer.resident; piece += 1.0) {
        answer.add(step_alone(body, ground, left / pieces));
    }
    if (!answer.resident) return answer;
    // The velocity includes the work of gravity on the way to `end`, which was not reached.
    compensate_height_gain(body, end.translation);
    // A body that fell off the world must not move back under the ground. The side of the ground has no surface to
    // collide with, so the horizontal velocity is removed and the body continues to fall.
    if (answer.lost_time > 0.0 && is_outside(ground, body.pose.translation)) {
        body.velocity.linear.x() = 0.0;
        body.velocity.linear.y() = 0.0;
    }
    return answer;
}

/// Advances a body by `duration` seconds, without other bodies. Its velocity already includes the acceleration.
GateAnswer GroundGate::step_alone(RigidBody& body, const Ground& ground, double duration) {
    GateAnswer total;
    const Eigen::Vector3d velocity_before = body.velocity.linear;
    double remaining = duration;
    for (int count = 0; remaining > 0.0; ++count) {
        if (count == kMaxIntervals) {
            total.lost_time += remaining;
            break;
        }
        const Interval interval = step_interval(body, ground, remaining);
        total.add(interval.answer);
        if (!total.resident) break;
        remaining = interval.is_last
                        ? 0.0
                        : remaining - interval.answer.simulated_time - interval.answer.lost_time;
    }
    total.impulse = (body.velocity.linear - velocity_before) / body.mass.inverse_mass;
    return total;
}

/// Finds and solves the ground contacts, and advances the body by `duration`, or less if it has rotated so far that its
/// contacts must be found anew.
GroundGate::Interval GroundGate::step_interval(RigidBody& body, const Ground& ground,
                                               double duration) {
    if (is_swept_sphere_clear(body, ground, duration * body.velocity.linear)) {
        contacts_.set_out_of_reach();
    } else {
        contacts_.update(body, ground, duration * greatest_speed(body));
    }
    if (!contacts_.is_resident()) return {.answer = {.resident = false}};

    if (!choose_surface(body)) {
        return {.answer = recover(body, ground, duration), .is_last = true};
    }
    Interval interval{.answer = {.touches = contacts_.has_contacts()}, .is_last = true};
    GateAnswer& answer = interval.answer;
    const auto rate = [&] { return turns_matter(body) ? length(body.velocity.angular) : 0.0; };
    double remaining = duration;
    if (answer.touches) {
        const double turn = rate() * remaining;
        interval.is_last = turn <= kContactTurn;
        if (!interval.is_last) remaining *= kContactTurn / turn;
        solve(body, remaining);
        if (!separate(body, ground, remaining)) return {.answer = {.resident = false}};
    }

    for (int piece_count = 0; remaining > 0.0; ++piece_count) {
        if (piece_count == kMaxPieces || answer.impacts > kMaxImpacts) {
            // Impacts that are not simulated must also dissipate energy, or a body spinning in a crack would never come
            // to rest.
            if (answer.impacts > kMaxImpacts) {
                body.velocity.linear *= kExcessImpactDamping;
                body.velocity.angular *= kExcessImpactDamping;
            }
            answer.lost_time = remaining;
            return interval;
        }
        const double turn = rate() * remaining;
        const double share = turn > kMaxTurn ? kMaxTurn / turn : 1.0;
        const MoveAnswer moved = move_freely(body, ground, share * remaining, !answer.touches);
        if (!moved.resident) return {.answer = {.resident = false}};
        const double advanced = moved.fraction * share * remaining;
        answer.simulated_time += advanced;
        remaining = moved.fraction * share < 1.0 ? remaining - advanced : 0.0;
        if (!moved.hit) continue;

        ++answer.impacts;
        answer.touches = true;
        contacts_.refresh(body, ground, {.offset_index = surface_.index});
        if (!contacts_.is_resident()) return {.answer = {.resident = false}};
        solve(body, std::max(remaining, kLeastSolveShare * duration));
        surface_ = contacts_.surface(body, std::min(surface_.index + 1, kOffsetCount - 1));
        if (advanced > 0.0 && rate() * remaining > kContactTurn) {
            interval.is_last = false;
            return interval;
        }
    }
    return interval;
}

/// Solves the contacts, without warm starting, because the velocity may include the impulses of an earlier solve.
void GroundGate::solve(RigidBody& body, double duration) const {
    if (!contacts_.has_contacts()) return;
    GroundSolver solver(body, contacts_);
    solver.velocity() = body.velocity;
    (*solver).solve_velocity(kOnlyBody, least_bounce_speed(length(body.acceleration), duration),
                             duration, kStoppingRule);
    body.velocity = solver.velocity();
}

/// Opens contacts below the separation gap, at bounded speed. False if ground needed for the result is not resident.
bool GroundGate::separate(RigidBody& body, const Ground& ground, double duration) {
    const double target_gap = kSeparationGap * body.tolerance;
    if (contacts_.least_gap(0.0, target_gap) >= target_gap) return true;
    const double distance = kSeparationSpeed * duration;
    const WorldPos before = body.pose.translation;
    enum class Mode { rigid, translation, vertical };
    // A rotation may move another corner into the ground, and an unconverged translation may hit the opposite wall of a
    // crack. The vertical translation is always clear.
    for (const Mode mode : {Mode::rigid, Mode::translation, Mode::vertical}) {
        Twist displacement;
        if (mode == Mode::vertical) {
            displacement.linear.z() =
                std::min(distance, std::max(0.0, contacts_.lift()) + target_gap);
        } else {
            GroundSolver solver(body, contacts_);
            (*solver).solve_separation(distance, mode == Mode::rigid);
            displacement = clamp_displacement(solver.velocity(), body.radius, 2.0 * distance);
        }
        if (displacement.linear.isZero(0.0) && displacement.angular.isZero(0.0)) return true;
        const MoveAnswer moved = advance(body, ground, displacement);
        if (!moved.resident) return false;
        if (moved.fraction >= kUsefulShare) break;
    }
    compensate_height_gain(body, before);
    return true;
}

/// Integrates the motion like integrate(), but lets the offset surface stop it.
MoveAnswer GroundGate::move_freely(RigidBody& body, const Ground& ground, double duration,
                                   bool is_flying) {
    const Eigen::Matrix3d rotation = body.pose.rotation;
    const Twist displacement{body.velocity.linear * duration,
                             rotation_in(body, duration, is_flying)};
    const MoveAnswer answer = advance(body, ground, displacement);
    if (answer.fraction > 0.0) conserve_momentum(body, rotation);
    return answer;
}

MoveAnswer GroundGate::move(RigidBody& body, const Ground& ground, const Twist& displacement) {
    contacts_.update(body, ground, reach_of(body, displacement));
    if (!contacts_.is_resident()) return kNotResident;
    const std::optional<OffsetSurface> surface = contacts_.highest_clear_surface(body);
    if (!surface) return kStopped;
    surface_ = *surface;
    return advance(body, ground, displacement);
}

namespace {

/// Skips leading pieces of a motion that the swept test proves clear, usually most of it, and casts the remainder.
/// @param casts_rest if false, the hit is assumed at the end of the proved pieces, unless nothing is proved
CastAnswer find_hit(const Shape& shape, const Motion& motion, const Ground& ground,
                    double tolerance, bool casts_rest) {
    const auto piece = [&](double from, double share) -> Motion {
        return {motion.at(from), share * motion.translation, share * motion.rotation_vector};
    };
    double clear = 0.0;
    for (double share = 1.0; share >= kLeastProved && clear < 1.0; share *= 0.5) {
        if (is_sweep_clear(shape, piece(clear, share), ground, tolerance)) clear += share;
    }
    CastAnswer answer;
    answer.status = QueryStatus::ok;
    if (clear == 1.0) return answer;
    if (clear > 0.0 && !casts_rest) {
        answer.hit = true;
        answer.fraction = clear;
        return answer;
    }
    answer = columns::cast(shape, piece(clear, 1.0 - clear), ground,
                           {.tolerance = tolerance, .skip_separating = true});
    answer.fraction = clear + answer.fraction * (1.0 - clear);
    return answer;
}

}  // namespace

/// Moves a body by a displacement, or until its gap to the offset surface is the stop gap. Most displacements are
/// proved clear; the others are cast. Apart from the recovery of bodies placed too deep, this is the only function that
/// changes the final pose of a stepped body.
MoveAnswer GroundGate::advance(RigidBody& body, const Ground& ground, const Twist& displacement,
                               HitSearch hits) {
    const Motion motion{body.pose, displacement.linear, displacement.angular};
    const Pose end = motion.at(1.0);
    MoveAnswer answer;
    const double reach = reach_of(body, displacement);
    if (reach <= surface_.clear_distance) {
        surface_.clear_distance -= reach;
        body.pose = end;
        return answer;
    }
    surface_.clear_distance = 0.0;
    if (surface_.is_mesh || may_meet_volume(ground, body.pose.translation,
                                            body.radius + body.tolerance, displacement.linear)) {
        return advance_on_mesh(body, ground, motion, end);
    }
    Motion path{raised(body.pose, offset_depth(body, surface_.index)),
                end.translation - body.pose.translation, Eigen::Vector3d::Zero()};
    if (turns_matter(body)) path.rotation_vector = displacement.angular;
    const CastAnswer hit =
        find_hit(*body.shape, path, ground, surface_.stop_gap, hits == HitSearch::cast_rest);
    if (hit.status == QueryStatus::not_resident || hit.status == QueryStatus::invalid) {
        return kNotResident;
    }
    answer.hit = hit.hit;
    if (hit.hit) answer.fraction = std::min(answer.fraction, hit.fraction);
    if (answer.fraction > 0.0) {
        body.pose = answer.fraction < 1.0 ? motion.at(answer.fraction) : end;
    }
    return answer;
}

/// Does the work of advance() near volumes: casts the shrunk body against all triangles.
MoveAnswer GroundGate::advance_on_mesh(RigidBody& body, const Ground& ground, const Motion& motion,
                                       const Pose& end) {
    if (!surface_.is_mesh) {
        // The contacts were found against the heightfield alone, when the body was farther from the volumes.
        const MeshOffset first = find_mesh_offset(body, ground, surface_.index);
        if (first.is_missing) return kNotResident;
        if (first.index == kOffsetCount) return kStopped;
        surface_ = {first.index, true, first.stop_gap(body.tolerance), 0.0};
    }
    Motion path{body.pose, end.translation - body.pose.translation, Eigen::Vector3d::Zero()};
    if (turns_matter(body)) path.rotation_vector = motion.rotation_vector;
    const MeshSweepAnswer met = sweep_mesh(*body.shape, path, ground,
                                           offset_depth(body, surface_.index), surface_.stop_gap);
    if (met.is_missing) return kNotResident;
    const MoveAnswer answer{
        .resident = true, .hit = met.hit, .fraction = met.hit ? met.fraction : 1.0};
    if (answer.fraction > 0.0) body.pose = answer.fraction < 1.0 ? motion.at(answer.fraction) : end;
    return answer;
}

CastAnswer cast_wheel(const Shape& shape, const Motion& motion, const Ground& ground,
                      double tolerance) {
    if (may_meet_volume(ground, motion.start.translation, bounding_radius(shape),
                        motion.translation)) {
        const MeshSweepAnswer met =
            sweep_mesh(shape, motion, ground, kFirstOffset * tolerance, kStopGap * tolerance);
        CastAnswer answer;
        answer.status = met.is_missing ? QueryStatus::not_resident : QueryStatus::ok;
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

double greatest_lift(const RigidBody& body, const Ground& ground) {
    if (may_meet_volume(ground, body.pose.translation, body.radius)) {
        return measure_mesh_depth(*body.shape, body.pose, ground).depth;
    }
    const LocalGround local(ground, body.pose.translation);
    const LocalBody there(*body.shape, body.pose.rotation, local.to_local(body.pose.translation));
    return std::max(0.0, find_lift(local, there, Eigen::Vector3d::Zero(), 0.0).lift);
}

double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least) {
    if (lift <= at_least) return at_least;
    if (may_meet_volume(ground, body.pose.translation, body.radius))
        return lift;  // near volumes the lift is the depth
    return std::max(at_least, compute_depth(body, ground).depth);
}

bool is_outside(const Ground& ground, const WorldPos& point) {
    return !ground.extent().contains(point.x(), point.y()) ||
           ground.cell(ground.column_at(point.x()), ground.row_at(point.y())).status ==
               QueryStatus::outside;
}

}  // namespace terrane::internal
