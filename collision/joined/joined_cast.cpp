// SPDX-License-Identifier: MIT
//
// cast() of ground_cast.h: against columns of the heightfield, or beside volumes against triangles.
#include "ground/cast/column_cast.h"
#include "joined/joined_queries.h"
#include "math/valid_query.h"
#include "mesh/mesh_depth.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace internal {
namespace {

constexpr double kCastTouch = 1e-9;  // metres
constexpr double kAccuracy = 1e-3;   // of the overlap that is ignored at the start

CastAnswer cast_on_mesh(const Shape& shape, const Motion& motion, const Ground& ground,
                        const CastSettings& settings) {
    CastAnswer answer;
    answer.fraction = 0.0;
    answer.status = QueryStatus::not_resident;
    const MeshQuery query(shape, motion.start, ground);
    const MeshOverlap overlap =
        find_overlap_offset(query.surface(), query.body(), kCastTouch, kAccuracy);
    if (overlap.is_missing) return answer;
    answer.status = QueryStatus::complete;
    answer.started_in_contact = overlap.offset > 0.0 || overlap.distance <= kCastTouch;
    answer.error_m = query.surface().error(query.box(settings.tolerance));
    std::array<Contact, 1> contact;
    if (answer.started_in_contact && !settings.skip_separating) {
        answer.hit = true;
        if (find_contacts(shape, motion.start, ground, settings.tolerance, contact).count > 0) {
            answer.contact = contact[0];
        }
        return answer;
    }
    // Overlaps at the start are ignored: the shape is as much smaller, and a little more, so that directions are exact.
    constexpr double kMoreShare = 0.25;  // of the tolerance
    const double more = answer.started_in_contact ? kMoreShare * settings.tolerance : 0.0;
    // Less than that gap, so that the floor ahead of what slides on it is no hit.
    const double stop_gap = answer.started_in_contact ? 0.5 * more : settings.tolerance;
    const MeshSweepAnswer met = sweep_mesh(shape, motion, ground, overlap.offset + more, stop_gap);
    answer.fraction = met.fraction;
    answer.hit = met.hit;
    if (met.is_missing) answer.status = QueryStatus::not_resident;
    if (!met.hit) return answer;
    answer.contact.normal = met.normal;
    answer.contact.point_world = met.on_shape_world;
    answer.contact.depth = 0.0;
    answer.contact.part = met.part;
    const Pose there = motion.at(met.fraction);
    const LocalGround local(ground, there.translation);
    const LocalBody body(shape, there.rotation, local.to_local(there.translation));
    LocalHull hull;
    const LocalShape part = body.part(met.part, hull);
    answer.contact.feature = part.deepest(met.normal).feature;
    const SurfaceTriangles surface(local);
    const Eigen::Vector3d half = part.bounds + Eigen::Vector3d::Constant(settings.tolerance);
    answer.error_m =
        std::max(answer.error_m, surface.error({part.centre - half, part.centre + half}));
    return answer;
}

}  // namespace
}  // namespace internal

using namespace internal;

CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings) {
    if (!is_resolved(motion, settings.tolerance)) return {};
    const bool may_meet =
        ground.has_solids() && may_meet_volume(ground, motion.start.translation,
                                               bounding_radius(shape), motion.translation);
    if (!may_meet) {
        return columns::cast(shape, motion, ground, settings);
    }
    if (!is_valid_query(shape, motion) || !(settings.tolerance > 0.0) ||
        !std::isfinite(settings.tolerance)) {
        return {};
    }
    return cast_on_mesh(shape, motion, ground, settings);
}

}  // namespace terrane
