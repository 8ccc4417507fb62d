// SPDX-License-Identifier: MIT
#pragma once

// Terrane's ground as a Bullet shape (2.8x and 3.x), float or double (BT_USE_DOUBLE_PRECISION). The including project
// links Bullet; Terrane does not.
//
// Units:  metres, seconds, kilograms, as Terrane; z is up, so set gravity to (0, 0, -9.81).
// Frame:  shape = world - origin, axes as the world's. The origin is double. With a float Bullet, keep it within a few
//         kilometres of the bodies (at 8 km a float resolves 0.5 mm). The collision object's transform is identity.
// Ground: the shape reads one immutable Ground. Call set_ground(frame.ground) before each stepSimulation(), with the
//         frame of the last Terrain::update().
// Absent: ground that is not resident has no triangles. bullet_bodies.h holds bodies over it so that they do not fall
//         through. This shape counts queries that reach absent ground, and calls on_absent.
// Edges:  with triangles alone, Bullet produces ghost contacts at inner edges, as for its own height field.
//         bullet_contacts.h replaces the contacts of spheres, capsules and boxes by Terrane's, which have none.
// Volumes: the shape contains the joined surface's triangles in place of the heightfield's (SolidSurface).
//
// Threads: set_ground() and set_origin() between steps; Bullet may query from any number of threads.

#include <terrane/adapters/ground_triangles.h>

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>
#include <LinearMath/btAabbUtil2.h>

#include <atomic>
#include <functional>
#include <optional>
#include <utility>

namespace terrane::adapters {

/// Settings of a BulletGround.
struct BulletGroundSettings {
    WorldPos origin_world = WorldPos::Zero();  ///< origin of the shape's frame
    /// Limit on cells under a query's box, at least 1; queries over more cells are refused and counted.
    std::int64_t most_cells = kMostVisitedCells;
    /// Called when a query reaches absent ground, with the query's box (for a ray, its bounding box), from any of
    /// Bullet's threads. Exceptions are caught and counted.
    std::function<void(const Aabb& box_world)> on_absent = {};
};

/// Event counts of a BulletGround since its creation.
struct BulletGroundCounts {
    std::uint64_t absent = 0;   ///< queries that reached absent ground
    std::uint64_t refused = 0;  ///< queries not finite or over too many cells: no triangles
    std::uint64_t failed_callbacks = 0;  ///< calls of on_absent that threw
};

/// The contact surface for static btRigidBody and btCollisionObject. Local scaling is ignored: it stays 1.
class BulletGround final : public btConcaveShape {
public:
    /// Creates a shape without a ground: see set_ground().
    explicit BulletGround(BulletGroundSettings settings = {}) : settings_(std::move(settings)) {
        m_shapeType = kShapeType;
    }

    /// Sets the current ground. Without one there are no triangles.
    void set_ground(Ground ground) { ground_ = std::move(ground); }
    /// The current ground; null before the first set_ground().
    const Ground* ground() const { return ground_ ? &*ground_ : nullptr; }
    /// Moves the origin of the shape's frame. The caller must shift the bodies by the opposite translation and update
    /// the broadphase (btCollisionWorld::updateSingleAabb).
    void set_origin(const WorldPos& origin_world) { settings_.origin_world = origin_world; }
    /// Origin of the frame, world.
    const WorldPos& origin_world() const { return settings_.origin_world; }
    /// Event counts since creation.
    BulletGroundCounts counts() const { return {absent_, refused_, failed_callbacks_}; }

    /// Transforms a point from the shape's frame to the world.
    WorldPos to_world(const btVector3& p) const {
        return settings_.origin_world + Eigen::Vector3d(p.x(), p.y(), p.z());
    }
    /// Transforms a point from the world to the shape's frame; rounds once to btScalar.
    btVector3 to_shape(const WorldPos& p_world) const {
        return to_bullet(p_world - settings_.origin_world);
    }
    /// Converts a vector to Bullet's precision.
    static btVector3 to_bullet(const Eigen::Vector3d& v) {
        return btVector3(static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()),
                         static_cast<btScalar>(v.z()));
    }

    /// Passes the triangles that may touch a box to the callback. For the heightfield, partId is the cell's column, and
    /// triangleIndex is twice its row, plus 1 for the northern triangle; both are the low 31 bits of indices from
    /// lattice point (0, 0). For volumes, partId is -1, and triangleIndex is the triangle's index in its SolidSurface.
    ///
    /// If RTTI is enabled, rays of btCollisionWorld::rayTest() are recognised and traced along the surface, so that
    /// their cost does not grow with the area of their bounding box. A ray that reaches absent ground before any hit
    /// has no hit.
    void processAllTriangles(btTriangleCallback* callback, const btVector3& aabb_min,
                             const btVector3& aabb_max) const override {
        if (!ground_) return;
#if defined(__cpp_rtti) || defined(__GXX_RTTI)
        if (auto* const ray = dynamic_cast<btTriangleRaycastCallback*>(callback)) {
            process_ray(*ray);
            return;
        }
#endif
        process_box(*callback, {to_world(aabb_min), to_world(aabb_max)}, true);
    }

    /// Bounding box of the ground's extent and of heights within +-kMostHeight.
    void getAabb(const btTransform& t, btVector3& aabb_min, btVector3& aabb_max) const override {
        const WorldRect extent = ground_ ? ground_->extent() : WorldRect{};
        const double z = settings_.origin_world.z();
        btTransformAabb(to_shape({extent.west, extent.south, z - kMostHeight}),
                        to_shape({extent.east, extent.north, z + kMostHeight}), getMargin(), t,
                        aabb_min, aabb_max);
    }

    /// Does nothing: the scale stays 1.
    void setLocalScaling(const btVector3&) override {}
    /// Returns (1, 1, 1).
    const btVector3& getLocalScaling() const override {
        static const btVector3 one(1, 1, 1);
        return one;
    }
    /// Returns 0: the ground is static.
    void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
    /// A concave shape type that no Bullet class uses. Bullet 3 uses CUSTOM_CONCAVE_SHAPE_TYPE for btSdfCollisionShape.
    static constexpr int kShapeType = FAST_CONCAVE_MESH_PROXYTYPE;
    /// Identifies this class without RTTI: the address is unique.
    const char* getName() const override { return kName; }
    /// Whether a shape is a BulletGround.
    static bool is(const btCollisionShape& shape) {
        return shape.getShapeType() == kShapeType && shape.getName() == kName;
    }

    /// Counts a query that reached absent ground, and calls on_absent.
    void report_absent(const Aabb& box_world) const {
        ++absent_;
        if (!settings_.on_absent) return;
        try {
            settings_.on_absent(box_world);
        } catch (...) {
            ++failed_callbacks_;
        }
    }
    /// Counts a refused query.
    void report_refused() const { ++refused_; }

private:
    static constexpr char kName[] = "TerraneGround";

    void process_box(btTriangleCallback& callback, const Aabb& box_world, bool is_counted) const {
        const auto low_bits = [](std::int64_t i) { return static_cast<int>(i & 0x7fffffff); };
        const TriangleReport report = visit_triangles(
            *ground_, box_world, settings_.origin_world, settings_.most_cells,
            [&](const GroundTriangle& t) {
                btVector3 corners[3] = {to_bullet(t.corners[0]), to_bullet(t.corners[1]),
                                        to_bullet(t.corners[2])};
                const bool is_solid = t.part == TrianglePart::solid;
                const int part = is_solid ? -1 : low_bits(t.column);
                const int index = is_solid ? static_cast<int>(t.solid_index)
                                           : low_bits(2 * t.row + (t.part == TrianglePart::north));
                callback.processTriangle(corners, part, index);
            });
        if (!is_counted) return;
        if (report.is_refused) report_refused();
        if (report.meets_absent) report_absent(box_world);
    }

    // Passes the triangles around each hit, nearest first, until the callback accepts one: it may reject back faces.
    void process_ray(btTriangleRaycastCallback& ray) const {
        const WorldPos from = to_world(ray.m_from), to = to_world(ray.m_to);
        if (!from.allFinite() || !to.allFinite()) {
            report_refused();
            return;
        }
        const double length = (to - from).norm();
        const double around = 1e-3 * ground_->spacing() + 1e-6 * (ray.m_from.length() + length);
        constexpr int kMostHits = 1000;
        double begin = 0.0;
        for (int hits = 0; hits < kMostHits && begin <= 1.0; ++hits) {
            const RayAnswer hit = ground_->ray(from + begin * (to - from), to);
            if (hit.status == QueryStatus::not_resident)
                report_absent({from.cwiseMin(to), from.cwiseMax(to)});
            if (hit.status == QueryStatus::invalid) report_refused();
            if (hit.status != QueryStatus::ok) return;
            const double fraction = begin + (1.0 - begin) * hit.fraction;
            if (fraction > static_cast<double>(ray.m_hitFraction)) return;
            const Eigen::Vector3d half = Eigen::Vector3d::Constant(around);
            process_box(ray, {hit.point_world - half, hit.point_world + half}, false);
            if (static_cast<double>(ray.m_hitFraction) * length <= fraction * length + 2.0 * around)
                return;
            if (length == 0.0) return;
            begin = fraction + around / length;
        }
    }

    BulletGroundSettings settings_;
    std::optional<Ground> ground_;
    mutable std::atomic<std::uint64_t> absent_{0}, refused_{0}, failed_callbacks_{0};
};

}  // namespace terrane::adapters
