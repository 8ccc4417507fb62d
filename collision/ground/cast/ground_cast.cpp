// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "ground/cast/caster.h"
#include "ground/cast/column_cast.h"
#include "ground/contact/column_queries.h"
#include "ground/contact/contact_patches.h"
#include "math/valid_query.h"

#include <terrane/collision/ground_cast.h>

#include <algorithm>

namespace terrane {
namespace internal {
namespace {

// Largest overlap of a body with any column along its axis of least overlap with z > 0, metres: lowered by it, the
// ground does not overlap the body.
double find_ground_offset(const LocalGround& local, const LocalBody& body) {
    struct Visitor {
        const LocalGround& local;
        const LocalShape& shape;
        double& ground_offset;
        bool wants(const CellPrism& prism) const {
            return bound_distance(shape.centre, shape.bounds, prism) <= 0.0;
        }
        bool miss(const CellPrism&) { return true; }
        void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
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

// With skip_separating, the contact that closes fastest.
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

// The deepest contact of a separated body at the end of a cast. Where it met no surface, such as at the side of the
// ground, the contact is made from the cast's normal.
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
    // Touching counts, within rounding.
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
    answer.status = QueryStatus::complete;
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
