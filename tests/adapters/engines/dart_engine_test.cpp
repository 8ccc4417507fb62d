// SPDX-License-Identifier: MIT
//
// DART itself with its Bullet detector on a window of ground.
#include "adapters/adapter_grounds.h"

#include <terrane/adapters/dart_window.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>

#if TERRANE_TEST_DART
// not dart.hpp, which includes readers of files that need other libraries
#include <dart/collision/bullet/BulletCollisionDetector.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/HeightmapShape.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
#endif

namespace terrane::adapters {
namespace dart_engine_test {

#if TERRANE_TEST_DART

using Shape = dart::dynamics::HeightmapShapef;

// A ball of radius 0.5 on a window, in steps of 2 ms.
struct Simulation {
    Simulation(std::int32_t cells, const Eigen::Vector3d& place)
        : window(
              DartWindow<Shape>::create({.columns = cells, .rows = cells, .margin = 4}).value()) {
        world->getConstraintSolver()->setCollisionDetector(
            dart::collision::BulletCollisionDetector::create());
        world->setTimeStep(0.002);
        world->setGravity(Eigen::Vector3d(0, 0, -9.81));
        const auto ground = dart::dynamics::Skeleton::create("ground");
        auto* const body = ground->createJointAndBodyNodePair<dart::dynamics::WeldJoint>().second;
        node = body->createShapeNodeWith<dart::dynamics::CollisionAspect,
                                         dart::dynamics::DynamicsAspect>(shape);
        ground->setMobile(false);
        const auto skeleton = dart::dynamics::Skeleton::create("ball");
        ball = skeleton->createJointAndBodyNodePair<dart::dynamics::FreeJoint>().second;
        ball->createShapeNodeWith<dart::dynamics::CollisionAspect, dart::dynamics::DynamicsAspect>(
            std::make_shared<dart::dynamics::SphereShape>(0.5));
        // a solid ball of 1 kg: DART's default is the inertia of a much larger body, which hardly rolls
        ball->setInertia(dart::dynamics::Inertia(1.0, Eigen::Vector3d::Zero(),
                                                 0.1 * Eigen::Matrix3d::Identity()));
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.translation() = place;
        static_cast<dart::dynamics::FreeJoint*>(skeleton->getJoint(0))->setTransform(pose);
        world->addSkeleton(ground);
        world->addSkeleton(skeleton);
    }
    DartWindowUpdate step(const Ground& ground) {
        const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5);
        const std::array boxes{Aabb{position() - half, position() + half}};
        const DartWindowUpdate update = window.update(*shape, ground, boxes);
        if (update.has_changed) node->setRelativeTranslation(update.translation_sim);
        world->step();
        return update;
    }
    Eigen::Vector3d position() const { return ball->getTransform().translation(); }

    dart::simulation::WorldPtr world = dart::simulation::World::create();
    std::shared_ptr<Shape> shape = std::make_shared<Shape>();
    dart::dynamics::ShapeNode* node = nullptr;
    dart::dynamics::BodyNode* ball = nullptr;
    DartWindow<Shape> window;
};

TEST(DartEngine, RestsOnFlatGroundAtItsHeight) {
    const Ground ground = test::make_test_ground([](double, double) { return 12.0; });
    Simulation simulation(32, {60.0, 70.0, 12.8});
    for (int i = 0; i < 1000; ++i) ASSERT_EQ(simulation.step(ground).unsupported_boxes, 0);
    EXPECT_NEAR(simulation.position().z(), 12.5, 0.02);
}

TEST(DartEngine, RollsDownASlopeWhileTheWindowMoves) {
    const Ground ground = test::make_test_ground(test::plane_height);
    Simulation simulation(24, {100.0, 30.0, test::plane_height(100.0, 30.0) + 0.55});
    int changes = 0;
    for (int i = 0; i < 2500; ++i) {
        changes += simulation.step(ground).has_changed ? 1 : 0;
        const Eigen::Vector3d p = simulation.position();
        const double gap =
            (p.z() - test::plane_height(p.x(), p.y())) * test::plane_normal().z() - 0.5;
        ASSERT_NEAR(gap, 0.0, 0.06) << "step " << i;
    }
    EXPECT_GE(changes, 3);
    EXPECT_LT(simulation.position().x(), 85.0);
}

#else

TEST(DartEngine, IsInstalled) {
    GTEST_SKIP() << "DART and its Bullet detector were not found: apt-get install "
                    "libdart-collision-bullet-dev libdart-external-ikfast-dev";
}

#endif

}  // namespace dart_engine_test
}  // namespace terrane::adapters
