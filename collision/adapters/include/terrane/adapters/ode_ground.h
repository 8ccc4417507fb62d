// SPDX-License-Identifier: MIT
#pragma once

// Terrane's ground as a geometry class of ODE (0.13 and later), single or double precision. The including project links
// ODE; Terrane does not.
//
// Units:    metres, seconds, kilograms, as Terrane; z is up (ODE's own height field is y up), so set gravity to
//           (0, 0, -9.81).
// Frame:    ODE = world - origin, axes as the world's. The geometry has no pose: dGeomSetPosition and dGeomSetRotation
//           do not move it.
// Contacts: find_contacts() finds the contacts of spheres, capsules and boxes: the ground is solid below the surface,
//           depths are the overlaps along the normals, normals lie in the ground's normal cone. Ground::ray() traces
//           rays. Other classes (cylinders, convexes, meshes) get no contacts; their collisions count as unsupported.
// Volumes:  contacts and rays see the joined surface, as in find_contacts() and Ground::ray().
// Absent:   a body that may reach absent ground in the next step is held (disabled, with its velocity kept) until
//           update() finds its ground resident, so that nothing falls while it is loaded. needs() lists what to load.
//
// Each frame:  const Frame& frame = terrain.update(cameras, ground.needs(), time);
//              ground.update(frame.ground, dt);
//              dSpaceCollide2(ground.geom(), dGeomID(space), data, &near);   // or dSpaceCollide, with it in the space
//              dWorldQuickStep(world, dt);
//
// Threads:  one at a time for each ground, as for ODE's spaces.

#include <terrane/adapters/sphere_contacts.h>
#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/body_need.h>

#include <ode/ode.h>

#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace terrane::adapters {

/// Settings of an OdeGround.
struct OdeGroundSettings {
    WorldPos origin_world = WorldPos::Zero();  ///< origin of ODE's frame
    /// Called when a body becomes held or is released; exceptions are caught and counted.
    std::function<void(dBodyID, bool is_held)> on_held = {};
};

/// Event counts of an OdeGround since its creation.
struct OdeGroundCounts {
    std::uint64_t refused = 0;      ///< collisions with invalid poses, sizes or rays: no contacts
    std::uint64_t unsupported = 0;  ///< collisions with geometries of other classes: no contacts
    std::uint64_t absent_rays = 0;  ///< rays that reached absent ground before any hit: no hit
    std::uint64_t failed_callbacks = 0;  ///< calls of on_held that threw
};

/// An ODE geometry of the contact surface. Neither copyable nor movable: ODE holds its address.
class OdeGround {
public:
    /// Registers the geometry class with ODE and returns its number. Call once after each dInitODE2(); ODE supports 4
    /// user classes.
    static int make_class() {
        dGeomClass kind{};
        kind.bytes = sizeof(OdeGround*);
        kind.collider = [](int) -> dColliderFn* { return &OdeGround::collide; };
        kind.aabb = &OdeGround::aabb;
        return dCreateGeomClass(&kind);
    }

    /// @param class_number from make_class()
    explicit OdeGround(int class_number, OdeGroundSettings settings = {})
        : settings_(std::move(settings)), geom_(dCreateGeom(class_number)) {
        *static_cast<OdeGround**>(dGeomGetClassData(geom_)) = this;
    }
    OdeGround(const OdeGround&) = delete;
    OdeGround& operator=(const OdeGround&) = delete;
    /// Destroys the geometry; call before dCloseODE(). Held bodies stay disabled.
    ~OdeGround() { dGeomDestroy(geom_); }

    /// The geometry, for dCollide(), dSpaceAdd(), dSpaceCollide2().
    dGeomID geom() const { return geom_; }
    /// Sets the current ground and the length of the next step, seconds. Releases bodies whose ground is resident, and
    /// clears needs().
    void update(Ground ground, double dt) {
        ground_ = std::move(ground);
        dt_ = dt;
        needs_.clear();
        // makes the space recompute the AABB from the extent
        dGeomSetPosition(geom_, 0, 0, 0);
        for (std::size_t i = held_.size(); i-- > 0;) {
            const Held held = held_[i];
            if (meets_absent(held.box, held.velocity, held.body)) continue;
            held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(i));
            dBodyEnable(held.body);
            set_velocity(held.body, held.velocity, held.spin);
            tell(held.body, false);
        }
    }
    /// The current ground; null before the first update().
    const Ground* ground() const { return ground_ ? &*ground_ : nullptr; }
    /// Event counts since creation.
    OdeGroundCounts counts() const { return counts_; }
    /// Needs of the bodies tested for collision since the last update(), held ones included, for Terrain::update().
    std::span<const BodyNeed> needs() const { return needs_; }
    /// Number of bodies currently held.
    std::size_t held_count() const { return held_.size(); }
    /// Whether a body is currently held.
    bool is_held(dBodyID body) const { return find(body) != held_.size(); }
    /// Removes a body from the list of held bodies. Call before destroying the body.
    void forget(dBodyID body) {
        std::erase_if(held_, [&](const Held& held) { return held.body == body; });
    }

    /// Transforms a position from ODE's frame to the world.
    WorldPos to_world(const dReal* p) const {
        return settings_.origin_world + Eigen::Vector3d(p[0], p[1], p[2]);
    }

private:
    static constexpr std::size_t kMostContacts = 32;
    struct Held {
        dBodyID body;
        Aabb box;  // world
        Eigen::Vector3d velocity, spin;
    };

    static OdeGround& of(dGeomID geom) {
        return **static_cast<OdeGround**>(dGeomGetClassData(geom));
    }
    static void aabb(dGeomID geom, dReal box[6]) {
        const OdeGround& ground = of(geom);
        const WorldRect extent = ground.ground_ ? ground.ground_->extent() : WorldRect{};
        const Eigen::Vector3d& o = ground.settings_.origin_world;
        box[0] = static_cast<dReal>(extent.west - o.x());
        box[1] = static_cast<dReal>(extent.east - o.x());
        box[2] = static_cast<dReal>(extent.south - o.y());
        box[3] = static_cast<dReal>(extent.north - o.y());
        box[4] = static_cast<dReal>(-kMostHeight);
        box[5] = static_cast<dReal>(kMostHeight);
    }

    // ODE passes the ground first, whatever the order in dCollide().
    static int collide(dGeomID ground_geom, dGeomID other, int flags, dContactGeom* out, int skip) {
        OdeGround& ground = of(ground_geom);
        if (!ground.ground_) return 0;
        if (dGeomGetClass(other) == dRayClass) return ground.collide_ray(other, out);
        Shape shape;
        if (!ground.shape_of(other, shape)) {
            ++ground.counts_.unsupported;
            return 0;
        }
        if (ground.holds(other)) return 0;
        std::array<Contact, kMostContacts> contacts;
        const auto most = std::min(static_cast<std::size_t>(flags & 0xffff), kMostContacts);
        const ContactAnswer answer =
            ground.find(shape, other, std::span<Contact>(contacts.data(), most));
        if (answer.status == QueryStatus::invalid) {
            ++ground.counts_.refused;
            return 0;
        }
        for (std::size_t i = 0; i < answer.count; ++i) {
            const Contact& contact = contacts[i];
            auto& to = *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(out) +
                                                        i * static_cast<std::size_t>(skip));
            ground.write(to, other, contact.point_world, contact.normal, contact.depth);
        }
        return static_cast<int>(answer.count);
    }

    ContactAnswer find(const Shape& shape, dGeomID geom, std::span<Contact> contacts_out) const {
        if (const Sphere* const sphere = std::get_if<Sphere>(&shape)) {
            const auto answer = find_sphere_contacts(*ground_, to_world(dGeomGetPosition(geom)),
                                                     sphere->radius, 0.0, contacts_out);
            if (answer) return *answer;
        }
        return find_contacts(shape, pose_of(geom), *ground_, 0.0, contacts_out);
    }

    int collide_ray(dGeomID ray, dContactGeom* out) {
        dVector3 start, direction;
        dGeomRayGet(ray, start, direction);
        const auto length = static_cast<double>(dGeomRayGetLength(ray));
        const WorldPos from = to_world(start);
        const Eigen::Vector3d along(direction[0], direction[1], direction[2]);
        const RayAnswer hit = ground_->ray(from, from + length * along);
        if (hit.status == QueryStatus::invalid) ++counts_.refused;
        if (hit.status == QueryStatus::not_resident) ++counts_.absent_rays;
        if (hit.status != QueryStatus::ok) return 0;
        const bool is_below = hit.normal.dot(along) > 0.0;  // ODE's normals face the ray
        write(*out, ray, hit.point_world, is_below ? Eigen::Vector3d(-hit.normal) : hit.normal,
              hit.fraction * length);
        return 1;
    }

    // ODE's normals point into the first geometry, the ground.
    void write(dContactGeom& to, dGeomID other, const WorldPos& point,
               const Eigen::Vector3d& normal, double depth) const {
        const Eigen::Vector3d p = point - settings_.origin_world;
        for (int axis = 0; axis < 3; ++axis) {
            to.pos[axis] = static_cast<dReal>(p[axis]);
            to.normal[axis] = static_cast<dReal>(-normal[axis]);
        }
        to.depth = static_cast<dReal>(depth);
        to.g1 = geom_;
        to.g2 = other;
        to.side1 = to.side2 = -1;
    }

    bool shape_of(dGeomID geom, Shape& shape_out) const {
        switch (dGeomGetClass(geom)) {
            case dSphereClass:
                shape_out = Sphere{static_cast<double>(dGeomSphereGetRadius(geom))};
                return true;
            case dCapsuleClass: {
                dReal radius = 0, length = 0;
                dGeomCapsuleGetParams(geom, &radius, &length);
                shape_out = Capsule{static_cast<double>(radius), 0.5 * static_cast<double>(length)};
                return true;
            }
            case dBoxClass: {
                dVector3 sides;
                dGeomBoxGetLengths(geom, sides);
                shape_out = Box{0.5 * Eigen::Vector3d(sides[0], sides[1], sides[2])};
                return true;
            }
            default:
                return false;
        }
    }
    Pose pose_of(dGeomID geom) const {
        dQuaternion q;
        dGeomGetQuaternion(geom, q);
        Pose pose;
        pose.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
        pose.translation = to_world(dGeomGetPosition(geom));
        return pose;
    }

    // Records the need of a geometry's body, and holds the body if it may reach absent ground.
    bool holds(dGeomID geom) {
        const dBodyID body = dGeomGetBody(geom);
        if (body == nullptr || dBodyIsKinematic(body)) return false;
        dReal sides[6];
        dGeomGetAABB(geom, sides);
        const Aabb box{settings_.origin_world + Eigen::Vector3d(sides[0], sides[2], sides[4]),
                       settings_.origin_world + Eigen::Vector3d(sides[1], sides[3], sides[5])};
        const std::size_t index = find(body);
        const bool was_held = index != held_.size();
        const auto vector = [](const dReal* v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
        const Eigen::Vector3d velocity =
            was_held ? held_[index].velocity : vector(dBodyGetLinearVel(body));
        const bool is_absent = was_held || meets_absent(box, velocity, body);
        needs_.push_back({.centre_world = 0.5 * (box.low + box.high),
                          .velocity = velocity,
                          .radius = 0.5 * (box.high - box.low).norm(),
                          .is_waiting = is_absent});
        if (!is_absent) return false;
        if (!was_held) {
            held_.push_back({body, box, velocity, vector(dBodyGetAngularVel(body))});
            tell(body, true);
        }
        set_velocity(body, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
        dBodyDisable(body);  // in every step, because an awake neighbour re-enables it
        return true;
    }
    bool meets_absent(const Aabb& box, const Eigen::Vector3d& velocity, dBodyID body) const {
        dVector3 g = {0, 0, 0, 0};
        if (dBodyGetGravityMode(body) != 0) dWorldGetGravity(dBodyGetWorld(body), g);
        return may_meet_absent(*ground_, box,
                               dt_ * velocity + dt_ * dt_ * Eigen::Vector3d(g[0], g[1], g[2]));
    }
    std::size_t find(dBodyID body) const {
        std::size_t i = 0;
        while (i < held_.size() && held_[i].body != body) ++i;
        return i;
    }
    static void set_velocity(dBodyID body, const Eigen::Vector3d& v, const Eigen::Vector3d& spin) {
        const auto real = [](double value) { return static_cast<dReal>(value); };
        dBodySetLinearVel(body, real(v.x()), real(v.y()), real(v.z()));
        dBodySetAngularVel(body, real(spin.x()), real(spin.y()), real(spin.z()));
    }
    void tell(dBodyID body, bool is_held) {
        if (!settings_.on_held) return;
        try {
            settings_.on_held(body, is_held);
        } catch (...) {  // must not unwind through ODE's C frames
            ++counts_.failed_callbacks;
        }
    }

    OdeGroundSettings settings_;
    dGeomID geom_ = nullptr;
    std::optional<Ground> ground_;
    double dt_ = 0.0;
    OdeGroundCounts counts_;
    std::vector<Held> held_;
    std::vector<BodyNeed> needs_;
};

}  // namespace terrane::adapters
