// SPDX-License-Identifier: MIT
//
// Sources: B. Mirtich. Impulse-based dynamic simulation of rigid body systems. 1996, 2.3 (conservative advancement).
//          X. Zhang, M. Lee, Y. Kim. Interactive continuous collision detection for non-convex polyhedra. The Visual
//          Computer 2006 (bounds along the normal).
// Deviations: the speeds of the points along the normal are exact at the start of a step, so that only their change is
//             bounded. The step is the largest one found for which this bound proves a gap.
#include "base/vector_math.h"
#include "pairs/compound_pairs.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// As a fraction of the motion: a shorter step near the other shape ends the advancement.
constexpr double kShortest = 1e-4;
constexpr int kMaxAdvances = 10'000;  // limit of steps of a cast

// One of the moving shapes; times are fractions of the motion.
struct Mover {
    Mover(const MovingPart& moving, const Eigen::Vector3d& origin)
        : shape(moving.shape),
          body_from_part(moving.body_from_part),
          motion(moving.motion),
          start(moving.motion.start.translation - origin),
          spin(length(moving.motion.rotation_vector)) {
        if (spin == 0.0) return;
        if (std::holds_alternative<Sphere>(shape) && body_from_part == nullptr) return;
        constexpr std::size_t kFew = 64;
        CoreStorage storage;
        const Core core = core_of(at(0.0), storage);
        const Eigen::Vector3d lever = core.centre - start;
        const Eigen::Vector3d axis = motion.rotation_vector / spin;
        if (core.shape.vertices.size() > kFew) {
            arm = core.reach + length(lever);
            return;
        }
        for (const Eigen::Vector3d& v : core.shape.vertices) {
            arm = std::max(arm, length(cross(axis, core.to_axes(v) + lever)));
        }
    }

    PlacedConvex at(double t) const {
        const Eigen::Matrix3d& first = motion.start.rotation;
        const Eigen::Matrix3d rotation = arm > 0.0 ? motion.at(t).rotation : first;
        const Eigen::Vector3d centre = origin_at(t);
        if (body_from_part == nullptr) return place(shape, rotation, centre);
        return place(shape, part_rotation(rotation, *body_from_part),
                     centre + rotated(rotation, body_from_part->translation));
    }
    /// Position of the body's origin.
    Eigen::Vector3d origin_at(double t) const { return start + t * motion.translation; }
    static Core core_of(const PlacedConvex& placed, CoreStorage& storage_out) {
        return std::visit([&](const auto& each) { return make_core(each, storage_out); }, placed);
    }

    const ConvexView& shape;
    const Pose* body_from_part;
    const Motion& motion;
    Eigen::Vector3d start;  ///< body's origin at time 0, relative to the common origin
    double spin = 0.0;      ///< angle of rotation over the motion, radians
    double arm = 0.0;       ///< largest distance of a core vertex from the rotation axis, metres
};

// Bounds the time for which a plane orthogonal to `normal` keeps separating two moving shapes.
class Step {
public:
    Step(const Mover& a, const Mover& b, double t, const PlacedConvex& at_a,
         const PlacedConvex& at_b, const Eigen::Vector3d& normal)
        : core_a_(Mover::core_of(at_a, of_a_)),
          core_b_(Mover::core_of(at_b, of_b_)),
          normal_(normal),
          turn_a_(cross(normal, a.motion.rotation_vector)),
          turn_b_(cross(normal, b.motion.rotation_vector)),
          speed_(dot(normal, a.motion.translation - b.motion.translation)),
          turning_(length(turn_a_) * a.arm + length(turn_b_) * b.arm),
          bend_(a.spin * a.spin * a.arm + b.spin * b.spin * b.arm) {
        offset_ = dot(normal, core_a_.centre - core_b_.centre) - core_a_.radius - core_b_.radius;
        lever_speed_ = dot(turn_a_, core_a_.centre - a.origin_at(t)) -
                       dot(turn_b_, core_b_.centre - b.origin_at(t));
    }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;

    /// Gap along the normal after a time, if every point keeps its velocity.
    double gap_after(double time) const {
        return offset_ + time * (speed_ + lever_speed_) -
               support(core_a_, -(normal_ + time * turn_a_)) -
               support(core_b_, normal_ + time * turn_b_);
    }

    /// A time, at most `remaining`, until which the distance plus `allowed_depth`, now `gap`, provably stays at least
    /// `rest`.
    double safe_time(double gap, double rest, double allowed_depth, double remaining) const {
        const double closing = turning_ - speed_;
        double time = closing > 0.0 ? (gap - rest) / closing : kInfinity;
        if (time >= remaining) return remaining;
        if (turning_ == 0.0) return time;
        // The bound is concave in time: if it holds at t, it holds before t.
        const auto holds = [&](double t) {
            return gap_after(t) + allowed_depth - 0.5 * bend_ * t * t >= rest;
        };
        double next = std::max(2.0 * time, std::sqrt(0.5 * (gap - rest) / bend_));
        double failed = kInfinity;
        while (next < remaining && holds(next)) {
            time = next;
            next *= 2.0;
        }
        if (next >= remaining) {
            if (holds(remaining)) return remaining;
            next = remaining;
        }
        failed = next;
        for (int i = 0; i < 3; ++i) {
            const double middle = 0.5 * (time + failed);
            (holds(middle) ? time : failed) = middle;
        }
        return time;
    }

private:
    static double support(const Core& core, const Eigen::Vector3d& direction) {
        const Eigen::Vector3d in_body = core.to_body(direction);
        return dot(in_body, core.shape.vertices[find_extreme(core.shape, in_body)]);
    }

    CoreStorage of_a_;
    CoreStorage of_b_;
    Core core_a_;
    Core core_b_;
    Eigen::Vector3d normal_;
    Eigen::Vector3d turn_a_;
    Eigen::Vector3d turn_b_;
    double speed_;              ///< of the bodies' origins, along the normal
    double lever_speed_ = 0.0;  ///< contribution of rotation at the shapes' own origins
    double turning_;            ///< upper bound of the contribution of rotation at any point
    double bend_;               ///< upper bound of the acceleration by rotation
    double offset_ = 0.0;
};

// Whether the shapes approach each other at any contact, by more than rounding.
bool is_closing(const Mover& a, const Mover& b, const PlacedConvex& at_a, const PlacedConvex& at_b,
                const Gap& gap, double t) {
    std::array<PairContact, 4> contacts;
    const std::size_t count = find_contacts(at_a, at_b, gap, std::max(0.0, gap.distance), contacts);
    const Eigen::Vector3d centre_a = a.origin_at(t);
    const Eigen::Vector3d centre_b = b.origin_at(t);
    const Eigen::Vector3d velocity = a.motion.translation - b.motion.translation;
    const double rounding = 1e-8 * (length(velocity) + a.spin * a.arm + b.spin * b.arm);
    for (const PairContact& contact : std::span(contacts.data(), count)) {
        const Eigen::Vector3d& on_a = contact.point_world;
        const Eigen::Vector3d on_b = on_a + contact.depth * contact.normal;
        const Eigen::Vector3d relative = velocity +
                                         cross(a.motion.rotation_vector, on_a - centre_a) -
                                         cross(b.motion.rotation_vector, on_b - centre_b);
        if (dot(contact.normal, relative) < -rounding) return true;
    }
    return false;
}

}  // namespace

ConvexCast cast_convex(const MovingPart& a, const MovingPart& b, double from, double to,
                       const CastSettings& settings) {
    const Eigen::Vector3d origin = a.motion.start.translation;
    const Mover mover_a(a, origin);
    const Mover mover_b(b, origin);
    const double touch = kTouchShare * (reach_of(a.shape) + reach_of(b.shape));
    const double tolerance = std::max(settings.tolerance, touch);  // the resolution of gaps

    ConvexCast answer;
    PlacedConvex at_a = mover_a.at(from);
    PlacedConvex at_b = mover_b.at(from);
    Gap gap = find_gap(at_a, at_b);
    answer.started_in_contact = gap.distance <= touch;
    // Depth allowed while contacts at the start are ignored (skip_separating); decreases as the shapes separate.
    double allowed_depth = 0.0;
    if (answer.started_in_contact) {
        answer.hit =
            !settings.skip_separating || is_closing(mover_a, mover_b, at_a, at_b, gap, from);
        answer.fraction = from;
        allowed_depth = 0.5 * tolerance - gap.distance;
    }
    double t = from;
    for (int advance = 0; !answer.hit; ++advance) {
        allowed_depth = std::max(0.0, std::min(allowed_depth, 0.5 * tolerance - gap.distance));
        const double room = gap.distance + allowed_depth;
        const double rest = std::min(0.125 * tolerance, 0.5 * room);
        const Step step(mover_a, mover_b, t, at_a, at_b, gap.normal);
        const double time = step.safe_time(room, rest, allowed_depth, to - t);
        if (!(time < to - t)) {
            answer.fraction = to;
            return answer;
        }
        // Ends with a hit at the last safe time: near the other shape, if the shapes approach or the step is too short;
        // anywhere, if the step is below the resolution of t or the steps are too many.
        const bool is_near = room <= 0.25 * tolerance;
        if ((is_near && (time < kShortest || is_closing(mover_a, mover_b, at_a, at_b, gap, t))) ||
            !(t + time > t) || advance == kMaxAdvances) {
            answer.hit = true;
            break;
        }
        t += time;
        at_a = mover_a.at(t);
        at_b = mover_b.at(t);
        gap = find_gap(at_a, at_b);
    }
    answer.fraction = t;
    answer.count =
        find_contacts(at_a, at_b, gap, std::max(tolerance, gap.distance), answer.contacts);
    const Eigen::Vector3d place_of_a = mover_a.origin_at(t);
    for (PairContact& contact : std::span(answer.contacts.data(), answer.count)) {
        contact.point_world -= place_of_a;
    }
    return answer;
}

// Sources: S. Redon, A. Kheddar, S. Coquillart. Fast continuous collision detection between rigid bodies. 2002 (trees
//          of bounds over pieces of the motion).
// Deviations: within a piece of the motion, bounds move along a line and are widened by the displacement due to
//             rotation.

namespace {

// Largest rotation in a piece of the motion, radians; and the largest number of pieces.
constexpr double kPieceTurn = 0.25;
constexpr double kMostPieces = 1024.0;

// Largest distance of a point of a box from the origin.
double reach_of(const Aabb& box) {
    const Eigen::Vector3d far = box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs());
    return length(far);
}

// Lower bound of the time of impact of two boxes within a piece of the motion, as a fraction of the piece; infinity if
// they have no impact.
class BoundsImpact {
public:
    /// @param translation of b relative to a during the piece, which starts at the placements
    BoundsImpact(const PlacedView& a, const PlacedView& b, const Eigen::Vector3d& translation,
                 double turn_a, double turn_b, double slack)
        : turn_a_(std::min(turn_a, 2.0)), turn_b_(std::min(turn_b, 2.0)) {
        for (int j = 0; j < 3; ++j) a_from_b_.col(j) = rotated_back(a.rotation, b.rotation.col(j));
        spread_ = a_from_b_.cwiseAbs();
        const Eigen::Vector3d offset = b.centre - a.centre;
        offset_ = rotated_back(a.rotation, offset);
        translation_ = rotated_back(a.rotation, translation);
        translation_in_b_ = rotated_back(b.rotation, translation);
        slack_ = slack +
                 1e-14 * (a.view->reach() + b.view->reach() + length(offset) + length(translation));
    }

    double operator()(const Aabb& of_a, const Aabb& of_b) const {
        const Eigen::Vector3d half_a = 0.5 * (of_a.high - of_a.low);
        const Eigen::Vector3d half_b = 0.5 * (of_b.high - of_b.low);
        const Eigen::Vector3d between = rotated(a_from_b_, 0.5 * (of_b.low + of_b.high)) + offset_ -
                                        0.5 * (of_a.low + of_a.high);
        double wider = slack_;
        if (turn_a_ > 0.0) wider += turn_a_ * reach_of(of_a);
        if (turn_b_ > 0.0) wider += turn_b_ * reach_of(of_b);
        double first = 0.0;
        double last = 1.0;
        clip(between, translation_, half_a + rotated(spread_, half_b), wider, first, last);
        clip(rotated_back(a_from_b_, between), translation_in_b_,
             rotated_back(spread_, half_a) + half_b, wider, first, last);
        return first <= last ? first : kInfinity;
    }

private:
    static void clip(const Eigen::Vector3d& from, const Eigen::Vector3d& translation,
                     const Eigen::Vector3d& half, double wider, double& first, double& last) {
        for (int i = 0; i < 3; ++i) {
            const double room = half[i] + wider;
            if (translation[i] == 0.0) {
                if (std::abs(from[i]) > room) last = -1.0;
                continue;
            }
            const double t0 = (-room - from[i]) / translation[i];
            const double t1 = (room - from[i]) / translation[i];
            first = std::max(first, std::min(t0, t1));
            last = std::min(last, std::max(t0, t1));
        }
    }

    Eigen::Matrix3d a_from_b_;
    Eigen::Matrix3d spread_;
    Eigen::Vector3d offset_;
    Eigen::Vector3d translation_;       ///< in a's frame
    Eigen::Vector3d translation_in_b_;  ///< in b's
    double turn_a_;
    double turn_b_;
    double slack_;
};

}  // namespace

CompoundCast cast_compounds(const ShapeView& a, const Motion& motion_a, const ShapeView& b,
                            const Motion& motion_b, const CastSettings& settings) {
    const double turn_a = length(motion_a.rotation_vector);
    const double turn_b = length(motion_b.rotation_vector);
    const double pieces =
        std::clamp(std::ceil(std::max(turn_a, turn_b) / kPieceTurn), 1.0, kMostPieces);
    const Eigen::Vector3d translation = motion_b.translation - motion_a.translation;
    const Eigen::Vector3d offset = motion_b.start.translation - motion_a.start.translation;
    const double share = 1.0 / pieces;
    CompoundCast best;
    for (double piece = 0.0; piece < pieces && !best.hit; piece += 1.0) {
        const double from = piece * share;
        const double to = piece + 1.0 == pieces ? 1.0 : (piece + 1.0) * share;
        const PlacedView at_a{&a, motion_a.at(from).rotation, Eigen::Vector3d::Zero()};
        const PlacedView at_b{&b, motion_b.at(from).rotation, offset + from * translation};
        const BoundsImpact meeting(at_a, at_b, (to - from) * translation, (to - from) * turn_a,
                                   (to - from) * turn_b, settings.tolerance);
        double limit = 1.0;  // of the piece
        visit_part_pairs(
            a.tree(), b.tree(), limit, meeting, [&](std::uint32_t i, std::uint32_t j, double) {
                const ConvexCast cast = cast_convex({a.part(i), a.body_from_part(i), motion_a},
                                                    {b.part(j), b.body_from_part(j), motion_b},
                                                    from, best.hit ? best.fraction : to, settings);
                if (piece == 0.0 && cast.started_in_contact) {
                    best.started_in_contact = true;
                }
                if (cast.hit && (!best.hit || cast.fraction < best.fraction)) {
                    best.hit = true;
                    best.fraction = cast.fraction;
                    limit = (best.fraction - from) / (to - from);
                }
                return limit;
            });
    }
    if (!best.hit) best.fraction = 1.0;
    return best;
}

}  // namespace terrane::internal
