// SPDX-License-Identifier: MIT
//
// Sources: C. Ericson. Real-time collision detection. 2005, sections 4.2.3 to 4.2.6 (AABBs of rotated shapes).
#include "broadphase/body_queries.h"

#include "base/aabb_tree.h"
#include "base/vector_math.h"
#include "pairs/convex_core.h"
#include "shapes/query_shapes.h"

#include <terrane/base/result.h>
#include <terrane/collision/ground_queries.h>
#include <terrane/collision/query.h>
#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Amount by which boxes are widened: exceeds the touching distance of shapes, the errors of distances, and rounding.
double outward(const Shape& shape, const WorldPos& origin) {
    return 4.0 * kTouchShare * bounding_radius(shape) + 4e-15 * length(origin);
}

Aabb around(const Eigen::Vector3d& centre, const Eigen::Vector3d& half) {
    return {centre - half, centre + half};
}

}  // namespace

Aabb compute_aabb(const Shape& shape, const Pose& world_from_shape) {
    const Eigen::Matrix3d rotation = orthonormalized(world_from_shape.rotation);
    const WorldPos& origin = world_from_shape.translation;
    const Eigen::Vector3d wider = Eigen::Vector3d::Constant(outward(shape, origin));
    if (const Compound* compound = std::get_if<Compound>(&shape)) {
        const Aabb& body = part_tree(*compound)[0].bounds;
        const Eigen::Vector3d half = rotated(rotation.cwiseAbs(), 0.5 * (body.high - body.low));
        return around(origin + rotated(rotation, 0.5 * (body.low + body.high)), half + wider);
    }
    Aabb bounds;
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d axis_body = rotation.row(axis).transpose();
        bounds.low[axis] = origin[axis] - support_distance(shape, -axis_body) - wider[axis];
        bounds.high[axis] = origin[axis] + support_distance(shape, axis_body) + wider[axis];
    }
    return bounds;
}

Aabb compute_rotating_aabb(const Shape& shape, const WorldPos& origin_world) {
    const double radius = bounding_radius(shape) + outward(shape, origin_world);
    return around(origin_world, Eigen::Vector3d::Constant(radius));
}

// Sources: C. Ericson. Real-time collision detection. 2005, sections 5.5.8 (moving boxes) and 6.3 (traversals).

double box_separation(const Aabb& a, const Aabb& b) {
    Eigen::Vector3d apart;
    bool is_apart = false;
    for (int axis = 0; axis < 3; ++axis) {
        apart[axis] = std::max({0.0, a.low[axis] - b.high[axis], b.low[axis] - a.high[axis]});
        is_apart |= apart[axis] > 0.0;
    }
    return is_apart ? length(apart) : -kInfinity;
}

void BodyTree::set_bounds(std::span<const Aabb> bounds) {
    const Aabb empty = empty_box();
    boxes_.resize(bounds.size());
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        boxes_[i] = is_box(bounds[i]) ? bounds[i] : empty;
    }
}

void BodyTree::build(std::span<const Aabb> bounds) {
    set_bounds(bounds);
    build_aabb_tree(boxes_, order_, nodes_);
}

void BodyTree::refit(std::span<const Aabb> bounds) {
    TERRANE_ASSERT(bounds.size() == slot_count(), "as many boxes as the tree was built of");
    set_bounds(bounds);
    refit_aabb_tree(boxes_, nodes_);
}

namespace {

bool is_seen(const QueryBody& body, const QueryFilter& filter) {
    return body.shape != nullptr && (body.filter.layers & filter.layers) != 0 &&
           body.id != filter.except && (filter.include_sensors || !body.is_sensor);
}

const Ground* seen_ground(const QueryScene& scene, const QueryFilter& filter) {
    return filter.include_ground ? scene.ground : nullptr;
}

/// Best answer so far: the smaller value, on a tie the lower slot. The ground ranks after all slots.
struct Best {
    static constexpr std::uint32_t kGround = ~std::uint32_t{0};

    double value;  ///< a fraction or a distance
    std::uint32_t slot = kGround;

    bool is_after(double other, std::uint32_t other_slot) const {
        return value != other ? value > other : slot > other_slot;
    }
};

Aabb widened(const Aabb& box, double margin) {
    const Eigen::Vector3d wider = Eigen::Vector3d::Constant(margin);
    return {box.low - wider, box.high + wider};
}

/// Bound of the rounding of a sweep and the errors of its fractions, metres; the bodies' boxes have their own margin.
double sweep_margin(const WorldPos& from, const Eigen::Vector3d& displacement) {
    return 4.0 * kTouchShare * length(displacement) + 4e-15 * length(from);
}

/// Sweep of a box that contains the moving shape in all rotations of the motion.
BoxSweep sweep_of(const Shape& shape, const Motion& motion, double tolerance) {
    const WorldPos& from = motion.start.translation;
    const Aabb box = dot(motion.rotation_vector, motion.rotation_vector) > 0.0
                         ? compute_rotating_aabb(shape, from)
                         : compute_aabb(shape, motion.start);
    const double margin = tolerance + sweep_margin(from, motion.translation);
    return {from, motion.translation, widened({box.low - from, box.high - from}, margin)};
}

}  // namespace

RayQueryAnswer query_ray(const QueryScene& scene, const WorldPos& from, const WorldPos& to,
                         const QueryFilter& filter) {
    RayQueryAnswer answer;
    const Eigen::Vector3d displacement = to - from;
    if (!is_valid_place(from) || !is_valid_place(to)) return answer;
    answer.status = QueryStatus::ok;
    const Ground* ground = seen_ground(scene, filter);
    const RayAnswer below = ground == nullptr      ? RayAnswer{}
                            : scene.fan != nullptr ? scene.fan->ray(from, to)
                                                   : ground->ray(from, to);
    if (below.status == QueryStatus::ok) {
        answer.hit = true;
        answer.fraction = below.fraction;
        answer.point_world = below.point_world;
        answer.normal = below.normal;
    }
    Best best{answer.fraction};
    const double margin = sweep_margin(from, displacement);
    const BoxSweep sweep{from, displacement, widened(Aabb{}, margin)};
    scene.tree->visit_along(sweep, best.value, [&](std::uint32_t slot) {
        const QueryBody& body = scene.bodies[slot];
        if (!is_seen(body, filter)) return best.value;
        const ShapeRayAnswer ray = cast_ray(*body.shape, body.world_from_shape, from, to);
        if (!ray.hit || !best.is_after(ray.fraction, slot)) return best.value;
        best = {ray.fraction, slot};
        answer.hit = true;
        answer.fraction = ray.fraction;
        answer.body = body.id;
        answer.point_world = ray.point_world;
        answer.normal = ray.normal;
        answer.part = ray.part;
        return best.value;
    });
    if (below.status != QueryStatus::not_resident) return answer;
    // Ground that is not loaded comes before any hit on the ground; but a hit on a body may come before both.
    const bool is_known =
        answer.hit && (answer.fraction == 0.0 ||
                       ground->ray(from, answer.point_world).status != QueryStatus::not_resident);
    if (!is_known) {
        answer = {};
        answer.status = QueryStatus::not_resident;
        answer.fraction = 0.0;
    }
    return answer;
}

CastQueryAnswer query_cast(const QueryScene& scene, const Shape& shape, const Motion& motion,
                           const QueryFilter& filter) {
    const CastSettings settings{.skip_separating = true};
    CastQueryAnswer answer;
    if (!is_valid_query(shape, motion) || !is_resolved(motion, settings.tolerance)) return answer;
    answer.status = QueryStatus::ok;
    if (const Ground* ground = seen_ground(scene, filter); ground != nullptr) {
        const CastAnswer below = cast(shape, motion, *ground, settings);
        answer.status = below.status;
        answer.hit = below.hit;
        answer.fraction = below.fraction;  // up to absent ground, if that comes first
        if (below.hit) {
            answer.point_world = below.contact.point_world;
            answer.normal = below.contact.normal;
        }
    }
    Best best{answer.fraction};
    const BoxSweep sweep = sweep_of(shape, motion, settings.tolerance);
    scene.tree->visit_along(sweep, best.value, [&](std::uint32_t slot) {
        const QueryBody& body = scene.bodies[slot];
        if (!is_seen(body, filter)) return best.value;
        const PairCastAnswer met =
            cast(shape, motion, *body.shape, Motion{body.world_from_shape}, settings);
        if (!met.hit || !best.is_after(met.fraction, slot)) return best.value;
        TERRANE_ASSERT(met.count > 0, "shapes that meet have a contact");
        best = {met.fraction, slot};
        const PairContact& contact = met.contacts[0];
        answer.status = QueryStatus::ok;
        answer.hit = true;
        answer.fraction = met.fraction;
        answer.body = body.id;
        answer.point_world = contact.point_world;
        answer.normal = contact.normal;
        answer.part = contact.part_b;
        return best.value;
    });
    return answer;
}

OverlapQueryAnswer query_overlaps(const QueryScene& scene, const Shape& shape,
                                  const Pose& world_from_shape, const QueryFilter& filter,
                                  std::span<BodyId> bodies_out) {
    OverlapQueryAnswer answer;
    if (!is_valid_query(shape, world_from_shape)) return answer;
    // A max-heap that keeps the lowest indices.
    const auto kept = [&] { return bodies_out.first(answer.count); };
    scene.tree->visit_overlaps(compute_aabb(shape, world_from_shape), [&](std::uint32_t slot) {
        const QueryBody& body = scene.bodies[slot];
        if (!is_seen(body, filter) ||
            !test_contact(shape, world_from_shape, *body.shape, body.world_from_shape)
                 .is_touching) {
            return;
        }
        ++answer.touching_count;
        if (answer.count == bodies_out.size()) {
            if (answer.count == 0 || bodies_out.front() < body.id) return;
            std::pop_heap(bodies_out.begin(), bodies_out.end());
            bodies_out.back() = body.id;
        } else {
            bodies_out[answer.count++] = body.id;
        }
        const std::span<BodyId> heap = kept();
        std::push_heap(heap.begin(), heap.end());
    });
    const std::span<BodyId> heap = kept();
    std::sort_heap(heap.begin(), heap.end());
    answer.status = answer.count < answer.touching_count ? QueryStatus::truncated : QueryStatus::ok;
    if (const Ground* ground = seen_ground(scene, filter); ground != nullptr) {
        const TestAnswer below = test_contact(shape, world_from_shape, *ground);
        answer.touches_ground = below.is_touching;
        if (below.status != QueryStatus::ok) answer.status = below.status;
    }
    return answer;
}

NearestQueryAnswer query_nearest(const QueryScene& scene, const Shape& shape,
                                 const Pose& world_from_shape, double max_distance,
                                 const QueryFilter& filter) {
    // A distance may be smaller than the separation of the boxes, but only by its error.
    constexpr double kLess = 1.0 - 4.0 * kTouchShare;
    NearestQueryAnswer answer;
    if (!is_valid_query(shape, world_from_shape) || !(max_distance >= 0.0)) return answer;
    answer.status = QueryStatus::ok;
    Best best{max_distance};
    const Aabb bounds = compute_aabb(shape, world_from_shape);
    scene.tree->visit_near(bounds, best.value / kLess, [&](std::uint32_t slot) {
        const QueryBody& body = scene.bodies[slot];
        if (!is_seen(body, filter)) return best.value / kLess;
        const PairDistanceAnswer found =
            signed_distance(shape, world_from_shape, *body.shape, body.world_from_shape);
        if (found.status != QueryStatus::ok || !best.is_after(found.distance, slot)) {
            return best.value / kLess;
        }
        best = {found.distance, slot};
        answer.is_found = true;
        answer.body = body.id;
        answer.distance = found.distance;
        answer.point_world = found.point_a_world;
        answer.point_other_world = found.point_b_world;
        answer.normal = found.normal;
        answer.part = found.part_b;
        return best.value / kLess;
    });
    const Ground* ground = seen_ground(scene, filter);
    if (ground == nullptr) return answer;
    const DistanceAnswer below =
        signed_distance(shape, world_from_shape, *ground, std::max(0.0, best.value));
    answer.status = below.status;
    if (!below.has_ground ||
        !(answer.is_found ? below.distance < best.value : below.distance <= max_distance)) {
        return answer;
    }
    answer.is_found = true;
    answer.body = {};
    answer.distance = below.distance;
    answer.point_world = below.point_world;
    answer.point_other_world = below.point_world - below.distance * below.normal;
    answer.normal = below.normal;
    answer.part = 0;
    return answer;
}

}  // namespace terrane::internal
