// SPDX-License-Identifier: MIT
// Sources: S. Redon, A. Kheddar, S. Coquillart. Fast continuous collision detection between rigid
//          bodies. 2002 (trees of bounds over pieces of the motion).
// Deviations: within a piece of the motion bounds move along a line and are widened by the displacement by rotation.
#include "pairs/compound/compound_cast.h"

#include "base/vector_math.h"
#include "pairs/compound/part_pairs.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Largest rotation in a piece of the motion, radians; and the largest number of pieces.
constexpr double kPieceTurn = 0.25;
constexpr double kMostPieces = 1024.0;

// Largest distance of a point of a box from the origin.
double reach_of(const Aabb& box) {
    const Eigen::Vector3d far = box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs());
    return length(far);
}

// Lower bound of the time of impact of two boxes in a piece of the motion, as a share of the piece; infinity: none.
class BoundsImpact {
public:
    /// @param translation of b relative to a during the piece, which starts at the placements
    BoundsImpact(const PlacedShape& a, const PlacedShape& b, const Eigen::Vector3d& translation,
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
        const PlacedShape at_a{&a, motion_a.at(from).rotation, Eigen::Vector3d::Zero()};
        const PlacedShape at_b{&b, motion_b.at(from).rotation, offset + from * translation};
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
