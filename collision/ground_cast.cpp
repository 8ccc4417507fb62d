// SPDX-License-Identifier: MIT
// Sources: B. Mirtich. Impulse-based dynamic simulation of rigid body systems. 1996, section 2.3
//          (conservative advancement). X. Zhang, M. Lee, Y. Kim. Interactive continuous collision
//          detection for non-convex polyhedra. The Visual Computer 2006 (bounds along the normal).
// Deviations: each column of the ground is its own convex obstacle with its own normal, so that
//             ground beside the path does not slow it down. Near contact the bound of the speed is
//             replaced by the second-order one of each corner, which lets parting contacts pass.
#include "contact_patches.h"
#include "freeing.h"
#include "nearest.h"

#include <terrane/collision/ground_cast.h>

#include <algorithm>

namespace terrane {
namespace internal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What a cast knows about its motion; times are fractions of it.
struct Sweep {
    Sweep(const Shape& shape_in, const Motion& motion_in)
        : shape(shape_in), motion(motion_in), spin(length(motion_in.rotation_vector)) {
        const LocalShape start = make_local_shape(shape, motion.start.rotation);
        smallest = start.smallest;
        if (spin == 0.0) return;
        const Eigen::Vector3d axis = motion.rotation_vector / spin;
        if (start.is_box) {
            for (int i = 0; i < 8; ++i) arm = std::max(arm, length(cross(axis, start.corner(i))));
        } else {
            arm = length(cross(axis, start.core));  // turning a ball about its centre moves nothing
        }
    }

    // The shape at t, seen from a local frame.
    LocalShape at(const LocalGround& local, double t) const {
        const Pose pose = motion.at(t);
        LocalShape moved = make_local_shape(shape, pose.rotation);
        moved.centre = local.to_local(motion.start.translation) + t * motion.translation;
        return moved;
    }

    const Shape& shape;
    const Motion& motion;
    double spin = 0.0;      ///< radians in all
    double arm = 0.0;       ///< largest distance from the axis of what turning moves, metres
    double smallest = 0.0;  ///< half extent
};

// Time after which the gap along n, taken by the moving points of a shape, may be down to `rest`.
double bound_time(const Sweep& sweep, const LocalShape& shape, const Eigen::Vector3d& n, double gap,
                  double rest, double remaining) {
    const double speed = -dot(n, sweep.motion.translation);
    const Eigen::Vector3d turn = cross(n, sweep.motion.rotation_vector);
    const double closing = speed + length(turn) * sweep.arm;
    double time = closing > 0.0 ? (gap - rest) / closing : kInfinity;
    if (time >= remaining || sweep.arm == 0.0) return time;
    // Each point starts at its own gap, at its own speed, and is bent by at most this.
    const double bend = sweep.spin * sweep.spin * sweep.arm;
    const double extent = shape.extent(n);
    double each = kInfinity;
    const auto take = [&](const Eigen::Vector3d& arm, double radius) {
        const double room = gap - rest + extent + dot(n, arm) - radius;
        const double rate = dot(turn, arm) - speed;  // n . (v + w x arm)
        // room + rate t - bend t^2 / 2 = 0
        const double root =
            std::sqrt(std::max(0.0, rate * rate + 2.0 * bend * std::max(0.0, room)));
        const double when =
            rate < 0.0 ? 2.0 * std::max(0.0, room) / (root - rate) : (rate + root) / bend;
        each = std::min(each, when);
    };
    if (shape.is_box) {
        for (int i = 0; i < 8; ++i) take(shape.corner(i) - shape.centre, 0.0);
    } else {
        take(shape.core, shape.radius);
        take(-shape.core, shape.radius);
    }
    return std::max(time, each);
}

// One look at all columns that could be met in the rest of a piece.
struct AdvanceVisitor {
    const LocalGround& local;
    const Sweep& sweep;
    const LocalShape& shape;  ///< where it is now
    Eigen::Vector3d centre;   ///< of the bounds of the rest of the piece
    Eigen::Vector3d bounds;
    double tolerance;
    double sink;  ///< how much lower the ground counts as
    double step;  ///< shortest time found; starts as what is left of the piece
    bool is_hit = false;
    Eigen::Vector3d hit_normal = Eigen::Vector3d::UnitZ();
    bool is_missing = false;
    double error_m = 0.0;

    bool wants(const Prism& prism) const {
        return bound_distance(centre, bounds, prism) <= tolerance && can_meet(prism);
    }

    // Whether anything in a prism may be met before the shortest time so far.
    bool can_meet(const Prism& prism) const {
        const double turning = sweep.spin * sweep.arm;
        const Eigen::Vector3d& v = sweep.motion.translation;
        const auto is_later = [&](double gap, double speed) {
            const double closing = speed + turning;
            return gap > tolerance && (closing <= 0.0 || gap - tolerance >= step * closing);
        };
        const Eigen::Vector3d low = shape.centre - shape.bounds;
        const Eigen::Vector3d high = shape.centre + shape.bounds;
        if (is_later(low[2] - prism.high + sink, -v[2]) || is_later(low[0] - prism.east, -v[0]) ||
            is_later(prism.west - high[0], v[0]) || is_later(low[1] - prism.north, -v[1]) ||
            is_later(prism.south - high[1], v[1])) {
            return false;
        }
        if (!shape.is_box) return true;
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d n = shape.up(i);
            const double top = std::max(n[0] * (prism.west - shape.centre[0]),
                                        n[0] * (prism.east - shape.centre[0])) +
                               std::max(n[1] * (prism.south - shape.centre[1]),
                                        n[1] * (prism.north - shape.centre[1])) +
                               n[2] * (prism.high - shape.centre[2]);
            if (is_later(sink * n[2] - top - shape.half[static_cast<Eigen::Index>(i)],
                         -dot(n, v))) {
                return false;
            }
        }
        return true;
    }

    bool miss(const Prism& prism) {
        if (!wants(prism)) return true;
        const double x = std::max(prism.west - shape.centre[0] - shape.bounds[0],
                                  shape.centre[0] - shape.bounds[0] - prism.east);
        const double y = std::max(prism.south - shape.centre[1] - shape.bounds[1],
                                  shape.centre[1] - shape.bounds[1] - prism.north);
        const double turning = sweep.spin * sweep.arm;
        // Up to where the bounds reach the cell, from whichever side holds longer.
        const auto time = [&](double gap, double speed) {
            return gap <= 0.0 ? 0.0 : gap / (std::abs(speed) + turning + 1e-300);
        };
        const double when =
            std::max(time(x, sweep.motion.translation[0]), time(y, sweep.motion.translation[1]));
        if (when < step) {
            step = when;
            is_missing = true;
            is_hit = false;
        }
        return true;
    }

    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        error_m = std::max(error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : local.triangles(cell, column, row)) take(triangle);
    }

    void take(const Triangle& triangle) {
        double when = -kInfinity;
        double widest = -kInfinity;
        Eigen::Vector3d normal = triangle.normal;
        bool is_passed = false;
        const auto look = [&](const Eigen::Vector3d& n, double gap) {
            if (gap > widest) {
                widest = gap;
                normal = n;
            }
            if (is_passed || gap < 0.0) return;
            const double time = bound_time(sweep, shape, n, gap, rest_of(gap), step);
            when = std::max(when, time);
            is_passed = when >= step;
        };
        const auto look_top = [&](const Eigen::Vector3d& n, double gap) { look(n, gap + sink); };
        look_top(triangle.normal, gap_along(triangle.normal, shape, triangle));
        if (is_passed) return;
        visit_tops(shape, triangle, look_top);
        if (is_passed) return;
        visit_walls(shape, triangle, look);
        if (is_passed) return;
        if (widest <= 0.25 * tolerance) {
            // Planes may be near where corners are not.
            if (shape.is_box && sink == 0.0 && widest > 0.0) {
                const ClosestPair pair = find_closest(shape, triangle);
                if (pair.distance > 0.5 * tolerance) {
                    const Eigen::Vector3d n = (pair.on_shape - pair.on_triangle) / pair.distance;
                    if (n[2] >= 0.0) look(n, gap_along(n, shape, triangle));
                    if (is_passed) return;
                }
            }
            if (widest <= 0.25 * tolerance) {
                step = 0.0;
                is_hit = true;
                is_missing = false;
                hit_normal = normal;
                return;
            }
        }
        step = std::max(0.0, when);
        is_hit = false;
        is_missing = false;
    }

    double rest_of(double gap) const { return std::min(0.125 * tolerance, 0.5 * gap); }
};

struct PieceAnswer {
    double t = 0.0;
    bool is_hit = false;
    bool is_missing = false;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
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
        const LocalShape start = make_local_shape(sweep_.shape, sweep_.motion.start.rotation);
        const double size = start.bounds.maxCoeff();
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
        clip(start.bounds.maxCoeff() + sweep_.arm, t, last);
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

    // Bounds of everything that the shape passes from t to end.
    void bound_piece(const LocalShape& now, double t, double end, Eigen::Vector3d& centre_out,
                     Eigen::Vector3d& bounds_out) const {
        const Eigen::Vector3d way = (end - t) * sweep_.motion.translation;
        centre_out = now.centre + 0.5 * way;
        const double turned = std::min(sweep_.spin * (end - t), 2.0) * sweep_.arm;
        for (int i = 0; i < 3; ++i) {
            bounds_out[i] = now.bounds[i] + 0.5 * std::abs(way[i]) + turned;
        }
    }

    bool is_clear(const LocalGround& local, double t, double end) const {
        Eigen::Vector3d centre;
        Eigen::Vector3d bounds;
        bound_piece(sweep_.at(local, t), t, end, centre, bounds);
        const Eigen::Vector3d low = centre - bounds;
        const Eigen::Vector3d high = centre + bounds;
        const CellRange cells = local.cells(low[0], low[1], high[0], high[1]);
        if (cells.east < cells.west || cells.north < cells.south) return true;
        const RangeAnswer range = ground_.range(cells);
        if (range.status == GroundStatus::outside) return true;
        return range.status == GroundStatus::ok && low[2] > local.z(range.high) + tolerance_;
    }

    PieceAnswer advance(const LocalGround& local, double t, double end) {
        for (int i = 0; i < kSteps; ++i) {
            const LocalShape now = sweep_.at(local, t);
            Eigen::Vector3d centre;
            Eigen::Vector3d bounds;
            bound_piece(now, t, end, centre, bounds);
            AdvanceVisitor visitor{local, sweep_, now, centre, bounds, tolerance_, sink_, end - t};
            const Eigen::Vector3d low = centre - bounds;
            const Eigen::Vector3d high = centre + bounds;
            visit_cells(local, local.cells(low[0], low[1], high[0], high[1]), visitor);
            error_m_ = std::max(error_m_, visitor.error_m);
            if (visitor.is_hit) return {t, true, false, visitor.hit_normal};
            if (!(visitor.step < end - t)) return {end, false, false, visitor.hit_normal};
            const double next = t + visitor.step;
            if (visitor.is_missing && !(visitor.step > 0.0))
                return {t, false, true, visitor.hit_normal};
            // Steps that no number can hold: the last safe place is the answer.
            if (!(next > t))
                return {t, !visitor.is_missing, visitor.is_missing, visitor.hit_normal};
            t = next;
        }
        return {t, true, false, Eigen::Vector3d::UnitZ()};
    }

    const Sweep& sweep_;
    const Ground& ground_;
    LocalGround local_start_;
    Eigen::Vector3d start_;  ///< in that frame
    double tolerance_;
    double sink_;
    double error_m_ = 0.0;
};

// The deepest overlap of a shape in any column along the ways that part them upward.
double find_sink(const LocalGround& local, const LocalShape& shape) {
    struct Visitor {
        const LocalGround& local;
        const LocalShape& shape;
        double sink = 0.0;
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
    Visitor visitor{local, shape};
    const Eigen::Vector3d low = shape.centre - shape.bounds;
    const Eigen::Vector3d high = shape.centre + shape.bounds;
    visit_cells(local, local.cells(low[0], low[1], high[0], high[1]), visitor);
    return visitor.sink;
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
        const LocalShape start = sweep.at(local, 0.0);
        const GroundLift lift = find_lift(local, start, Eigen::Vector3d::Zero());
        answer.error_m = lift.error_m;
        if (lift.is_missing) {
            answer.status = ContactStatus::not_resident;
            answer.fraction = 0.0;
            return answer;
        }
        // Touching counts, whatever rounding made of it.
        const double touch =
            1e-12 * (1.0 + start.centre.cwiseAbs().maxCoeff() + start.bounds.maxCoeff());
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
        const LocalShape there = sweep.at(local, end.t);
        answer.contact.point_world = local.to_world(there.deepest_point(end.normal));
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
