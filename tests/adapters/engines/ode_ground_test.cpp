// SPDX-License-Identifier: MIT
#include "adapters/adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/ode_ground.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <vector>

namespace terrane {
namespace ode_ground_test {

using adapters::OdeGround;
using adapters::OdeGroundSettings;
using test::Random;

constexpr double kDt = 1.0 / 60.0;

// A world with a ground; its step collides every geometry with the ground.
class Scene {
public:
    explicit Scene(OdeGroundSettings settings = {}) {
        dInitODE2(0);
        dAllocateODEDataForThread(dAllocateFlagCollisionData);
        world_ = dWorldCreate();
        dWorldSetGravity(world_, 0, 0, dReal(-9.81));
        space_ = dHashSpaceCreate(nullptr);
        joints_ = dJointGroupCreate(0);
        ground_.emplace(OdeGround::make_class(), std::move(settings));
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
    ~Scene() {
        ground_.reset();
        dJointGroupDestroy(joints_);
        dSpaceDestroy(space_);
        dWorldDestroy(world_);
        dCloseODE();
    }
    OdeGround& ground() { return *ground_; }
    dWorldID world() { return world_; }
    dSpaceID space() { return space_; }

    dBodyID add(dGeomID geom, double x, double y, double z) {
        const dBodyID body = dBodyCreate(world_);
        dMass mass;
        dMassSetSphere(&mass, 100, dReal(0.5));
        dBodySetMass(body, &mass);
        dGeomSetBody(geom, body);
        dBodySetPosition(body, dReal(x), dReal(y), dReal(z));
        return body;
    }
    dBodyID add_sphere(double radius, double x, double y, double z) {
        return add(dCreateSphere(space_, dReal(radius)), x, y, z);
    }
    void step(const Ground& ground) {
        ground_->update(ground, kDt);
        dSpaceCollide2(ground_->geom(), reinterpret_cast<dGeomID>(space_), this, &near);
        dWorldQuickStep(world_, dReal(kDt));
        dJointGroupEmpty(joints_);
    }
    double clearance(dBodyID body) {
        const WorldPos p = ground_->to_world(dBodyGetPosition(body));
        return p.z() - ground_->ground()->height(p.x(), p.y()).height;
    }

private:
    static void near(void* data, dGeomID a, dGeomID b) {
        auto& scene = *static_cast<Scene*>(data);
        std::array<dContact, 16> contacts{};
        const int count = dCollide(a, b, 16, &contacts[0].geom, sizeof(dContact));
        for (int i = 0; i < count; ++i) {
            dContact& contact = contacts[static_cast<std::size_t>(i)];
            contact.surface.mode = dContactApprox1;
            contact.surface.mu = dReal(0.8);
            const dJointID joint = dJointCreateContact(scene.world_, scene.joints_, &contact);
            dJointAttach(joint, dGeomGetBody(contact.geom.g1), dGeomGetBody(contact.geom.g2));
        }
    }

    dWorldID world_ = nullptr;
    dSpaceID space_ = nullptr;
    dJointGroupID joints_ = nullptr;
    std::optional<OdeGround> ground_;
};

int collide(dGeomID a, dGeomID b, std::vector<dContactGeom>& contacts_out) {
    contacts_out.resize(16);
    const int count = dCollide(a, b, 16, contacts_out.data(), sizeof(dContactGeom));
    contacts_out.resize(static_cast<std::size_t>(count));
    return count;
}

TEST(OdeGround, GivesContactsThatPointOutOfTheGroundInEitherOrder) {
    Scene scene;
    scene.ground().update(test::make_test_ground([](double, double) { return 2.0; }, 1.0, 1), kDt);
    const dGeomID sphere = dCreateSphere(scene.space(), dReal(0.5));
    dGeomSetPosition(sphere, dReal(60.3), dReal(60.4), dReal(2.4));
    std::vector<dContactGeom> contacts;
    ASSERT_GE(collide(scene.ground().geom(), sphere, contacts), 1);
    EXPECT_NEAR(contacts[0].depth, 0.1, 1e-6);
    EXPECT_NEAR(contacts[0].normal[2], -1.0, 1e-6) << "into the first geometry";
    EXPECT_EQ(contacts[0].g2, sphere);
    ASSERT_GE(collide(sphere, scene.ground().geom(), contacts), 1);
    EXPECT_NEAR(contacts[0].normal[2], 1.0, 1e-6);
    EXPECT_EQ(contacts[0].g1, sphere);
}

TEST(OdeGround, LetsNoDroppedBodyFallThrough) {
    Scene scene;
    const Ground ground = test::hilly_ground();
    Random random(5);
    std::vector<dBodyID> bodies;
    for (int i = 0; i < 60; ++i) {
        const double x = random.between(20.0, 230.0), y = random.between(20.0, 230.0);
        const dGeomID geom = i % 3 == 0 ? dCreateSphere(scene.space(), dReal(0.4))
                             : i % 3 == 1
                                 ? dCreateCapsule(scene.space(), dReal(0.3), dReal(0.8))
                                 : dCreateBox(scene.space(), dReal(0.8), dReal(0.6), dReal(0.5));
        bodies.push_back(scene.add(geom, x, y, random.between(5.0, 9.0)));
    }
    for (int i = 0; i < 180; ++i) scene.step(ground);
    for (const dBodyID body : bodies) EXPECT_GT(scene.clearance(body), 0.0);
    EXPECT_EQ(scene.ground().counts().refused, 0u);
    EXPECT_EQ(scene.ground().needs().size(), bodies.size());
}

TEST(OdeGround, PushesOutABodyThatIsUnderTheSurface) {
    Scene scene;
    const Ground ground = test::hilly_ground();
    const dBodyID body = scene.add_sphere(0.5, 80, 80, ground.height(80, 80).height - 3.0);
    for (int i = 0; i < 300; ++i) scene.step(ground);
    EXPECT_GT(scene.clearance(body), 0.2);
}

TEST(OdeGround, HoldsABodyOverAbsentGroundUntilItIsThere) {
    OdeGroundSettings settings;
    settings.on_held = [](dBodyID, bool) { throw std::runtime_error("thrown"); };
    Scene scene(settings);
    const Ground without =
        test::hilly_ground([](int column, int row) { return column + row != 2; });
    const dBodyID over = scene.add_sphere(0.5, 180, 180, 5);
    const dBodyID moving = scene.add_sphere(0.5, 120, 180, 4);
    dBodySetLinearVel(over, 0, 0, -2);
    dBodySetLinearVel(moving, 60, 0, 0);
    for (int i = 0; i < 60; ++i) scene.step(without);
    EXPECT_TRUE(scene.ground().is_held(over));
    EXPECT_EQ(dBodyGetPosition(over)[2], dReal(5));
    EXPECT_TRUE(scene.ground().is_held(moving));
    EXPECT_LT(dBodyGetPosition(moving)[0], dReal(128));
    EXPECT_EQ(scene.ground().counts().failed_callbacks, 2u);
    ASSERT_EQ(scene.ground().needs().size(), 2u);
    EXPECT_TRUE(scene.ground().needs()[0].is_waiting);

    scene.step(test::hilly_ground());
    EXPECT_EQ(scene.ground().held_count(), 0u);
    EXPECT_LT(dBodyGetLinearVel(over)[2], dReal(-1.9)) << "its velocity is given back";
    const Ground with = test::hilly_ground();
    for (int i = 0; i < 300; ++i) scene.step(with);
    EXPECT_GT(scene.clearance(over), 0.2);
}

TEST(OdeGround, AnswersRaysAsTheGround) {
    Scene scene;
    const Ground ground = test::hilly_ground();
    scene.ground().update(ground, kDt);
    const dGeomID ray = dCreateRay(nullptr, 1);
    Random random(9);
    std::vector<dContactGeom> contacts;
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
        const WorldPos from(random.between(5.0, 250.0), random.between(5.0, 250.0), 8.0);
        const Eigen::Vector3d along = random.direction();
        dGeomRaySet(ray, dReal(from.x()), dReal(from.y()), dReal(from.z()), dReal(along.x()),
                    dReal(along.y()), dReal(along.z()));
        dGeomRaySetLength(ray, 100);
        const RayAnswer expected = ground.ray(from, from + 100.0 * along);
        const int count = collide(ray, scene.ground().geom(), contacts);
        ASSERT_EQ(count, expected.status == QueryStatus::ok ? 1 : 0);
        if (count == 0) continue;
        ++hits;
        EXPECT_NEAR(contacts[0].depth, 100.0 * expected.fraction, 1e-3);
        EXPECT_NEAR(contacts[0].normal[2], expected.normal.z(), 1e-5);
    }
    dGeomDestroy(ray);
    EXPECT_GT(hits, 50);
}

// ODE's own height field tests a sphere against vertices, edges and planes of cells near its lowest point.
TEST(OdeGround, FindsTheShallowContactsThatOdesHeightFieldMisses) {
    constexpr int kSide = 129;
    Scene scene;
    const auto rough = [](double x, double y) { return 2.0 * test::hills(2.0 * x, 2.0 * y); };
    const Ground ground = test::make_test_ground(rough, 1.0, 1);
    scene.ground().update(ground, kDt);
    // y up, z to the south: the same samples, row by row from the north
    std::vector<float> heights;
    for (int row = kSide - 1; row >= 0; --row) {
        for (int column = 0; column < kSide; ++column)
            heights.push_back(static_cast<float>(rough(column, row)));
    }
    const dHeightfieldDataID data = dGeomHeightfieldDataCreate();
    dGeomHeightfieldDataBuildSingle(data, heights.data(), 0, kSide - 1, kSide - 1, kSide, kSide, 1,
                                    0, 1, 0);
    const dGeomID field = dCreateHeightfield(nullptr, data, 0);
    const dGeomID ours = dCreateSphere(nullptr, dReal(0.5)),
                  theirs = dCreateSphere(nullptr, dReal(0.5));
    Random random(13);
    std::vector<dContactGeom> contacts;
    int touching = 0, missed = 0, missed_by_ode = 0;
    for (int i = 0; i < 3000; ++i) {
        const double x = random.between(10.0, 118.0), y = random.between(10.0, 118.0);
        // lowered until it touches: the two cut cells differently, so a cell of the same cut is looked at
        const std::int64_t column = ground.column_at(x), row = ground.row_at(y);
        if (!cut_to_north_east(column, row)) continue;
        Pose pose;
        pose.translation = {x, y, 20.0};
        pose.translation.z() += compute_lift(Sphere{0.5}, pose, ground).lift - 2e-3;
        const auto distance = signed_distance(Sphere{0.5}, pose, ground, 1.0);
        // touching by 1 mm or so with its cell's own triangles
        if (!(distance.distance < -1e-4) || ground.column_at(distance.point_world.x()) != column ||
            ground.row_at(distance.point_world.y()) != row) {
            continue;
        }
        ++touching;
        const WorldPos& p = pose.translation;
        dGeomSetPosition(ours, dReal(p.x()), dReal(p.y()), dReal(p.z()));
        dGeomSetPosition(theirs, dReal(p.x() - 64.0), dReal(p.z()), dReal(64.0 - p.y()));
        if (collide(ours, scene.ground().geom(), contacts) == 0) ++missed;
        if (collide(theirs, field, contacts) == 0) ++missed_by_ode;
    }
    std::cout << "touching " << touching << ", missed by Terrane " << missed
              << ", by ODE's height field " << missed_by_ode << "\n";
    EXPECT_GT(touching, 500);
    EXPECT_EQ(missed, 0);
    EXPECT_GT(missed_by_ode, 0)
        << "ODE's height field has become better: say so in docs/adapters.md";
    for (const dGeomID geom : {ours, theirs, field}) dGeomDestroy(geom);
    dGeomHeightfieldDataDestroy(data);
}

TEST(OdeGround, CountsWhatItDoesNotSupportAndSurvivesBadPlaces) {
    Scene scene;
    scene.ground().update(test::hilly_ground(), kDt);
    std::vector<dContactGeom> contacts;
    const dGeomID cylinder = dCreateCylinder(scene.space(), 1, 1);
    dGeomSetPosition(cylinder, 60, 60, 0);
    EXPECT_EQ(collide(scene.ground().geom(), cylinder, contacts), 0);
    EXPECT_EQ(scene.ground().counts().unsupported, 1u);
    const dGeomID sphere = dCreateSphere(scene.space(), 1);
    dGeomSetPosition(sphere, std::numeric_limits<dReal>::quiet_NaN(), 0, 0);
    EXPECT_EQ(collide(scene.ground().geom(), sphere, contacts), 0);
    dGeomSetPosition(sphere, dReal(1e9), dReal(1e9), 0);
    EXPECT_EQ(collide(scene.ground().geom(), sphere, contacts), 0);
    const dGeomID huge = dCreateBox(scene.space(), dReal(1e9), dReal(1e9), dReal(1e9));
    EXPECT_EQ(collide(scene.ground().geom(), huge, contacts), 0);
    EXPECT_GE(scene.ground().counts().refused, 1u) << "a box of 1e9 m is no shape of Terrane";
}

TEST(OdeGround, CarriesBodiesOnVolumesInAFarFrame) {
    Scene scene({.origin_world = WorldPos(40.0, 40.0, 1.0)});
    const Ground ground = test::slab_ground();
    const dBodyID on = scene.add_sphere(0.5, 0, 0, 6);
    const dBodyID under = scene.add_sphere(0.5, 4, 4, 1);
    for (int i = 0; i < 150; ++i) scene.step(ground);
    EXPECT_NEAR(dBodyGetPosition(on)[2], 4.5, 0.05);
    EXPECT_NEAR(dBodyGetPosition(under)[2], -0.5, 0.05);
}

}  // namespace ode_ground_test
}  // namespace terrane
