// SPDX-License-Identifier: MIT
#pragma once

#include "world_cases.h"

#include <terrane/collision/shape_pairs.h>

// The queries of a scene by brute force: every body by itself, then the least of all answers. All ground must be
// resident.
namespace terrane::test {

inline RayQueryAnswer oracle_ray(const internal::QueryScene& scene, const WorldPos& from,
                                 const WorldPos& to, const QueryFilter& filter) {
    std::vector<RayQueryAnswer> hits;  // bodies in ascending order, then the ground
    for (const std::uint32_t i : seen_by(filter, scene)) {
        const internal::QueryBody& body = scene.bodies[i];
        const ShapeRayAnswer ray = cast_ray(*body.shape, body.world_from_shape, from, to);
        if (!ray.hit) continue;
        hits.push_back({QueryStatus::complete, true, ray.fraction, body.id, ray.point_world,
                        ray.normal, ray.part});
    }
    if (filter.include_ground) {
        const RayAnswer ray = scene.ground->ray(from, to);
        if (ray.status == GroundStatus::ok) {
            hits.push_back({QueryStatus::complete, true, ray.fraction, BodyId{}, ray.point_world,
                            ray.normal, 0});
        }
    }
    RayQueryAnswer none;
    none.status = QueryStatus::complete;
    if (hits.empty()) return none;
    return *std::min_element(hits.begin(), hits.end(),
                             [](const auto& a, const auto& b) { return a.fraction < b.fraction; });
}

inline CastQueryAnswer oracle_cast(const internal::QueryScene& scene, const Shape& shape,
                                   const Motion& motion, const QueryFilter& filter) {
    CastSettings settings;
    settings.skip_separating = true;
    std::vector<CastQueryAnswer> hits;
    for (const std::uint32_t i : seen_by(filter, scene)) {
        const internal::QueryBody& body = scene.bodies[i];
        const PairCastAnswer met =
            cast(shape, motion, *body.shape, Motion{body.world_from_shape}, settings);
        if (!met.hit) continue;
        hits.push_back({QueryStatus::complete, true, met.fraction, body.id,
                        met.contacts[0].point_world, met.contacts[0].normal,
                        met.contacts[0].part_b});
    }
    if (filter.include_ground) {
        const CastAnswer met = cast(shape, motion, *scene.ground, settings);
        if (met.hit) {
            hits.push_back({QueryStatus::complete, true, met.fraction, BodyId{},
                            met.contact.point_world, met.contact.normal, 0});
        }
    }
    CastQueryAnswer none;
    none.status = QueryStatus::complete;
    if (hits.empty()) return none;
    return *std::min_element(hits.begin(), hits.end(),
                             [](const auto& a, const auto& b) { return a.fraction < b.fraction; });
}

inline std::vector<BodyId> oracle_overlaps(const internal::QueryScene& scene, const Shape& shape,
                                           const Pose& pose, const QueryFilter& filter) {
    std::vector<BodyId> touched;
    for (const std::uint32_t i : seen_by(filter, scene)) {
        const internal::QueryBody& body = scene.bodies[i];
        if (test_contact(shape, pose, *body.shape, body.world_from_shape).is_touching) {
            touched.push_back(body.id);
        }
    }
    return touched;
}

inline NearestQueryAnswer oracle_nearest(const internal::QueryScene& scene, const Shape& shape,
                                         const Pose& pose, double max_distance,
                                         const QueryFilter& filter) {
    std::vector<NearestQueryAnswer> found;
    for (const std::uint32_t i : seen_by(filter, scene)) {
        const internal::QueryBody& body = scene.bodies[i];
        const PairDistanceAnswer d =
            signed_distance(shape, pose, *body.shape, body.world_from_shape);
        found.push_back({QueryStatus::complete, true, body.id, d.distance, d.point_a_world,
                         d.point_b_world, d.normal, d.part_b});
    }
    if (filter.include_ground) {
        const DistanceAnswer d = signed_distance(shape, pose, *scene.ground, max_distance);
        if (d.has_ground) {
            found.push_back({QueryStatus::complete, true, BodyId{}, d.distance, d.point_world,
                             d.point_world - d.distance * d.normal, d.normal, 0});
        }
    }
    NearestQueryAnswer none;
    none.status = QueryStatus::complete;
    const auto least =
        std::min_element(found.begin(), found.end(),
                         [](const auto& a, const auto& b) { return a.distance < b.distance; });
    return least == found.end() || least->distance > max_distance ? none : *least;
}

}  // namespace terrane::test
