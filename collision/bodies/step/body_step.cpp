// SPDX-License-Identifier: MIT
//
// Sources:    Mirtich. Timewarp and impulse-based simulation of rigid bodies. PhD thesis 1996, chapters
//             2 and 3 (conservative advancement, impacts one after the other).
// Deviations: the gate is lowered a little further after each impact of a substep, so that a body that
//             was stopped a hair above one gate starts the next piece clear of it.
#include "bodies/step/body_step.h"

#include "bodies/step/body_depth.h"
#include "bodies/step/offset_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr int kMaxImpacts = 8;     // of a stretch
constexpr int kMaxPieces = 64;     // of a stretch
constexpr int kMaxStretches = 32;  // of a substep
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
/// What parts a body from the ground and gets less far than this share of its way is followed by another try.
constexpr double kUsefulShare = 0.1;
/// What a body keeps of its velocity when it met more impacts in a stretch than are followed.
constexpr double kUnfollowedSlowing = 0.5;

constexpr std::array<std::uint32_t, 1> kAlone{0};
// A box on four corners converges by about a third an iteration. What rolls on two points may be asked to open at
// both by more than a rigid body can: then nothing converges, and patience ends it.
constexpr SolverEffort kEffort{.iterations = 100, .tolerance = 1e-12, .patience = 8};

bool turns_matter(const RigidBody& body) {
    return body.parts.size() > 1 || !std::holds_alternative<Sphere>(body.parts[0].shape);
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
MoveAnswer move_piece(RigidBody& body, const Ground& ground, double duration, Gate& gate,
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
    const MoveAnswer answer = advance(body, ground, way, gate);
    if (answer.fraction > 0.0) {
        Eigen::Vector3d& spin_after = body.velocity.angular;
        spin_after = spin_at(body, body.pose.rotation, momentum);
        const double energy_after = spin_energy(body, body.pose.rotation, spin_after);
        if (energy_after > energy) spin_after *= std::sqrt(energy / energy_after);
    }
    return answer;
}

/// The solver of one body's contacts with the ground.
class GroundSolver {
public:
    /// @param is_guessed starts from the impulses of the substep before
    GroundSolver(const RigidBody& body, const GroundLook& look, bool is_guessed)
        : solver_(bodies_, room_) {
        bodies_[0].mass = body.mass;
        bodies_[0].pose = body.pose;
        for (std::size_t i = 0; i < look.count(); ++i) {
            SolverContact contact = look.contact(i, body, 0);
            if (!is_guessed) contact.guess.setZero();
            solver_.add(contact);
        }
    }
    ContactSolver& operator*() { return solver_; }
    Twist& velocity() { return bodies_[0].velocity; }

private:
    std::array<SolverBody, 1> bodies_;
    std::array<ContactRows, GroundLook::kMaxCount> room_;
    ContactSolver solver_;
};

/// @param is_first of a body alone in a substep: solved from the impulses of the substep before, which it becomes for
///                 the next one. Else what was solved before is in the velocity.
void solve(RigidBody& body, GroundLook& look, double gravity, double duration, bool is_first) {
    if (!look.has_contacts()) return;
    // What carried a body on other contacts would pass to new ones in many small shares.
    GroundSolver solver(body, look, is_first && look.has_same_contacts());
    solver.velocity() = body.velocity;
    (*solver).solve_velocity(kAlone, bounce_speed(gravity, duration), duration, kEffort);
    body.velocity = solver.velocity();
    if (!is_first) return;
    for (std::size_t i = 0; i < look.count(); ++i) look.set_impulse(i, (*solver).impulse(i));
}

/// A displacement that moves no point by more than `most`.
Twist shortened(Twist way, double radius, double most) {
    const double reach = length(way.linear) + radius * length(way.angular);
    if (reach > most) {
        way.linear *= most / reach;
        way.angular *= most / reach;
    }
    return way;
}

/// What separating lifted is paid for with velocity, as far as there is any: contacts give no energy.
void pay_for_lift(RigidBody& body, double gravity, double height_before) {
    const double lifted = body.pose.translation.z() - height_before;
    if (!(lifted > 0.0)) return;
    const double energy = kinetic_energy(body.mass, body.pose, body.velocity);
    const double left = energy - gravity * lifted / body.mass.inverse_mass;
    const double scale = left > 0.0 ? std::sqrt(left / energy) : 0.0;
    body.velocity.linear *= scale;
    body.velocity.angular *= scale;
}

enum class Parting { turning, sliding, lifting };

/// Opens contacts that are closer than bodies rest, at bounded speed.
bool separate(RigidBody& body, const Ground& ground, const GroundLook& look, Gate& gate,
              double gravity, double duration) {
    const double wanted_gap = kSeparationGap * body.tolerance;
    if (look.least_gap(0.0, wanted_gap) >= wanted_gap) return true;
    const double distance = kSeparationSpeed * duration;
    const double height = body.pose.translation.z();
    // A turn may bring another corner in, and a translation that the solver is not done with meets the other wall of
    // what the body is wedged in. Straight up nothing is met.
    for (const Parting parting : {Parting::turning, Parting::sliding, Parting::lifting}) {
        Twist way;
        if (parting == Parting::lifting) {
            way.linear.z() = std::min(distance, std::max(0.0, look.lift()) + wanted_gap);
        } else {
            GroundSolver solver(body, look, false);
            (*solver).solve_separation(distance, parting == Parting::turning);
            way = shortened(solver.velocity(), body.radius, 2.0 * distance);
        }
        if (way.linear.isZero(0.0) && way.angular.isZero(0.0)) return true;
        const MoveAnswer moved = advance(body, ground, way, gate);
        if (!moved.resident) return false;
        if (moved.fraction >= kUsefulShare) break;
    }
    pay_for_lift(body, gravity, height);
    return true;
}

/// A body that was put deeper than any gate: it comes out along the shortest way known at bounded speed,
/// and has no other motion until then. What is left of a way out bounds the depth, so the depth falls by
/// what is moved; a new way is taken only where it is shorter than what is left of the old one.
bool recover(RigidBody& body, const Ground& ground, double duration) {
    body.velocity = {};
    const Depth now = compute_depth(body, ground);
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
    double simulated_time = 0.0;
    double lost_time = 0.0;
};

/// Looks at the ground, solves what touches it, and moves on. Ends after `duration`; or earlier, where a
/// body that touches has turned so far that its contacts have to be looked at again.
Stretch live_stretch(RigidBody& body, GroundLook& look, const Ground& ground, double gravity,
                     double duration, bool is_first) {
    if (flies_high(body, ground, duration)) {
        look.see_nothing();
    } else {
        look.update(body, ground);
    }
    if (!look.is_resident()) return {.resident = false};

    const int first_gate = find_gate(body, look);
    const bool is_deep = first_gate == kGateCount;
    if (body.is_fresh) body.started_deep = is_deep;
    body.is_fresh = false;
    Stretch stretch;
    stretch.is_last = true;
    stretch.touches = is_deep || look.has_contacts();
    if (is_deep) {
        stretch.resident = recover(body, ground, duration);
        stretch.simulated_time = duration;
        return stretch;
    }
    body.started_deep = false;
    body.way_out.setZero();
    Gate gate = make_gate(body, look, 0, first_gate);

    const auto rate = [&] { return turns_matter(body) ? length(body.velocity.angular) : 0.0; };
    double remaining = duration;
    if (stretch.touches) {
        const double turn = rate() * remaining;
        stretch.is_last = turn <= kContactTurn;
        if (!stretch.is_last) remaining *= kContactTurn / turn;
        solve(body, look, gravity, remaining, is_first);
        if (!separate(body, ground, look, gate, gravity, remaining)) return {.resident = false};
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
        const double max_turn = body.parts.size() > 1 ? kMaxTurnOfParts : kMaxTurn;
        const double turn = rate() * remaining;
        const double share = turn > max_turn ? max_turn / turn : 1.0;
        const MoveAnswer moved =
            move_piece(body, ground, share * remaining, gate, !stretch.touches);
        if (!moved.resident) return {.resident = false};
        const double lived = moved.fraction * share * remaining;
        stretch.simulated_time += lived;
        remaining = moved.fraction * share < 1.0 ? remaining - lived : 0.0;
        if (!moved.hit) continue;

        ++stretch.impacts;
        stretch.touches = true;
        look.look(body, ground, gate.index);
        if (!look.is_resident()) return {.resident = false};
        solve(body, look, gravity, std::max(remaining, kLeastSolveShare * duration), false);
        gate = make_gate(body, look, gate.index, std::min(gate.index + 1, kGateCount - 1));
        if (lived > 0.0 && rate() * remaining > kContactTurn) {
            stretch.is_last = false;
            return stretch;
        }
    }
    return stretch;
}

}  // namespace

double count_substeps(double dt, double max_substep) {
    constexpr double kSlack = 1e-9;  // so that 2.0000001 is 2
    return std::max(1.0, std::ceil(dt / max_substep - kSlack));
}

double bounce_speed(double gravity, double duration) {
    return std::max(0.1, 4.0 * gravity * duration);
}

SubstepAnswer step_body(RigidBody& body, GroundLook& look, const Ground& ground, double gravity,
                        double duration, bool is_alone) {
    SubstepAnswer total;
    double remaining = duration;
    for (int count = 0; remaining > 0.0; ++count) {
        if (count == kMaxStretches) {
            total.lost_time += remaining;
            break;
        }
        const bool is_first = is_alone && count == 0;
        const Stretch stretch = live_stretch(body, look, ground, gravity, remaining, is_first);
        total.resident = stretch.resident;
        if (!stretch.resident) break;
        total.touches = stretch.touches;
        total.impacts += static_cast<std::uint64_t>(stretch.impacts);
        total.simulated_time += stretch.simulated_time;
        total.lost_time += stretch.lost_time;
        remaining = stretch.is_last ? 0.0 : remaining - stretch.simulated_time - stretch.lost_time;
    }
    return total;
}

bool push_body(RigidBody& body, GroundLook& look, const Ground& ground, const Twist& way,
               double gravity, double duration) {
    const double height = body.pose.translation.z();
    const Twist bounded = shortened(way, body.radius, kSeparationSpeed * duration);
    if (!move_body(body, look, ground, bounded).resident) return false;
    pay_for_lift(body, gravity, height);
    return true;
}

}  // namespace terrane::internal
