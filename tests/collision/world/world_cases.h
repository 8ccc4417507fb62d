// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/body_queries.h"
#include "collision/ground/ground_cases.h"
#include "collision/pairs/compound_cases.h"

#include <cmath>
#include <ostream>
#include <string>
#include <vector>

// Random scenes of bodies over rough ground, and random queries.
namespace terrane::test {

enum class Layout {
    spread,  ///< about one body in 30 cubic metres
    pile,    ///< all at one position
    twins,   ///< as spread; every other body copies the shape and pose of the previous one
    far,     ///< as spread, 1e7 m east and north of the origin
};

struct SceneCase {
    Layout layout;
    int count;
};

inline std::string name_of(const SceneCase& c) {
    static constexpr std::array<const char*, 4> kNames = {"spread", "pile", "twins", "far"};
    return std::to_string(c.count) + "_" + kNames[static_cast<std::size_t>(c.layout)];
}
inline void PrintTo(const SceneCase& c, std::ostream* out) { *out << name_of(c); }

inline const std::vector<SceneCase>& scene_cases() {
    static const std::vector<SceneCase> cases = {
        {Layout::spread, 0},   {Layout::spread, 1}, {Layout::spread, 2}, {Layout::spread, 50},
        {Layout::spread, 500}, {Layout::pile, 50},  {Layout::twins, 50}, {Layout::far, 50}};
    return cases;
}

inline const FarGround& rough_grounds() {
    static const FarGround grounds;
    return grounds;
}

/// Bodies of all five shapes and meshes; some slots are empty, some bodies are sensors.
class TestScene {
public:
    TestScene(Random& random, const SceneCase& c)
        : width_(c.layout == Layout::pile ? 0.0 : 3.0 * std::cbrt(c.count)),
          centre_(64.0, 64.0, 0.4 * width_),
          ground_(c.layout == Layout::far ? rough_grounds().far : rough_grounds().near) {
        if (c.layout == Layout::far) {
            centre_ += Eigen::Vector3d(FarGround::kShift, FarGround::kShift, 0.0);
        }
        for (int i = 0; i < c.count; ++i) {
            internal::QueryBody body;
            if (random.below(12) > 0) body.shape = &any_shape(random);
            body.world_from_shape = any_pose(random);
            if (c.layout == Layout::twins && i % 2 == 1) body = bodies_.back();
            body.id = {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(random.below(3))};
            body.filter.layers = 1u << random.below(3);
            body.is_sensor = random.below(6) == 0;
            bodies_.push_back(body);
        }
        tree_.build(find_bounds());
    }

    static const Shape& any_shape(Random& random) {
        return others_of(random.below(6))[static_cast<std::size_t>(random.below(200))];
    }
    WorldPos any_place(Random& random, double beyond = 0.0) const {
        const double half = 0.5 * width_ + beyond;
        const double x = random.between(-half, half), y = random.between(-half, half);
        const double z = random.between(-half, half);
        return centre_ + Eigen::Vector3d(x, y, z);
    }
    /// End of a ray: occasionally its start, otherwise beyond a body or anywhere.
    WorldPos any_target(Random& random, const WorldPos& from) const {
        if (random.below(8) == 0) return from;
        if (bodies_.empty() || random.below(3) == 0) return any_place(random, 4.0);
        const Eigen::Vector3d there = any_body(random).world_from_shape.translation - from;
        return from + random.between(0.5, 3.0) * there;
    }
    Pose any_pose(Random& random, double beyond = 0.0) const {
        Pose pose;
        if (random.below(3) > 0) pose.rotation = random.rotation();
        pose.translation = any_place(random, beyond);
        return pose;
    }
    /// Usually near a body.
    Pose any_near_pose(Random& random) const {
        Pose pose = any_pose(random, 3.0);
        if (!bodies_.empty() && random.below(4) > 0) {
            pose.translation = any_body(random).world_from_shape.translation +
                               random.between(0.0, 1.5) * random.direction();
        }
        return pose;
    }
    /// Usually towards a body; some rotate, some do not translate.
    Motion any_motion(Random& random) const {
        Motion motion{.start = any_pose(random, 2.0)};
        const WorldPos to = any_near_pose(random).translation;
        const Eigen::Vector3d there = to - motion.start.translation;
        if (random.below(6) > 0) motion.translation = random.between(0.5, 1.5) * there;
        if (random.below(2) == 0) motion.rotation_vector = 2.0 * random.direction();
        return motion;
    }
    QueryFilter any_filter(Random& random) const {
        QueryFilter filter;
        if (random.below(2) == 0) filter.layers = static_cast<std::uint32_t>(random.below(8));
        if (!bodies_.empty() && random.below(2) == 0) filter.except = any_body(random).id;
        filter.include_sensors = random.below(2) == 0;
        filter.include_ground = random.below(6) == 0;  // the most expensive part
        return filter;
    }
    const internal::QueryBody& any_body(Random& random) const {
        return bodies_[static_cast<std::size_t>(random.below(static_cast<int>(bodies_.size())))];
    }

    /// Moves some bodies, empties some slots, fills others, and refits the tree.
    void move(Random& random) {
        for (internal::QueryBody& body : bodies_) {
            if (random.below(3) == 0) body.world_from_shape = any_pose(random, 3.0);
            if (random.below(10) == 0) body.shape = nullptr;
            if (random.below(10) == 0) body.shape = &any_shape(random);
        }
        tree_.refit(find_bounds());
    }

    internal::QueryScene scene() const { return {bodies_, &tree_, &ground_}; }
    std::span<internal::QueryBody> bodies() { return bodies_; }
    const Ground& ground() const { return ground_; }
    /// Must follow changes of bodies().
    void build() { tree_.build(find_bounds()); }

private:
    std::vector<Aabb> find_bounds() const {
        std::vector<Aabb> bounds;
        for (const internal::QueryBody& body : bodies_) {
            bounds.push_back(body.shape != nullptr
                                 ? internal::compute_aabb(*body.shape, body.world_from_shape)
                                 : Aabb{{1.0, 1.0, 1.0}, {-1.0, -1.0, -1.0}});
        }
        return bounds;
    }

    double width_;
    WorldPos centre_;
    Ground ground_;
    std::vector<internal::QueryBody> bodies_;
    internal::BodyTree tree_;
};

/// Bodies that a filter admits, by slot.
inline std::vector<std::uint32_t> seen_by(const QueryFilter& filter,
                                          const internal::QueryScene& scene) {
    std::vector<std::uint32_t> seen;
    for (std::uint32_t i = 0; i < scene.bodies.size(); ++i) {
        const internal::QueryBody& body = scene.bodies[i];
        if (body.shape == nullptr || body.id == filter.except) continue;
        if (body.is_sensor && !filter.include_sensors) continue;
        if ((body.filter.layers & filter.layers) == 0) continue;
        seen.push_back(i);
    }
    return seen;
}

/// Number of queries of a scene: fewer where brute force is slow.
inline int query_count(const SceneCase& c) {
    if (c.layout == Layout::pile) return 10;
    return c.count == 50 ? 60 : 25;
}

}  // namespace terrane::test
