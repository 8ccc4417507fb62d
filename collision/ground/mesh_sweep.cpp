// SPDX-License-Identifier: MIT
//
// Sources:    B. Mirtich. Impulse-based dynamic simulation of rigid body systems. 1996, 2.3 (conservative advancement).
//             S. Redon, A. Kheddar, S. Coquillart. Fast continuous collision detection between rigid bodies. 2002
//             (separation of a whole interval).
// Deviations: each triangle is its own obstacle. A plane that separates at both ends of an interval separates
//             throughout, up to the sagitta of the rotation; halved intervals are tried before the bound of the speed.
#include "ground/joined_queries.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kPieceTurn = 0.25;  // radians
constexpr int kMaxSteps = 400;       // limit per triangle and piece
/// Number of intervals tested against a separating plane: the rest of a piece, half of it, a quarter and so on.
constexpr int kHalvings = 4;
/// A step shorter than this fraction of the piece ends the advancement if the body is near.
constexpr double kShortest = 1e-6;
/// Longest piece, cells.
constexpr double kLongest = 1024.0;

class MeshSweep {
public:
    MeshSweep(const Shape& shape, const Motion& motion, const Ground& ground, double offset,
              double stop_gap)
        : shape_(shape),
          motion_(motion),
          ground_(ground),
          offset_(offset),
          stop_gap_(stop_gap),
          spin_(length(motion.rotation_vector)),
          radius_(bounding_radius(shape)) {}

    MeshSweepAnswer run() {
        const double travel = length(motion_.translation);
        double least = 1.0;
        const double longest = std::max(2.0 * radius_, 2.0 * ground_.spacing());
        if (travel > longest) least = longest / travel;
        if (spin_ > kPieceTurn) least = std::min(least, kPieceTurn / spin_);
        double share = std::max(least, std::min(1.0, kLongest * ground_.spacing() / travel)),
               t = 0.0;
        // Pieces are long while nothing is near, else short.
        while (t < 1.0 && !answer_.hit && !answer_.is_missing) {
            const double end = t + share >= 1.0 ? 1.0 : t + share;
            if (share > least) {
                if (is_empty(t, end)) {
                    t = end;
                    share = std::max(share,
                                     std::min(2.0 * share, kLongest * ground_.spacing() / travel));
                    continue;
                }
                share = std::max(least, 0.25 * share);
                continue;
            }
            if (!(end > t)) {
                answer_.hit = true;
                answer_.fraction = t;
                break;
            }
            sweep_piece(t, end);
            t = end;
            share = 2.0 * least;
        }
        return answer_;
    }

private:
    /// Whether no triangle is in the box around a piece of the motion.
    bool is_empty(double from, double to) {
        const Eigen::Vector3d half_move = 0.5 * (to - from) * motion_.translation;
        const WorldPos middle = motion_.start.translation + from * motion_.translation + half_move;
        const LocalGround local(ground_, middle);
        const SurfaceTriangles surface(local);
        const Eigen::Vector3d half =
            half_move.cwiseAbs() + Eigen::Vector3d::Constant(radius_ + stop_gap_);
        const Eigen::Vector3d centre = local.to_local(middle);
        return surface.is_empty({centre - half, centre + half});
    }

    Eigen::Matrix3d rotation(double t) const {
        return spin_ > 0.0 ? motion_.at(t).rotation : motion_.start.rotation;
    }

    void sweep_piece(double from, double to) {
        const LocalGround local(ground_, motion_.start.translation + from * motion_.translation);
        const SurfaceTriangles surface(local);
        local_ = &local;
        const LocalBody start = body_at(from), end = body_at(to);
        double limit = to;
        const double turn = spin_ * (to - from);
        start.visit(
            [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
                // A part stays within its box, translated and widened by the rotation about the body's origin.
                const double wider = turn * radius_ + stop_gap_;
                Aabb box{centre - bounds, centre + bounds};
                const Eigen::Vector3d move = (to - from) * motion_.translation;
                box.low = box.low.cwiseMin(box.low + move) - Eigen::Vector3d::Constant(wider);
                box.high = box.high.cwiseMax(box.high + move) + Eigen::Vector3d::Constant(wider);
                return !surface.is_empty(box);
            },
            [&](const LocalShape& first, std::uint32_t index) {
                LocalHull hull;
                const LocalShape last = end.part(index, hull);
                const ErodedPart at_start(first, index, offset_), at_end(last, index, offset_);
                const Eigen::Vector3d origin =
                    local.to_local(motion_.start.translation + from * motion_.translation);
                arm_ = find_arm(first, origin);
                Aabb box = at_start.box(0.0);
                const Aabb other = at_end.box(0.0);
                const double wider = stop_gap_ + sagitta(turn);
                box.low = box.low.cwiseMin(other.low) - Eigen::Vector3d::Constant(wider);
                box.high = box.high.cwiseMax(other.high) + Eigen::Vector3d::Constant(wider);
                const bool is_known = surface.visit(box, [&](const SurfaceTriangle& triangle) {
                    meet(triangle, at_start, at_end, from, to, limit);
                });
                answer_.is_missing = answer_.is_missing || !is_known;
            });
        if (answer_.is_missing) {
            // A hit on resident ground is discarded: ground that is not resident may be met before it.
            answer_.hit = false;
            answer_.fraction = from;
        } else if (answer_.hit) {
            answer_.fraction = limit;
        }
        local_ = nullptr;
    }

    LocalBody body_at(double t) const {
        return LocalBody(shape_, rotation(t),
                         local_->to_local(motion_.start.translation + t * motion_.translation));
    }
    /// Largest distance from the body's origin of a point that rotation moves.
    static double find_arm(const LocalShape& shape, const Eigen::Vector3d& origin) {
        const double lever = length(shape.centre - origin);
        return lever + (shape.kind == ShapeKind::round ? length(shape.core) : length(shape.bounds));
    }
    /// Largest distance of a point's path from its chord.
    double sagitta(double turn) const { return 0.125 * turn * turn * arm_; }

    /// Whether a plane separates the part from a triangle at both ends of an interval, and therefore throughout.
    bool is_clear(const SurfaceTriangle& triangle, const Eigen::Vector3d& n, const ErodedPart& from,
                  const ErodedPart& to, double turn, double rest) const {
        const double top = highest(triangle, n);
        return std::min(from.lowest(n), to.lowest(n)) - top - sagitta(turn) >= rest;
    }

    void meet(const SurfaceTriangle& triangle, const ErodedPart& from, const ErodedPart& to,
              double begin, double end, double& limit) {
        const double turn = spin_ * (end - begin);
        if (is_clear(triangle, triangle.normal, from, to, turn, stop_gap_)) return;
        if (from.whole().kind == ShapeKind::box && is_beside(triangle, from, to, turn)) {
            return;
        }
        advance(triangle, from, begin, limit);
    }
    /// Whether a plane orthogonal to an axis of a box at the start of a piece separates throughout the piece.
    bool is_beside(const SurfaceTriangle& triangle, const ErodedPart& from, const ErodedPart& to,
                   double turn) const {
        for (const Eigen::Vector3d& axis : from.whole().axes) {
            if (is_clear(triangle, axis, from, to, turn, stop_gap_) ||
                is_clear(triangle, -axis, from, to, turn, stop_gap_)) {
                return true;
            }
        }
        return false;
    }

    /// Conservative advancement against one triangle, limited by the earliest hit so far.
    void advance(const SurfaceTriangle& triangle, const ErodedPart& first, double begin,
                 double& limit) {
        double t = begin;
        std::optional<LocalBody> body;
        LocalHull hull;
        std::optional<LocalShape> shape;
        std::optional<ErodedPart> part;
        for (int step = 0; step < kMaxSteps; ++step) {
            const ErodedPart& now = step == 0 ? first : *part;
            const MeshPair pair = now.closest(triangle, kInfinity);
            const double gap = pair.lower;
            const Eigen::Vector3d& n = pair.normal;
            if (!(gap > 0.0)) return stop(t, pair, first, limit);
            const bool is_near = gap <= stop_gap_;
            if (is_near && is_closing(pair, t)) return stop(t, pair, first, limit);
            const double rest = 0.5 * std::min(gap, stop_gap_);
            const double left = limit - t;
            if (!(left > 0.0)) return;
            const Eigen::Vector3d turning = cross(n, motion_.rotation_vector);
            const double closing =
                std::max(0.0, length(turning) * arm_ - dot(n, motion_.translation));
            double time = closing > 0.0 ? (gap - rest) / closing : kInfinity;
            if (time >= left) return;
            const auto place = [&](double at) {
                part.reset();
                body.emplace(
                    shape_, rotation(at),
                    local_->to_local(motion_.start.translation + at * motion_.translation));
                shape.emplace(body->part(first.index(), hull));
                part.emplace(*shape, first.index(), offset_);
            };
            const double low = now.lowest(n);
            double share = left;
            bool is_moved = false;
            for (int i = 0; i < kHalvings && share > time; ++i, share *= 0.5) {
                const double at = share == left ? limit : t + share;
                place(at);
                const double top = highest(triangle, n);
                if (std::min(low, part->lowest(n)) - top - sagitta(spin_ * share) >= rest) {
                    if (share == left) return;
                    t = at;
                    is_moved = true;
                    break;
                }
            }
            if (is_moved) continue;
            if ((is_near && time < kShortest * left) || !(t + time > t)) {
                return stop(t, pair, first, limit);
            }
            t += time;
            place(t);
        }
        limit = t;
        answer_.hit = true;
    }

    /// Whether the nearest point of the body approaches the triangle, by more than rounding.
    bool is_closing(const MeshPair& pair, double t) const {
        const Eigen::Vector3d origin =
            local_->to_local(motion_.start.translation + t * motion_.translation);
        const Eigen::Vector3d velocity =
            motion_.translation + cross(motion_.rotation_vector, pair.on_part - origin);
        const double rounding = 1e-9 * (length(motion_.translation) + spin_ * arm_);
        return dot(pair.normal, velocity) < -rounding;
    }

    void stop(double t, const MeshPair& pair, const ErodedPart& part, double& limit) {
        limit = t;
        answer_.hit = true;
        answer_.normal = pair.normal;
        answer_.part = part.index();
        answer_.on_shape_world = local_->to_world(pair.on_part - part.radius() * pair.normal);
    }

    const Shape& shape_;
    const Motion& motion_;
    const Ground& ground_;
    double offset_;
    double stop_gap_;
    double spin_;
    double radius_;
    double arm_ = 0.0;                    // of the part that is swept
    const LocalGround* local_ = nullptr;  // of the piece
    MeshSweepAnswer answer_;
};

}  // namespace

MeshSweepAnswer sweep_mesh(const Shape& shape, const Motion& motion, const Ground& ground,
                           double offset, double stop_gap) {
    return MeshSweep(shape, motion, ground, offset, stop_gap).run();
}

}  // namespace terrane::internal
