// SPDX-License-Identifier: MIT
//
// Queries of ground_queries.h: against the columns of the heightfield or, beside volumes, against the triangles of the
// joined surface.
#include "ground/joined_queries.h"

#include "ground/heightfield/heightfield_queries.h"
#include "shapes/query_shapes.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace internal {
namespace {

/// Distances below this are exact and count as touching, metres.
constexpr double kMeshTouch = 1e-9;
/// Relative tolerances of find_overlap_offset(): kRoughly where any separating offset will do; kFine for lifts.
constexpr double kRoughly = 1.0, kFine = 0.01;
/// The relative tolerance for depths: finer than the share of the contact tolerance that remains below the deepest
/// offset surface.
constexpr double kExact = 1e-4;

Contact contact_of_translation(const MeshQuery& query, const Eigen::Vector3d& d) {
    const double depth = length(d);
    const Eigen::Vector3d n = d / depth;
    LocalHull hull;
    std::uint32_t lowest_part = 0;
    DeepestPoint lowest{Eigen::Vector3d::Zero(), {}};
    double least = kInfinity;
    query.body().visit([](const Eigen::Vector3d&, const Eigen::Vector3d&) { return true; },
                       [&](const LocalShape& shape, std::uint32_t part) {
                           const DeepestPoint deepest = shape.deepest(n);
                           if (!(dot(n, deepest.point) < least)) return;
                           least = dot(n, deepest.point);
                           lowest = deepest;
                           lowest_part = part;
                       });
    return make_contact(lowest.point, n, depth, lowest.feature, lowest_part);
}

ContactAnswer find_contacts_on_mesh(const Shape& shape, const Pose& pose, const Ground& ground,
                                    double margin, std::span<Contact> contacts_out) {
    ContactAnswer answer;
    const MeshQuery query(shape, pose, ground);
    answer.status = QueryStatus::not_resident;
    ContactPatches patches;
    const auto find_at = [&](double offset) {
        return find_mesh_contacts(query.surface(), query.body(), offset, margin, kMeshTouch,
                                  patches);
    };
    MeshNearness near = find_at(0.0);
    answer.lift = -near.distance;
    if (!near.is_missing && !(near.distance > 0.0)) {
        const MeshOverlap overlap =
            find_overlap_offset(query.surface(), query.body(), kMeshTouch, kRoughly);
        if (overlap.is_missing) return answer;
        answer.lift = overlap.offset;
        if (overlap.is_deep) {
            const MeshTranslation out = find_separating_translation(query, overlap);
            if (!out.is_found) return answer;
            answer.lift = length(out.d);
            patches.add(contact_of_translation(query, out.d));
        } else {
            near = find_at(overlap.offset);
        }
    }
    if (near.is_missing) return answer;
    answer.error_m = query.surface().error(query.box(margin));
    const std::span<const Contact> found = patches.finish();
    answer.status = found.size() > contacts_out.size() ? QueryStatus::truncated : QueryStatus::ok;
    answer.count = std::min(found.size(), contacts_out.size());
    for (std::size_t i = 0; i < answer.count; ++i) {
        contacts_out[i] = found[i];
        contacts_out[i].point_world = query.local().to_world(found[i].point_world);
    }
    return answer;
}

/// Finds the nearest triangle to a body that is separated after shrinking by `offset`, which is 0 or of the order of
/// rounding errors. Searches in increasing distances.
void find_distance(const MeshQuery& query, double max_distance, double offset,
                   DistanceAnswer& answer) {
    constexpr double kMostCells = 1e4;  // farther triangles are not searched for
    const double most = std::min(max_distance, kMostCells * query.local().spacing());
    double reach = std::min(most, query.local().spacing());
    for (;;) {
        MeshPair best;
        best.distance = reach;
        Eigen::Vector3d on_shape = Eigen::Vector3d::Zero();
        double shift = 0.0;
        bool is_found = false, is_known = true;
        query.body().visit(
            [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
                const Eigen::Vector3d half = bounds + Eigen::Vector3d::Constant(best.distance);
                return !query.surface().is_empty({centre - half, centre + half});
            },
            [&](const LocalShape& shape, std::uint32_t index) {
                const ErodedPart part(shape, index, offset);
                const bool is_resident = query.surface().visit(
                    part.box(best.distance), [&](const SurfaceTriangle& triangle) {
                        if (part.bound_distance(triangle, 2.0 * best.distance).distance >
                            best.distance)
                            return;
                        const MeshPair pair = part.closest(triangle, best.distance);
                        const bool is_nearer = is_found ? pair.distance < best.distance
                                                        : pair.distance <= best.distance;
                        if (!is_nearer) return;
                        best = pair;
                        shift = part.shift(pair.normal);
                        on_shape = pair.on_part - (part.radius() + shift) * pair.normal;
                        is_found = true;
                    });
                is_known = is_known && is_resident;
            });
        answer.error_m = query.surface().error(query.box(reach));
        if (!is_known) return;
        if (is_found || reach >= most) {
            answer.status = QueryStatus::ok;
            answer.has_ground = is_found;
            answer.distance = is_found ? std::max(0.0, best.distance - shift) : max_distance;
            answer.distance_lower_bound = answer.distance;
            answer.normal = best.normal;
            answer.point_world = is_found ? query.local().to_world(on_shape)
                                          : query.local().to_world(query.body().whole().centre);
            return;
        }
        reach = std::min(most, 4.0 * reach);
    }
}

DistanceAnswer find_distance_on_mesh(const Shape& shape, const Pose& pose, const Ground& ground,
                                     double max_distance) {
    DistanceAnswer answer;
    const MeshQuery query(shape, pose, ground);
    answer.status = QueryStatus::not_resident;
    const MeshOverlap overlap =
        find_overlap_offset(query.surface(), query.body(), kMeshTouch, kRoughly);
    if (overlap.is_missing) return answer;
    if (overlap.offset == 0.0) {
        find_distance(query, max_distance, 0.0, answer);
        return answer;
    }
    // An overlap within rounding counts as touching.
    const MeshNearness touching =
        find_nearness(query.surface(), query.body(), kMeshTouch, kMeshTouch, kMeshTouch);
    if (touching.distance > 0.0) {
        find_distance(query, max_distance, kMeshTouch, answer);
        return answer;
    }
    const MeshTranslation out = find_separating_translation(query, overlap);
    if (!out.is_found) return answer;
    const Contact contact = contact_of_translation(query, out.d);
    answer.status = QueryStatus::ok;
    answer.has_ground = true;
    answer.distance = -contact.depth;
    answer.normal = contact.normal;
    answer.point_world = query.local().to_world(contact.point_world);
    answer.error_m = query.surface().error(query.box(0.0));
    return answer;
}

LiftAnswer find_lift_on_mesh(const Shape& shape, const Pose& pose, const Ground& ground) {
    LiftAnswer answer;
    const MeshQuery query(shape, pose, ground);
    const MeshOverlap overlap =
        find_overlap_offset(query.surface(), query.body(), kMeshTouch, kFine);
    answer.status = overlap.is_missing ? QueryStatus::not_resident : QueryStatus::ok;
    answer.lift = overlap.offset;
    answer.error_m = query.surface().error(query.box(0.0));
    if (overlap.is_missing) return answer;
    if (overlap.offset == 0.0) {
        DistanceAnswer apart;
        find_distance(query, kInfinity, 0.0, apart);
        answer.status = apart.status;
        answer.lift = apart.has_ground ? -apart.distance : -kInfinity;
    } else if (overlap.is_deep) {
        const MeshTranslation out = find_separating_translation(query, overlap);
        answer.lift = std::max(answer.lift, length(out.d));
    }
    return answer;
}

bool is_beside_volume(const Shape& shape, const Pose& pose, const Ground& ground, double margin) {
    return ground.has_solids() &&
           may_meet_volume(ground, pose.translation, bounding_radius(shape) + margin);
}

}  // namespace

MeshDepth measure_mesh_depth(const Shape& shape, const Pose& world_from_shape,
                             const Ground& ground) {
    const MeshQuery query(shape, world_from_shape, ground);
    const MeshOverlap overlap =
        find_overlap_offset(query.surface(), query.body(), kMeshTouch, kExact);
    return {overlap.is_missing, overlap.offset};
}

MeshContactAnswer find_contacts_at_offset(const Shape& shape, const Pose& world_from_shape,
                                          const Ground& ground, double offset, double margin,
                                          double exact_below, std::span<Contact> contacts_out) {
    MeshContactAnswer answer;
    const MeshQuery query(shape, world_from_shape, ground);
    ContactPatches patches;
    const MeshNearness near =
        find_mesh_contacts(query.surface(), query.body(), offset, margin, exact_below, patches);
    answer.distance = near.distance;
    answer.contacts.status = QueryStatus::not_resident;
    if (near.is_missing) return answer;
    const std::span<const Contact> found = patches.finish();
    const std::size_t most = std::min(contacts_out.size(), answer.openings.size());
    answer.contacts.status = found.size() > most ? QueryStatus::truncated : QueryStatus::ok;
    answer.contacts.count = std::min(found.size(), most);
    LocalHull hull;
    std::optional<LocalShape> shape_of_part;
    std::optional<ErodedPart> part;
    for (std::size_t i = 0; i < answer.contacts.count; ++i) {
        contacts_out[i] = found[i];
        contacts_out[i].point_world = query.local().to_world(found[i].point_world);
        if (!part || part->index() != found[i].part) {
            part.reset();
            shape_of_part.emplace(query.body().part(found[i].part, hull));
            part.emplace(*shape_of_part, found[i].part, offset);
        }
        answer.openings[i] = part->opening(found[i].normal);
    }
    return answer;
}

MeshNearness find_nearness_at(const Shape& shape, const Pose& world_from_shape,
                              const Ground& ground, double offset, double reach,
                              double exact_below) {
    const MeshQuery query(shape, world_from_shape, ground);
    return find_nearness(query.surface(), query.body(), offset, reach, exact_below);
}

bool may_meet_volume(const Ground& ground, const WorldPos& centre, double radius,
                     const Eigen::Vector3d& displacement) {
    if (!ground.has_solids()) return false;
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(radius);
    const WorldPos end = centre + displacement;
    return is_near_volume(ground, {centre.cwiseMin(end) - half, centre.cwiseMax(end) + half});
}

}  // namespace internal

using namespace internal;

ContactAnswer find_contacts(const Shape& shape, const Pose& world_from_shape, const Ground& ground,
                            double margin, std::span<Contact> contacts_out) {
    if (!is_beside_volume(shape, world_from_shape, ground, margin)) {
        return columns::find_contacts(shape, world_from_shape, ground, margin, contacts_out);
    }
    if (!is_valid_query(shape, world_from_shape) || !(margin >= 0.0)) return {};
    return find_contacts_on_mesh(shape, world_from_shape, ground, margin, contacts_out);
}

DistanceAnswer signed_distance(const Shape& shape, const Pose& world_from_shape,
                               const Ground& ground, double max_distance) {
    constexpr double kNearCells = 4.0;
    constexpr double kSeparated = 1e-9;  // metres of lift
    if (!(max_distance >= 0.0) || !is_valid_query(shape, world_from_shape)) return {};
    const double near = std::min(max_distance, kNearCells * ground.spacing());
    if (!is_beside_volume(shape, world_from_shape, ground, near)) {
        const DistanceAnswer field =
            columns::signed_distance(shape, world_from_shape, ground, max_distance);
        const double reach = field.has_ground ? std::abs(field.distance) : max_distance;
        const bool is_nearest = !(reach > near) || !std::isfinite(reach) ||
                                !is_beside_volume(shape, world_from_shape, ground, reach);
        if (is_nearest) return field;
        // The surface of a volume may be nearer than the heightfield, and a translation into a void may be shorter than
        // the one out of the heightfield.
        const DistanceAnswer joined =
            find_distance_on_mesh(shape, world_from_shape, ground, max_distance);
        if (!field.has_ground || !(field.distance < 0.0)) return joined;
        if (joined.status == QueryStatus::ok && joined.distance > field.distance) return joined;
        Pose separated = world_from_shape;
        separated.translation -= field.distance * field.normal;
        const LiftAnswer lift = compute_lift(shape, separated, ground);
        if (lift.status != QueryStatus::ok || !(lift.lift <= kSeparated)) return joined;
        DistanceAnswer answer = field;
        answer.distance_lower_bound = 0.0;
        return answer;
    }
    return find_distance_on_mesh(shape, world_from_shape, ground, max_distance);
}

LiftAnswer compute_lift(const Shape& shape, const Pose& world_from_shape, const Ground& ground) {
    if (!is_beside_volume(shape, world_from_shape, ground, 0.0)) {
        return columns::compute_lift(shape, world_from_shape, ground);
    }
    if (!is_valid_query(shape, world_from_shape)) return {};
    return find_lift_on_mesh(shape, world_from_shape, ground);
}

TestAnswer test_contact(const Shape& shape, const Pose& world_from_shape, const Ground& ground) {
    if (!is_beside_volume(shape, world_from_shape, ground, 0.0)) {
        return columns::test_contact(shape, world_from_shape, ground);
    }
    TestAnswer answer;
    if (!is_valid_query(shape, world_from_shape)) return answer;
    const MeshQuery query(shape, world_from_shape, ground);
    const MeshNearness near =
        find_nearness(query.surface(), query.body(), 0.0, 2.0 * kMeshTouch, 2.0 * kMeshTouch);
    answer.is_touching = !near.is_missing && near.distance <= kMeshTouch;
    answer.status = near.is_missing ? QueryStatus::not_resident : QueryStatus::ok;
    answer.error_m = query.surface().error(query.box(0.0));
    return answer;
}

PseudodistanceAnswer pseudodistance(const Shape& shape, const Pose& world_from_shape,
                                    const Ground& ground) {
    const LiftAnswer lift = compute_lift(shape, world_from_shape, ground);
    PseudodistanceAnswer answer;
    answer.status = lift.status;
    answer.pseudodistance = -lift.lift;
    answer.error_m = lift.error_m;
    return answer;
}

// cast() of ground_queries.h, against the same obstacles as the other queries.

namespace internal {
namespace {

constexpr double kCastTouch = 1e-9;  // metres
constexpr double kAccuracy = 1e-3;   // relative, of the ignored overlap at the start

CastAnswer cast_on_mesh(const Shape& shape, const Motion& motion, const Ground& ground,
                        const CastSettings& settings) {
    CastAnswer answer;
    answer.fraction = 0.0;
    answer.status = QueryStatus::not_resident;
    const MeshQuery query(shape, motion.start, ground);
    const MeshOverlap overlap =
        find_overlap_offset(query.surface(), query.body(), kCastTouch, kAccuracy);
    if (overlap.is_missing) return answer;
    answer.status = QueryStatus::ok;
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
    // To ignore an overlap at the start, the shape is shrunk by the depth of the overlap, and slightly more so that
    // directions are exact.
    constexpr double kMoreShare = 0.25;  // fraction of the tolerance
    const double more = answer.started_in_contact ? kMoreShare * settings.tolerance : 0.0;
    // Less than `more`, so that a sliding shape does not hit the floor ahead of it.
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
