// SPDX-License-Identifier: MIT
// Sources: B. Mirtich. Impulse-based dynamic simulation of rigid body systems. 1996, section 2.3
//          (conservative advancement). X. Zhang, M. Lee, Y. Kim. Interactive continuous collision
//          detection for non-convex polyhedra. The Visual Computer 2006 (bounds along the normal).
// Deviations: each column of the ground is its own convex obstacle with its own normal, so that
//             ground beside the path does not slow it down. Near contact the bound of the speed is
//             replaced by the second-order one of each corner, which lets parting contacts pass.
#include "ground_advance.h"
#include "usable.h"

#include <terrane/collision/ground_cast.h>

#include <algorithm>

namespace terrane {
namespace internal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct PieceAnswer {
    double t = 0.0;
    bool is_hit = false;
    bool is_missing = false;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    std::uint32_t part = 0;
};

class Caster {
public:
    Caster(const Sweep& sweep, const Ground& ground, double tolerance, double sink)
        : sweep_(sweep),
          ground_(ground),
          local_start_(ground, sweep.motion.start.translation),
          start_(local_start_.to_local(sweep.motion.start.translation)),
          tolerance_(tolerance),
          sink_(sink) {}

    // The whole motion, piece by piece; pieces grow while the ground is far below.
    PieceAnswer run() {
        const double travel = length(sweep_.motion.translation);
        const LocalBody start(sweep_.shape, sweep_.motion.start.rotation, start_);
        const double size = start.whole().bounds.maxCoeff();
        const double shortest_way = std::max(size, 4.0 * ground_.spacing());
        const double longest_way = 256.0 * ground_.spacing() + shortest_way;
        const double shortest =
            std::min(travel > shortest_way ? shortest_way / travel : 1.0,
                     sweep_.arm > 0.0 && sweep_.spin > kPieceTurn ? kPieceTurn / sweep_.spin : 1.0);
        const double longest =
            std::max(shortest, travel > longest_way ? longest_way / travel : 1.0);
        double length_of_piece = longest;
        double t = 0.0;
        double last = 1.0;
        clip(size + length(start.whole().offset) + sweep_.arm, t, last);
        while (t < last) {
            double end = t + length_of_piece;
            if (end > last || length_of_piece >= 1.0) end = last;
            if (!(end > t))
                return {t, true, false, Eigen::Vector3d::UnitZ()};  // no number in between
            const LocalGround local(local_start_,
                                    start_ + 0.5 * (t + end) * sweep_.motion.translation);
            if (is_clear(local, t, end)) {
                t = end;
                length_of_piece = std::min(longest, 2.0 * length_of_piece);
                continue;
            }
            if (length_of_piece > shortest) {
                length_of_piece = std::max(shortest, 0.25 * length_of_piece);
                continue;
            }
            const PieceAnswer answer = advance(local, t, end);
            if (answer.is_hit || answer.is_missing) return answer;
            t = end;
        }
        return {1.0, false, false, Eigen::Vector3d::UnitZ()};
    }

    double error_m() const { return error_m_; }

private:
    static constexpr double kPieceTurn = 0.5;  // radians
    static constexpr int kSteps = 4000;

    // Cuts a motion down to when it is over the extent and below the highest height that a world can
    // have: a path of any length costs no more than the ground it passes.
    void clip(double reach, double& first, double& last) const {
        const WorldRect& extent = ground_.extent();
        const Eigen::Vector3d& from = sweep_.motion.start.translation;
        const Eigen::Vector3d& way = sweep_.motion.translation;
        const double margin = reach + 2.0 * ground_.spacing();
        const auto cut = [&](double p, double v, double low, double high) {
            low -= margin;
            high += margin;
            if (v == 0.0) {
                if (p < low || p > high) last = -1.0;
                return;
            }
            // A hair wider, for what rounding does to the quotients.
            constexpr double kHair = 1e-9;
            const double t0 = (low - p) / v;
            const double t1 = (high - p) / v;
            first = std::max(first, std::min(t0, t1) * (1.0 - kHair));
            last = std::min(last, std::max(t0, t1) * (1.0 + kHair));
        };
        const double highest = 0x1p31 * ground_.lattice().quantum;
        cut(from[0], way[0], extent.west, extent.east);
        cut(from[1], way[1], extent.south, extent.north);
        cut(from[2], way[2], -kInfinity, highest);
    }

    // Bounds of everything that a box of the body passes from t to end.
    PassedBox pass(const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds, double arm,
                   double t, double end) const {
        return {centre, bounds, (end - t) * sweep_.motion.translation,
                std::min(sweep_.spin * (end - t), 2.0) * arm};
    }

    bool is_clear(const LocalGround& local, double t, double end) const {
        const LocalBody now = sweep_.at(local, t);
        const PassedBox passed = pass(now.whole().centre, now.whole().bounds, sweep_.arm, t, end);
        const Eigen::Vector3d low = passed.centre - passed.bounds;
        const Eigen::Vector3d high = passed.centre + passed.bounds;
        const CellRange cells = local.cells(low[0], low[1], high[0], high[1]);
        if (cells.east < cells.west || cells.north < cells.south) return true;
        const RangeAnswer range = ground_.range(cells);
        if (range.status == GroundStatus::outside) return true;
        return range.high != std::numeric_limits<std::int32_t>::max() &&
               low[2] > local.z(range.high) + tolerance_;
    }

    // One look at all parts that could be met from t to end.
    Advance look(const LocalGround& local, double t, double end) const {
        Advance found{end - t};
        sweep_.at(local, t).visit(
            [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
                const PassedBox passed = pass(centre, bounds, sweep_.arm, t, end);
                return passed.centre[2] - passed.bounds[2] <=
                       bound_ground(local, passed.centre, passed.bounds) + tolerance_;
            },
            [&](const LocalShape& shape, std::uint32_t part) {
                const double arm = sweep_.arm_of(shape);
                const PassedBox passed = pass(shape.centre, shape.bounds, arm, t, end);
                AdvanceVisitor visitor{local,  sweep_,     shape, part, arm,
                                       passed, tolerance_, sink_, found};
                const Eigen::Vector3d low = passed.centre - passed.bounds;
                const Eigen::Vector3d high = passed.centre + passed.bounds;
                visit_cells(local, local.cells(low[0], low[1], high[0], high[1]), visitor);
            });
        return found;
    }

    PieceAnswer advance(const LocalGround& local, double t, double end) {
        for (int i = 0; i < kSteps; ++i) {
            const Advance found = look(local, t, end);
            error_m_ = std::max(error_m_, found.error_m);
            const PieceAnswer here{t, found.is_hit, found.is_missing, found.hit_normal,
                                   found.hit_part};
            if (found.is_hit) return here;
            if (!(found.step < end - t)) return {end};
            if (found.is_missing && !(found.step > 0.0)) return here;
            const double next = t + found.step;
            // Steps that no number can hold: the last safe place is the answer.
            if (!(next > t)) return {t, !found.is_missing, found.is_missing, found.hit_normal};
            t = next;
        }
        return {t, true};
    }

    const Sweep& sweep_;
    const Ground& ground_;
    LocalGround local_start_;
    Eigen::Vector3d start_;  ///< in that frame
    double tolerance_;
    double sink_;
    double error_m_ = 0.0;
};

// The deepest overlap of a body in any column along the ways that part them upward.
double find_sink(const LocalGround& local, const LocalBody& body) {
    struct Visitor {
        const LocalGround& local;
        const LocalShape& shape;
        double& sink;
        bool wants(const Prism& prism) const {
            return bound_distance(shape.centre, shape.bounds, prism) <= 0.0;
        }
        bool miss(const Prism&) { return true; }
        void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
            for (const Triangle& triangle : local.triangles(cell, column, row)) {
                if (gap_along(triangle.normal, shape, triangle) >= -sink) continue;
                if (compute_column_lift(shape, triangle) <= 0.0) continue;
                sink = std::max(sink, -find_separation(shape, triangle, false).gap);
            }
        }
    };
    double sink = 0.0;
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            return centre[2] - bounds[2] <= bound_ground(local, centre, bounds);
        },
        [&](const LocalShape& shape, std::uint32_t) {
            Visitor visitor{local, shape, sink};
            const Eigen::Vector3d low = shape.centre - shape.bounds;
            const Eigen::Vector3d high = shape.centre + shape.bounds;
            visit_cells(local, local.cells(low[0], low[1], high[0], high[1]), visitor);
        });
    return sink;
}

}  // namespace
}  // namespace internal

using namespace internal;

CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings) {
    CastAnswer answer;
    if (!is_usable(shape, motion.start) || !is_finite(motion.translation) ||
        !is_finite(motion.rotation_vector) || !(settings.tolerance > 0.0) ||
        !std::isfinite(settings.tolerance)) {
        return answer;
    }
    const Sweep sweep(shape, motion);
    double sink = 0.0;
    {
        const LocalGround local(ground, motion.start.translation);
        const LocalBody start = sweep.at(local, 0.0);
        // Touching counts, whatever rounding made of it.
        const double touch = 1e-12 * (1.0 + start.whole().centre.cwiseAbs().maxCoeff() +
                                      start.whole().bounds.maxCoeff());
        const GroundLift lift = find_lift(local, start, Eigen::Vector3d::Zero(), -2.0 * touch,
                                          kAnyLift, LiftError::asked_for);
        answer.error_m = lift.error_m;
        if (lift.is_missing) {
            answer.status = ContactStatus::not_resident;
            answer.fraction = 0.0;
            return answer;
        }
        answer.started_in_contact = lift.lift >= -touch;
        if (answer.started_in_contact && settings.skip_separating) {
            sink = find_sink(local, start) + 0.1 * kTouch;
        }
    }
    answer.status = ContactStatus::complete;
    PieceAnswer end{0.0, true, false, Eigen::Vector3d::UnitZ()};
    if (!answer.started_in_contact || settings.skip_separating) {
        Caster caster(sweep, ground, settings.tolerance, sink);
        end = caster.run();
        answer.error_m = std::max(answer.error_m, caster.error_m());
    }
    answer.hit = end.is_hit;
    answer.fraction = end.t;
    if (end.is_missing) answer.status = ContactStatus::not_resident;
    if (!end.is_hit) return answer;

    // What is met there: the deepest contact, or where old contacts are passed over the one that
    // closes fastest.
    const Pose pose = motion.at(end.t);
    std::array<Contact, 16> contacts;
    const ContactAnswer found = find_contacts(shape, pose, ground, settings.tolerance, contacts);
    answer.contact.normal = end.normal;
    {
        const LocalGround local(ground, pose.translation);
        const LocalBody there = sweep.at(local, end.t);
        LocalHull hull;
        const DeepestPoint deepest = there.part(end.part, hull).deepest(end.normal);
        answer.contact.point_world = local.to_world(deepest.point);
        answer.contact.feature = deepest.feature;
        answer.contact.part = end.part;
    }
    if (found.count == 0) return answer;
    answer.contact = contacts[0];
    if (!answer.started_in_contact || !settings.skip_separating) return answer;
    double fastest = -kInfinity;
    for (std::size_t i = 0; i < found.count; ++i) {
        const Eigen::Vector3d arm = contacts[i].point_world - pose.translation;
        const double closing =
            -dot(contacts[i].normal, motion.translation + cross(motion.rotation_vector, arm));
        if (closing > fastest) {
            fastest = closing;
            answer.contact = contacts[i];
        }
    }
    return answer;
}

}  // namespace terrane
