// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "ground/column/ground_lift.h"
#include "ground/heightfield/contact_patches.h"
#include "ground/heightfield/ground_advance.h"
#include "ground/heightfield/heightfield_queries.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>

// Sources: B. Mirtich. Impulse-based dynamic simulation of rigid body systems. 1996, 2.3 (conservative advancement).
//          X. Zhang, M. Lee, Y. Kim. Interactive continuous collision detection for non-convex polyhedra. The Visual
//          Computer 2006 (bounds along the normal).
// Deviations: each column of the ground is its own convex obstacle with its own normal, so that ground beside the
//             trajectory does not shorten the steps. For a part that does not turn, the time of contact with each
//             column has a closed form (find_entry()), so that one step per piece of the motion is enough. For a
//             turning part, the bound of the speed is replaced near contact by a second-order bound for each corner,
//             which lets separating contacts pass.

namespace terrane::internal {

// End of a piece of the motion, or a contact with the ground before that end.
struct PieceAnswer {
    double t = 0.0;
    bool is_hit = false;
    bool is_missing = false;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    std::uint32_t part = 0;
};

// Casts a body along its motion, piece by piece.
class Caster {
public:
    // `local` is the ground near the start of the motion, `start` the body there.
    Caster(const Sweep& sweep, const LocalGround& local, const LocalBody& start, double tolerance)
        : sweep_(sweep),
          local_start_(local),
          start_(start),
          origin_(local.to_local(sweep.motion.start.translation)),
          tolerance_(tolerance) {
        const double spacing = local.spacing();
        const double travel = length(sweep.motion.translation);
        const double size = start.whole().bounds.maxCoeff();
        // Short pieces fit into a window.
        const double shortest_length =
            std::max({size, 4.0 * spacing, kWindow * spacing - 2.0 * size});
        const double longest_length = 256.0 * spacing + shortest_length;
        shortest_ =
            std::min(travel > shortest_length ? shortest_length / travel : 1.0,
                     sweep.arm > 0.0 && sweep.spin > kPieceTurn ? kPieceTurn / sweep.spin : 1.0);
        longest_ = std::max(shortest_, travel > longest_length ? longest_length / travel : 1.0);
        clip(size + length(start.whole().offset) + sweep.arm);
    }

    // Reads the ground of the first piece once, if that ground fits into a window.
    void read_ahead() const {
        if (shortest_ < 1.0 || first_ > 0.0 || start_.is_compound()) return;
        local_start_.window(swept_box(start_, 0.0, 1.0).cells(local_start_), 0);
    }

    // Calls `visitor` with the ground in a frame near the body at t.
    template <class Visitor>
    auto with_ground(double t, Visitor&& visitor) const {
        const Eigen::Vector3d at = origin_ + t * sweep_.motion.translation;
        const bool is_near = at.cwiseAbs().maxCoeff() <= kNear * local_start_.spacing();
        return is_near ? visitor(local_start_) : visitor(LocalGround(local_start_, at));
    }

    // Casts the whole motion. Pieces grow while the ground is far below.
    //
    // @param ground_offset the ground is lowered by this, metres
    PieceAnswer run(double ground_offset) {
        ground_offset_ = ground_offset;
        double length_of_piece = longest_;
        double t = first_;
        while (t < last_) {
            double end = t + length_of_piece;
            if (end > last_ || length_of_piece >= 1.0) end = last_;
            if (!(end > t))
                return {t, true, false,
                        Eigen::Vector3d::UnitZ()};  // no representable time in between
            const PieceAnswer answer = with_ground(0.5 * (t + end), [&](const LocalGround& local) {
                return advance_piece(local, t, end, length_of_piece);
            });
            if (answer.is_hit || answer.is_missing) return answer;
            t = answer.t;
        }
        return {1.0, false, false, Eigen::Vector3d::UnitZ()};
    }

    double error_m() const { return error_m_; }

private:
    static constexpr double kPieceTurn = 0.5;  // radians
    static constexpr int kSteps = 4000;
    static constexpr double kWindow = 12.0;  // cells; a short piece plus twice the shape's size
    static constexpr double kNear = 64.0;    // cells from the origin of a frame

    // Clips the motion to the times at which the body may be over the extent and below the highest possible ground, so
    // that a motion of any length costs no more than the ground below it.
    void clip(double reach) {
        const WorldRect& extent = ground().extent();
        const Eigen::Vector3d& from = sweep_.motion.start.translation;
        const Eigen::Vector3d& velocity = sweep_.motion.translation;
        const double margin = reach + 2.0 * ground().spacing();
        const auto cut = [&](double p, double v, double low, double high) {
            low -= margin;
            high += margin;
            if (v == 0.0) {
                if (p < low || p > high) last_ = -1.0;
                return;
            }
            // Slightly wider, to cover the rounding of the quotients.
            constexpr double kSlack = 1e-9;
            const double t0 = (low - p) / v;
            const double t1 = (high - p) / v;
            first_ = std::max(first_, std::min(t0, t1) * (1.0 - kSlack));
            last_ = std::min(last_, std::max(t0, t1) * (1.0 + kSlack));
        };
        const double highest = 0x1p31 * ground().lattice().quantum;
        cut(from[0], velocity[0], extent.west, extent.east);
        cut(from[1], velocity[1], extent.south, extent.north);
        cut(from[2], velocity[2], -Approach::kNever, highest);
    }

    // Bounding box of an AABB of the body while the body moves from t to `end`.
    SweptBox swept_box(const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds, double arm,
                       double t, double end) const {
        return {centre, bounds, (end - t) * sweep_.motion.translation,
                std::min(sweep_.spin * (end - t), 2.0) * arm};
    }

    SweptBox swept_box(const LocalBody& body, double t, double end) const {
        return swept_box(body.whole().centre, body.whole().bounds, sweep_.arm, t, end);
    }

    // Calls `visitor` with the body at t.
    template <class Visitor>
    auto with_body(const LocalGround& local, double t, Visitor&& visitor) const {
        if (t == 0.0 && &local == &local_start_) return visitor(start_);
        return visitor(sweep_.at(local, t));
    }

    // Advances from t to `end`, or until the first time that is not proved clear. Adapts the length of the next piece.
    PieceAnswer advance_piece(const LocalGround& local, double t, double end,
                              double& length_of_piece) {
        const bool is_short = !(length_of_piece > shortest_);
        const bool is_all = is_short && end - t >= 1.0;
        const double clear = is_all ? t : find_clear(local, t, end);
        if (clear >= end) {
            length_of_piece = std::min(longest_, 2.0 * length_of_piece);
            return {end};
        }
        if (is_short) return advance(local, t, end);
        length_of_piece = std::max(shortest_, 0.25 * length_of_piece);
        return {clear - t > shortest_ ? clear : t};
    }

    // The time until which the body stays above all ground that it could meet from t to `end`; at most `end`.
    double find_clear(const LocalGround& local, double t, double end) const {
        return with_body(local, t, [&](const LocalBody& body) {
            const CellRange cells = swept_box(body, t, end).cells(local);
            if (cells.east < cells.west || cells.north < cells.south) return end;
            const RangeAnswer range = ground().range(cells);
            if (range.status == QueryStatus::outside) return end;
            if (range.high == std::numeric_limits<std::int32_t>::max()) return t;
            const Approach approach{body.whole(), sweep_.motion.translation,
                                    sweep_.spin * sweep_.arm, tolerance_, 0.0};
            const double time = approach.down_to(local.z(range.high));
            return time < end - t ? t + time : end;
        });
    }

    // Finds one step for all parts that could meet the ground from t to `end`.
    Advance find_advance(const LocalGround& local, double t, double end) const {
        Advance found{end - t};
        const auto may_meet = [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            const SweptBox swept = swept_box(centre, bounds, sweep_.arm, t, end);
            return swept.bottom() <= bound_ground(local, swept.centre, swept.bounds) + tolerance_;
        };
        with_body(local, t, [&](const LocalBody& body) {
            body.visit(may_meet, [&](const LocalShape& shape, std::uint32_t part) {
                const double arm = sweep_.arm_of(shape);
                AdvanceVisitor visitor(local, sweep_, shape, part, arm, tolerance_, ground_offset_,
                                       found);
                visitor.visit(swept_box(shape.centre, shape.bounds, arm, t, end).cells(local));
            });
        });
        return found;
    }

    PieceAnswer advance(const LocalGround& local, double t, double end) {
        for (int i = 0; i < kSteps; ++i) {
            const Advance found = find_advance(local, t, end);
            error_m_ = std::max(error_m_, found.error_m);
            const double next = t + found.step;
            if (found.is_hit) return {next, true, false, found.hit_normal, found.hit_part};
            if (!(found.step < end - t)) return {end};
            if (found.is_missing && !(found.step > 0.0)) return {t, false, true};
            // The step is below the resolution of t: the last safe time is the answer.
            if (!(next > t)) return {t, !found.is_missing, found.is_missing, found.hit_normal};
            t = next;
        }
        return {t, true};
    }

    const Ground& ground() const { return local_start_.ground(); }

    const Sweep& sweep_;
    const LocalGround& local_start_;
    const LocalBody& start_;
    Eigen::Vector3d origin_;  ///< of the body at the start, in the frame of local_start_
    double tolerance_;
    double ground_offset_ = 0.0;
    double shortest_;  ///< length of pieces, fractions of the motion
    double longest_;
    double first_ = 0.0;  ///< interval of times in which the body can meet ground
    double last_ = 1.0;
    double error_m_ = 0.0;
};

}  // namespace terrane::internal

namespace terrane {
namespace internal {
namespace {

// A distance by which the ground must be lowered so that a body does not overlap it, metres: the largest of the body's
// overlaps with single columns, each along the axis with z > 0 that makes it smallest.
double find_ground_offset(const LocalGround& local, const LocalBody& body) {
    struct Visitor {
        const LocalGround& local;
        const LocalShape& shape;
        double& ground_offset;
        bool wants(const CellPrism& prism) const {
            return bound_distance(shape.centre, shape.bounds, prism) <= 0.0;
        }
        bool miss(const CellPrism&) { return true; }
        void visit(const GroundCell& cell, std::int64_t column, std::int64_t row) {
            for (const Triangle& triangle : local.triangles(cell, column, row)) {
                if (gap_along(triangle.normal, shape, triangle) >= -ground_offset) continue;
                if (compute_column_lift(shape, triangle) <= 0.0) continue;
                ground_offset =
                    std::max(ground_offset, -find_separation(shape, triangle, false).gap);
            }
        }
    };
    double ground_offset = 0.0;
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            return centre[2] - bounds[2] <= bound_ground(local, centre, bounds);
        },
        [&](const LocalShape& shape, std::uint32_t) {
            Visitor visitor{local, shape, ground_offset};
            const Eigen::Vector3d low = shape.centre - shape.bounds;
            const Eigen::Vector3d high = shape.centre + shape.bounds;
            visit_cells(local, local.cells(low[0], low[1], high[0], high[1]), visitor);
        });
    return ground_offset;
}

// Finds the contact that closes fastest, for CastSettings::skip_separating.
bool find_closing(const Shape& shape, const Motion& motion, const Pose& pose, const Ground& ground,
                  double tolerance, Contact& contact_out) {
    std::array<Contact, 16> contacts;
    const std::size_t count =
        columns::find_contacts(shape, pose, ground, tolerance, contacts).count;
    double fastest = -kInfinity;
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3d arm = contacts[i].point_world - pose.translation;
        const double closing =
            -dot(contacts[i].normal, motion.translation + cross(motion.rotation_vector, arm));
        if (closing > fastest) {
            fastest = closing;
            contact_out = contacts[i];
        }
    }
    return count > 0;
}

// The deepest contact of a separated body at the end of a cast. If no contact is found, for instance at the side of the
// ground, one is made from the normal of the cast.
Contact find_met(const LocalGround& local, const LocalBody& body, const PieceAnswer& end,
                 double tolerance) {
    ContactPatches patches;
    double error_m = 0.0;
    find_patches(local, body, Eigen::Vector3d::Zero(), tolerance, patches, error_m);
    const std::span<const Contact> found = patches.finish();
    Contact contact;
    if (!found.empty()) {
        contact = found[0];
    } else {
        LocalHull hull;
        const DeepestPoint deepest = body.part(end.part, hull).deepest(end.normal);
        contact = make_contact(deepest.point, end.normal, 0.0, deepest.feature, end.part);
    }
    contact.point_world = local.to_world(contact.point_world);
    return contact;
}

}  // namespace
namespace columns {

CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings) {
    CastAnswer answer;
    if (!is_valid_query(shape, motion) || !(settings.tolerance > 0.0) ||
        !std::isfinite(settings.tolerance)) {
        return answer;
    }
    const Sweep sweep(shape, motion);
    const LocalGround local(ground, motion.start.translation);
    const LocalBody start = sweep.at(local, 0.0);
    Caster caster(sweep, local, start, settings.tolerance);
    // Touching within rounding counts as contact.
    const double touch = 1e-12 * (1.0 + start.whole().centre.cwiseAbs().maxCoeff() +
                                  start.whole().bounds.maxCoeff());
    GroundLift lift;
    const double bottom = start.whole().centre[2] - start.whole().bounds[2];
    if (bottom - 2.0 * touch <= bound_ground(local, start.whole().centre, start.whole().bounds)) {
        caster.read_ahead();
        lift = find_lift(local, start, Eigen::Vector3d::Zero(), -2.0 * touch, kAnyLift,
                         LiftError::requested);
    }
    answer.error_m = lift.error_m;
    if (lift.is_missing) {
        answer.status = QueryStatus::not_resident;
        answer.fraction = 0.0;
        return answer;
    }
    answer.started_in_contact = lift.lift >= -touch;
    answer.status = QueryStatus::ok;
    PieceAnswer end{0.0, true, false, Eigen::Vector3d::UnitZ()};
    if (!answer.started_in_contact || settings.skip_separating) {
        end = caster.run(answer.started_in_contact ? find_ground_offset(local, start) + 0.1 * kTouch
                                                   : 0.0);
        answer.error_m = std::max(answer.error_m, caster.error_m());
    }
    answer.hit = end.is_hit;
    answer.fraction = end.t;
    if (end.is_missing) answer.status = QueryStatus::not_resident;
    if (!end.is_hit) return answer;

    if (answer.started_in_contact) {
        const Pose pose = motion.at(end.t);
        const bool is_found =
            settings.skip_separating
                ? find_closing(shape, motion, pose, ground, settings.tolerance, answer.contact)
                : columns::find_contacts(shape, pose, ground, settings.tolerance,
                                         {&answer.contact, 1})
                          .count > 0;
        if (is_found) return answer;
    }
    answer.contact = caster.with_ground(end.t, [&](const LocalGround& there) {
        return find_met(there, sweep.at(there, end.t), end, settings.tolerance);
    });
    return answer;
}

}  // namespace columns
}  // namespace internal
}  // namespace terrane
