// SPDX-License-Identifier: MIT
//
// Sources:    Mirtich. Timewarp and impulse-based simulation of rigid bodies. PhD thesis 1996, chapters
//             2 and 3 (conservative advancement, impacts one after the other).
//             Ericson. Real-Time Collision Detection. 2005, section 9.5 (lowering instead of inflating).
// Deviations: the gate is lowered a little further after each impact of a substep, so that a body that
//             was stopped a hair above one gate starts the next piece clear of it. Lowering the surface
//             by L equals raising the shape by L, which is how the cast is asked; and a body that does
//             not meet the surface lowered by L is freed by moving up by L, so its depth is at most L.
#include "body_step.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr int kMaxImpacts = 8;     // of a stretch
constexpr int kMaxPieces = 64;     // of a stretch
constexpr int kMaxStretches = 32;  // of a substep
/// How far gates are lowered, in tolerances: from half of it, in ever smaller steps, almost to all of it. There
/// is a next gate for every body that was stopped at one, so that nothing that moves away is ever held.
constexpr double kFirstGate = 0.5;
constexpr double kGateRatio = 0.85;
constexpr int kGateCount = 48;
constexpr std::array<double, kGateCount> make_gate_heights() {
    std::array<double, kGateCount> heights{};
    double left = 1.0 - kFirstGate;
    for (double& height : heights) {
        height = 1.0 - left;
        left *= kGateRatio;
    }
    return heights;
}
constexpr std::array<double, kGateCount> kGateHeights = make_gate_heights();
/// Where the cast stops above its gate at most, in tolerances. Far below a gate's step, so that a stopped
/// body is clear of the next gate on slopes up to 86 degrees.
constexpr double kStopGap = 1.0 / 256.0;
/// The same at least, metres, little more than rounding: a body that is closer than kStopGap may move away.
constexpr double kLeastStopGap = 1e-11;
/// Where bodies rest above the first gate, in tolerances: above every stop, so that sliding is free.
constexpr double kRestGap = 1.0 / 4.0;
/// Contacts are looked for this far above the gate, in tolerances.
constexpr double kContactMargin = 1.0 / 2.0;
/// A body that touches is looked at again when it has turned by this, radians: contacts are solved for
/// points that move straight.
constexpr double kContactTurn = 0.1;
/// Impacts are solved for at least this share of the time that the body was to move for.
constexpr double kLeastSolveShare = 0.01;
/// A piece of motion turns by at most this, radians.
constexpr double kMaxTurn = 0.5;
/// The same for bodies with parts off their origin, whose paths are cast as straight lines: at 3 m from
/// the centre the arc is within 0.4 mm of its chord.
constexpr double kMaxTurnOfParts = 0.03;
/// Bodies come out of the ground at this speed, and no velocity of it stays, m/s.
constexpr double kRecoverySpeed = 2.0;
constexpr double kSeparationSpeed = 0.5;
/// What a body keeps of its velocity when it met more impacts in a stretch than are followed.
constexpr double kUnfollowedSlowing = 0.5;

double lowering(const RigidBody& body, int gate) {
    return body.tolerance * kGateHeights[static_cast<std::size_t>(gate)];
}

Pose part_pose(const BodyPart& part, const Pose& pose) {
    return {pose.rotation, pose.translation + rotated(pose.rotation, part.offset_body)};
}

Pose raised(Pose pose, double height) {
    pose.translation.z() += height;
    return pose;
}

bool turns_matter(const RigidBody& body) {
    return body.part_count > 1 || !std::holds_alternative<Sphere>(body.parts[0].shape);
}

double rounding_of(const Shape& shape) {
    if (const auto* sphere = std::get_if<Sphere>(&shape)) return sphere->radius;
    if (const auto* capsule = std::get_if<Capsule>(&shape)) return capsule->radius;
    return 0.0;
}

/// The contacts of all parts against the surface lowered by a gate.
struct NearGround {
    bool resident = true;
    std::size_t count = 0;
    double lift = -1.0;  ///< largest of the parts
    std::array<Contact, kMaxSolverContacts> contacts;
    std::array<double, kMaxSolverContacts>
        roundings;  ///< radius that the part around a contact is swept by

    std::span<const Contact> found() const { return {contacts.data(), count}; }

    /// Smallest gap of the contacts if the surface were lower by `further`; `most` where all are wider.
    double least_gap(double further, double most) const {
        double least = most;
        for (const Contact& contact : found()) {
            least = std::min(least, contact.normal.z() * further - contact.depth);
        }
        return least;
    }
};

void look(const RigidBody& body, const Ground& ground, int gate, NearGround& near_out) {
    near_out.resident = true;
    near_out.count = 0;
    near_out.lift = -1.0;
    for (const BodyPart& part : body.active_parts()) {
        const std::size_t room = (near_out.contacts.size() - near_out.count);
        const ContactAnswer answer =
            find_contacts(part.shape, raised(part_pose(part, body.pose), lowering(body, gate)),
                          ground, kContactMargin * body.tolerance,
                          std::span<Contact>(near_out.contacts.data() + near_out.count, room));
        if (answer.status == ContactStatus::not_resident) {
            near_out.resident = false;
            return;
        }
        near_out.lift = std::max(near_out.lift, answer.lift);
        std::fill_n(near_out.roundings.begin() + static_cast<std::ptrdiff_t>(near_out.count),
                    answer.count, rounding_of(part.shape));
        near_out.count += answer.count;
    }
}

/// How low the surface is for a piece of motion, and how near to it the motion ends.
struct Gate {
    int index = 0;
    double stop_gap = 0.0;
};

/// A gate for a body that was looked at from the gate `from`.
Gate make_gate(const RigidBody& body, const NearGround& near, int from, int index) {
    const double further = lowering(body, index) - lowering(body, from);
    const double gap = near.least_gap(further, 2.0 * kStopGap * body.tolerance);
    return {index, std::max(kLeastStopGap, 0.5 * gap)};
}

/// The first gate that a body which was looked at from gate 0 is clear of; kGateCount where there is none.
/// The lift falls by exactly what the surface is lowered by, so one look is enough.
int find_gate(const RigidBody& body, const NearGround& near) {
    const double clear = kStopGap * body.tolerance;
    int gate = 0;
    for (; gate < kGateCount; ++gate) {
        const double further = lowering(body, gate) - lowering(body, 0);
        if (near.lift > further) continue;
        if (gate + 1 == kGateCount || near.least_gap(further, clear) >= clear) break;
        // Further gates are nearer to each other than this: the next one has to do.
        if (lowering(body, gate + 1) - lowering(body, gate) < 2.0 * clear) break;
    }
    return gate;
}

struct GateAnswer {
    bool resident = true;
    bool hit = false;
    double fraction = 1.0;
};

/// The gate: moves a body along a motion until it would come too close to the lowered surface. Nothing
/// else in this library changes the pose of a body that is stepped.
GateAnswer advance(RigidBody& body, const Ground& ground, const Twist& way, const Gate& gate) {
    const Motion motion{body.pose, way.linear, way.angular};
    const Pose end = motion.at(1.0);
    GateAnswer answer;
    for (const BodyPart& part : body.active_parts()) {
        Motion path;
        path.start = raised(part_pose(part, body.pose), lowering(body, gate.index));
        const bool is_sphere = std::holds_alternative<Sphere>(part.shape);
        path.translation =
            part_pose(part, end).translation - part_pose(part, body.pose).translation;
        if (!is_sphere) path.rotation_vector = way.angular;
        const CastAnswer hit =
            cast(part.shape, path, ground, {.tolerance = gate.stop_gap, .skip_separating = true});
        if (hit.status == ContactStatus::not_resident || hit.status == ContactStatus::invalid) {
            return {.resident = false, .hit = false, .fraction = 0.0};
        }
        if (!hit.hit) continue;
        answer.hit = true;
        answer.fraction = std::min(answer.fraction, hit.fraction);
    }
    if (answer.fraction > 0.0) {
        body.pose = answer.fraction < 1.0 ? motion.at(answer.fraction) : end;
        body.pose.rotation = orthonormalized(body.pose.rotation);
    }
    return answer;
}

bool spins_freely(const RigidBody& body) {
    const Eigen::Vector3d& inertia = body.mass.inertia;
    return inertia.x() == inertia.y() && inertia.y() == inertia.z();
}

/// The spin at another rotation with the angular momentum of now.
Eigen::Vector3d spin_at(const RigidBody& body, const Eigen::Matrix3d& rotation,
                        const Eigen::Vector3d& momentum) {
    return apply_tensor(rotation, body.mass.inverse_inertia, momentum);
}

double spin_energy(const RigidBody& body, const Eigen::Matrix3d& rotation,
                   const Eigen::Vector3d& spin) {
    return 0.5 * dot(spin, apply_tensor(rotation, body.mass.inertia, spin));
}

/// One piece of motion through the gate. The spin within it is constant: in flight that of its middle, at
/// contacts that of its start, which is the one that they were solved for. At its end the angular
/// momentum is what it was, and the energy no more.
GateAnswer move_piece(RigidBody& body, const Ground& ground, double duration, const Gate& gate,
                      bool is_flying) {
    const Eigen::Vector3d spin = body.velocity.angular;
    const bool constant = spins_freely(body) || dot(spin, spin) == 0.0;
    if (constant) {
        return advance(body, ground, {body.velocity.linear * duration, spin * duration}, gate);
    }
    const Eigen::Matrix3d rotation = body.pose.rotation;
    const Eigen::Vector3d momentum = apply_tensor(rotation, body.mass.inertia, spin);
    const double energy = spin_energy(body, rotation, spin);
    Twist way{body.velocity.linear * duration, spin * duration};
    if (is_flying) {
        const Motion half{body.pose, Eigen::Vector3d::Zero(), 0.5 * way.angular};
        way.angular = spin_at(body, half.at(1.0).rotation, momentum) * duration;
    }
    const GateAnswer answer = advance(body, ground, way, gate);
    if (answer.fraction > 0.0) {
        Eigen::Vector3d& spin_after = body.velocity.angular;
        spin_after = spin_at(body, body.pose.rotation, momentum);
        const double energy_after = spin_energy(body, body.pose.rotation, spin_after);
        if (energy_after > energy) spin_after *= std::sqrt(energy / energy_after);
    }
    return answer;
}

void solve(RigidBody& body, const NearGround& near, int gate, double gravity, double duration) {
    ContactSolver solver(body.mass, raised(body.pose, lowering(body, gate)));
    solver.add(near.found(), near.roundings);
    // What gravity gives in four substeps is rest, not a bounce.
    const ContactSolver::Surface surface{body.friction, body.restitution,
                                         std::max(0.1, 4.0 * gravity * duration)};
    solver.solve_velocity(body.velocity, surface, kRestGap * body.tolerance, duration);
}

/// Opens contacts that are closer than bodies rest, at bounded speed. What this lifts is paid for with
/// velocity, as far as there is any: contacts give no energy.
bool separate(RigidBody& body, const Ground& ground, const NearGround& near, const Gate& gate,
              double gravity, double duration) {
    const double wanted_gap = 0.75 * kRestGap * body.tolerance;
    if (near.least_gap(0.0, wanted_gap) >= wanted_gap) return true;
    const double distance = kSeparationSpeed * duration;
    const double height = body.pose.translation.z();
    // A turn may bring another corner in; a translation that opens all contacts brings none.
    for (const bool may_turn : {true, false}) {
        ContactSolver solver(body.mass, raised(body.pose, lowering(body, 0)));
        solver.add(near.found(), near.roundings);
        Twist way = solver.solve_separation(wanted_gap, distance, may_turn);
        const double reach = length(way.linear) + body.radius * length(way.angular);
        if (!(reach > 0.0)) return true;
        if (reach > 2.0 * distance) {
            way.linear *= 2.0 * distance / reach;
            way.angular *= 2.0 * distance / reach;
        }
        const GateAnswer moved = advance(body, ground, way, gate);
        if (!moved.resident) return false;
        if (moved.fraction > 0.0) break;
    }
    const double lifted = body.pose.translation.z() - height;
    if (lifted > 0.0) {
        const double energy = kinetic_energy(body.mass, body.pose, body.velocity);
        const double left = energy - gravity * lifted / body.mass.inverse_mass;
        const double scale = left > 0.0 ? std::sqrt(left / energy) : 0.0;
        body.velocity.linear *= scale;
        body.velocity.angular *= scale;
    }
    return true;
}

/// Depth of the whole body and the way out of its deepest part.
struct Depth {
    bool resident = true;
    double depth = 0.0;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

Depth compute_depth(const RigidBody& body, const Pose& pose, const Ground& ground) {
    Depth deepest_part;
    for (const BodyPart& part : body.active_parts()) {
        const DistanceAnswer answer =
            signed_distance(part.shape, part_pose(part, pose), ground, 0.0);
        if (answer.status == ContactStatus::not_resident) deepest_part.resident = false;
        if (!answer.has_ground || -answer.distance <= deepest_part.depth) continue;
        deepest_part.depth = -answer.distance;
        deepest_part.normal = answer.normal;
    }
    return deepest_part;
}

/// A body that was put deeper than any gate: it comes out along the shortest way known at bounded speed,
/// and has no other motion until then. What is left of a way out bounds the depth, so the depth falls by
/// what is moved; a new way is taken only where it is shorter than what is left of the old one.
bool recover(RigidBody& body, const Ground& ground, double duration) {
    body.velocity = {};
    const Depth now = compute_depth(body, body.pose, ground);
    if (!now.resident) return false;
    double left = length(body.way_out);
    if (left == 0.0 || now.depth < left) {
        body.way_out = now.depth * now.normal;
        left = now.depth;
    }
    const double share = left > 0.0 ? std::min(1.0, kRecoverySpeed * duration / left) : 0.0;
    body.pose.translation += share * body.way_out;
    body.way_out *= 1.0 - share;
    return true;
}

/// The part of a substep between two looks at the ground.
struct Stretch {
    bool resident = true;
    bool touches = false;
    bool is_last = false;  ///< nothing of the substep is left
    int impacts = 0;
    double lived_time = 0.0;
    double lost_time = 0.0;
};

/// Looks at the ground, solves what touches it, and moves on. Ends after `duration`; or earlier, where a
/// body that touches has turned so far that its contacts have to be looked at again.
Stretch live_stretch(RigidBody& body, const Ground& ground, double gravity, double duration) {
    NearGround near;
    look(body, ground, 0, near);
    if (!near.resident) return {.resident = false};

    const int first_gate = find_gate(body, near);
    const bool is_deep = first_gate == kGateCount;
    if (body.is_fresh) body.started_deep = is_deep;
    body.is_fresh = false;
    Stretch stretch;
    stretch.is_last = true;
    stretch.touches = is_deep || near.count > 0;
    if (is_deep) {
        stretch.resident = recover(body, ground, duration);
        stretch.lived_time = duration;
        return stretch;
    }
    body.started_deep = false;
    body.way_out.setZero();
    Gate gate = make_gate(body, near, 0, first_gate);

    const auto rate = [&] { return turns_matter(body) ? length(body.velocity.angular) : 0.0; };
    double remaining = duration;
    if (stretch.touches) {
        const double turn = rate() * remaining;
        stretch.is_last = turn <= kContactTurn;
        if (!stretch.is_last) remaining *= kContactTurn / turn;
        solve(body, near, 0, gravity, remaining);
        if (!separate(body, ground, near, gate, gravity, remaining)) return {.resident = false};
    }

    for (int piece_count = 0; remaining > 0.0; ++piece_count) {
        if (piece_count == kMaxPieces || stretch.impacts > kMaxImpacts) {
            // More blows than can be followed: they take energy, or a body that whirls in a crack never ends.
            if (stretch.impacts > kMaxImpacts) {
                body.velocity.linear *= kUnfollowedSlowing;
                body.velocity.angular *= kUnfollowedSlowing;
            }
            stretch.lost_time = remaining;
            return stretch;
        }
        const double max_turn = body.part_count > 1 ? kMaxTurnOfParts : kMaxTurn;
        const double turn = rate() * remaining;
        const double share = turn > max_turn ? max_turn / turn : 1.0;
        const GateAnswer moved =
            move_piece(body, ground, share * remaining, gate, !stretch.touches);
        if (!moved.resident) return {.resident = false};
        const double lived = moved.fraction * share * remaining;
        stretch.lived_time += lived;
        remaining = moved.fraction * share < 1.0 ? remaining - lived : 0.0;
        if (!moved.hit) continue;

        ++stretch.impacts;
        stretch.touches = true;
        look(body, ground, gate.index, near);
        if (!near.resident) return {.resident = false};
        solve(body, near, gate.index, gravity, std::max(remaining, kLeastSolveShare * duration));
        gate = make_gate(body, near, gate.index, std::min(gate.index + 1, kGateCount - 1));
        if (lived > 0.0 && rate() * remaining > kContactTurn) {
            stretch.is_last = false;
            return stretch;
        }
    }
    return stretch;
}

}  // namespace

SubstepAnswer step_body(RigidBody& body, const Ground& ground, double gravity, double duration) {
    SubstepAnswer total;
    double remaining = duration;
    for (int count = 0; remaining > 0.0; ++count) {
        if (count == kMaxStretches) {
            total.lost_time += remaining;
            break;
        }
        const Stretch stretch = live_stretch(body, ground, gravity, remaining);
        total.resident = stretch.resident;
        if (!stretch.resident) break;
        total.touches = stretch.touches;
        total.impacts += static_cast<std::uint64_t>(stretch.impacts);
        total.lived_time += stretch.lived_time;
        total.lost_time += stretch.lost_time;
        remaining = stretch.is_last ? 0.0 : remaining - stretch.lived_time - stretch.lost_time;
    }
    return total;
}

double contact_raise(double tolerance) { return kFirstGate * tolerance; }

CastAnswer cast_part(const Shape& shape, const Motion& motion, const Ground& ground,
                     double tolerance) {
    Motion path = motion;
    path.start = raised(motion.start, contact_raise(tolerance));
    return cast(shape, path, ground, {.tolerance = kStopGap * tolerance, .skip_separating = false});
}

double deepest(const RigidBody& body, const Ground& ground, double at_least) {
    double lift = 0.0;
    for (const BodyPart& part : body.active_parts()) {
        lift = std::max(lift, compute_lift(part.shape, part_pose(part, body.pose), ground).lift);
    }
    if (lift <= at_least) return at_least;
    return std::max(at_least, compute_depth(body, body.pose, ground).depth);
}

}  // namespace terrane::internal
