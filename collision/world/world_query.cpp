// SPDX-License-Identifier: MIT
// Spatial queries of a world. The tree is made by the first query after a change, so that a world that is never asked
// has none.
#include "base/boxes.h"
#include "world/queries/body_bounds.h"
#include "world/world_state.h"

namespace terrane {
namespace {

/// A tree is built anew after so many refits: bodies that have moved far make its boxes large.
constexpr int kMaxRefits = 32;

}  // namespace

internal::QueryScene World::State::scene(const Ground& ground) const {
    if (!is_scene_current.load(std::memory_order_acquire)) {
        const std::lock_guard lock(scene_mutex);
        if (!is_scene_current.load(std::memory_order_relaxed)) {
            update_scene();
            is_scene_current.store(true, std::memory_order_release);
        }
    }
    return {query_bodies, &tree, &ground};
}

void World::State::update_scene() const {
    query_bodies.resize(bodies.size());
    query_bounds.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        query_bodies[i] = {};
        query_bounds[i] = internal::empty_box();
        if (!ids.is_used(i)) continue;
        const internal::RigidBody& body = bodies[i];
        query_bodies[i] = {&body_shapes[i], body.pose,      ids.id(i),
                           body.filter,     body.is_sensor, body.friction};
        query_bounds[i] = internal::compute_aabb(body_shapes[i], body.pose);
    }
    if (tree.slot_count() == bodies.size() && ++refit_count < kMaxRefits) {
        tree.refit(query_bounds);
    } else {
        tree.build(query_bounds);
        refit_count = 0;
    }
}

RayQueryAnswer World::ray(const Ground& ground, const WorldPos& from, const WorldPos& to,
                          const QueryFilter& filter) const {
    return internal::query_ray(state_->scene(ground), from, to, filter);
}

RayQueryAnswer World::ray(const RayFan& ground, const WorldPos& from, const WorldPos& to,
                          const QueryFilter& filter) const {
    if (ground.ground() == nullptr) return {};
    internal::QueryScene scene = state_->scene(*ground.ground());
    scene.fan = &ground;
    return internal::query_ray(scene, from, to, filter);
}

CastQueryAnswer World::cast(const Ground& ground, const Shape& shape, const Motion& motion,
                            const QueryFilter& filter) const {
    return internal::query_cast(state_->scene(ground), shape, motion, filter);
}

OverlapQueryAnswer World::overlaps(const Ground& ground, const Shape& shape,
                                   const Pose& world_from_shape, std::span<BodyId> bodies_out,
                                   const QueryFilter& filter) const {
    return internal::query_overlaps(state_->scene(ground), shape, world_from_shape, filter,
                                    bodies_out);
}

NearestQueryAnswer World::nearest(const Ground& ground, const Shape& shape,
                                  const Pose& world_from_shape, double max_distance,
                                  const QueryFilter& filter) const {
    return internal::query_nearest(state_->scene(ground), shape, world_from_shape, max_distance,
                                   filter);
}

}  // namespace terrane
