// SPDX-License-Identifier: MIT
// Extreme sizes and arguments: the right answer, or status `invalid`.
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

namespace terrane {
namespace extremes_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260308;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Named = std::pair<const char*, Shape>;

std::vector<LawShape> make_all(std::initializer_list<Named> list) {
    std::vector<LawShape> made;
    for (const auto& [name, shape] : list) made.push_back({name, shape, make_oracle(shape)});
    return made;
}

std::vector<LawShape> small_shapes() {
    return make_all({
        {"point", Sphere{0.0}},
        {"capsule without a core", Capsule{0.4, 0.0}},
        {"segment", Capsule{0.0, 0.8}},
        {"capsule that is a point", Capsule{0.0, 0.0}},
        {"flat box", Box{{1.0, 1.5, 0.0}}},
        {"box that is a segment", Box{{0.0, 1.5, 0.0}}},
        {"box that is a point", Box{{0.0, 0.0, 0.0}}},
        {"box of a millimetre", Box{{0.0005, 0.0005, 0.0005}}},
        {"sphere of a millimetre", Sphere{0.0005}},
        {"needle", Box{{1e-6, 1e-6, 2.0}}},
    });
}

std::vector<LawShape> large_shapes() {
    return make_all({
        {"box larger than a chunk", Box{{90.0, 100.0, 1.0}}},
        {"box of ten kilometres", Box{{5000.0, 5000.0, 5000.0}}},
        {"sphere of ten kilometres", Sphere{5000.0}},
        {"capsule of ten kilometres", Capsule{100.0, 4900.0}},
    });
}

void expect_right_answers(std::uint64_t seed, const std::vector<const LawScene*>& scenes,
                          const std::vector<LawShape>& shapes, const std::vector<double>& lifts) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    std::array<Contact, 256> contacts;
    for (const LawScene* of : scenes) {
        const LawScene& scene = *of;
        for (const LawShape& shape : shapes) {
            for (const double lift : lifts) {
                const Pose pose = random_pose(random, scene, shape, lift);
                SCOPED_TRACE(describe(scene, shape, pose));
                const double expected = true_lift(scene, shape, pose);
                // 1e-9, and the rounding of coordinates of 5 km
                const double slack = 1e-9 + 1e-13 * bounding_radius(shape.shape);
                const LiftAnswer answer = compute_lift(shape.shape, pose, scene.ground);
                EXPECT_EQ(answer.status, QueryStatus::complete);
                EXPECT_NEAR(answer.lift, expected, slack);
                const DistanceAnswer distance =
                    signed_distance(shape.shape, pose, scene.ground, 1.0);
                EXPECT_EQ(distance.status, QueryStatus::complete);
                const ContactAnswer found =
                    find_contacts(shape.shape, pose, scene.ground, 0.0, contacts);
                EXPECT_NE(found.status, QueryStatus::invalid);
                if (lift > 0.0) {
                    EXPECT_LT(distance.distance, 0.0);
                    EXPECT_GE(distance.distance, -expected - slack);
                    EXPECT_GT(found.count, 0u);
                    EXPECT_FALSE(
                        is_deeper<long double>(scene.soup, shape.oracle, pose,
                                               -static_cast<long double>(distance.distance) *
                                                   distance.normal.cast<long double>(),
                                               static_cast<long double>(slack)));
                } else if (lift == 0.0) {
                    EXPECT_NEAR(distance.distance, 0.0, slack);
                } else {
                    EXPECT_GT(distance.distance, 0.0);
                    EXPECT_LE(distance.distance, -expected + slack);
                }
                const bool is_touching = test_contact(shape.shape, pose, scene.ground).is_touching;
                EXPECT_EQ(is_touching, lift >= 0.0);
                Motion motion;
                motion.start = moved(pose, {0.0, 0.0, 1.0 + lift});
                motion.translation = {0.0, 0.0, -2.0};
                const CastAnswer hit = cast(shape.shape, motion, scene.ground);
                EXPECT_TRUE(hit.hit);
                EXPECT_LE(2.0 * hit.fraction, 1.0 + slack);
                EXPECT_LE(true_lift(scene, shape, motion.at(hit.fraction)), slack);
            }
        }
    }
}

TEST(Extremes, SmallAndFlatShapesHaveTheRightAnswers) {
    std::vector<const LawScene*> scenes;
    for (const LawScene& scene : law_scenes()) scenes.push_back(&scene);
    expect_right_answers(kSeed, scenes, small_shapes(), {-0.3, 0.0, 1e-4, 0.5});
}

TEST(Extremes, ShapesLargerThanTheGroundHaveTheRightAnswers) {
    expect_right_answers(kSeed + 2, {&scene_named("level plane"), &scene_named("rough")},
                         large_shapes(), {-0.3, 0.5});
}

void expect_right_turning_casts(std::uint64_t seed, const std::vector<LawShape>& shapes) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    for (const char* name : {"level plane", "rough"}) {
        const LawScene& scene = scene_named(name);
        for (const LawShape& shape : shapes) {
            Motion motion;
            motion.start = random_pose(random, scene, shape, -1.0);
            motion.translation = {0.0, 0.0, -2.0};
            motion.rotation_vector = {0.3, 0.2, 0.1};
            SCOPED_TRACE(describe(scene, shape, motion.start));
            const CastAnswer hit = cast(shape.shape, motion, scene.ground);
            EXPECT_EQ(hit.status, QueryStatus::complete);
            EXPECT_LE(true_lift(scene, shape, motion.at(hit.fraction)), 1e-8);
        }
    }
}

TEST(Extremes, CastsOfSmallTurningShapesStopWhereTheyTouch) {
    expect_right_turning_casts(kSeed + 3, small_shapes());
}

TEST(Extremes, CastsOfLargeTurningShapesStopWhereTheyTouch) {
    expect_right_turning_casts(kSeed + 4, large_shapes());
}

// Every number of a query is replaced by NaN or infinity.
TEST(Extremes, NonFiniteArgumentsAreInvalid) {
    const LawScene& scene = scene_named("rough");
    std::array<Contact, 4> contacts;
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
        const auto refuses = [&](const Shape& shape, const Pose& pose) {
            EXPECT_EQ(compute_lift(shape, pose, scene.ground).status, QueryStatus::invalid);
            EXPECT_EQ(test_contact(shape, pose, scene.ground).status, QueryStatus::invalid);
            EXPECT_EQ(pseudodistance(shape, pose, scene.ground).status, QueryStatus::invalid);
            EXPECT_EQ(signed_distance(shape, pose, scene.ground, 1.0).status, QueryStatus::invalid);
            EXPECT_EQ(find_contacts(shape, pose, scene.ground, 0.0, contacts).status,
                      QueryStatus::invalid);
            Motion motion;
            motion.start = pose;
            EXPECT_EQ(cast(shape, motion, scene.ground).status, QueryStatus::invalid);
        };
        for (const LawShape& shape : law_shapes()) {
            for (int i = 0; i < 12; ++i) {
                Pose pose;
                pose.translation = {60.0, 60.0, 1.0};
                (i < 3 ? pose.translation[i] : pose.rotation(i % 3, i / 3 - 1)) = bad;
                SCOPED_TRACE(i);
                refuses(shape.shape, pose);
            }
            for (int i = 0; i < 6; ++i) {
                Motion motion;
                motion.start.translation = {60.0, 60.0, 3.0};
                (i < 3 ? motion.translation[i] : motion.rotation_vector[i - 3]) = bad;
                EXPECT_EQ(cast(shape.shape, motion, scene.ground).status, QueryStatus::invalid);
            }
            Pose pose;
            pose.translation = {60.0, 60.0, 1.0};
            EXPECT_EQ(find_contacts(shape.shape, pose, scene.ground, bad, contacts).status,
                      QueryStatus::invalid);
            if (bad != kInfinity) {
                EXPECT_EQ(signed_distance(shape.shape, pose, scene.ground, bad).status,
                          QueryStatus::invalid);
            }
        }
        Pose pose;
        pose.translation = {60.0, 60.0, 1.0};
        for (const Shape& shape :
             {Shape(Sphere{bad}), Shape(Capsule{bad, 0.5}), Shape(Capsule{0.5, bad}),
              Shape(Box{{bad, 1.0, 1.0}}), Shape(Box{{1.0, bad, 1.0}}), Shape(Box{{1.0, 1.0, bad}}),
              Shape(Sphere{-1.0}), Shape(Box{{1.0, -1.0, 1.0}})}) {
            refuses(shape, pose);
        }
    }
}

TEST(Extremes, MatricesThatAreNotRotationsAreInvalid) {
    const LawScene& scene = scene_named("rough");
    for (const LawShape& shape : law_shapes()) {
        Pose pose;
        pose.translation = {60.0, 60.0, 1.0};
        for (const Eigen::Matrix3d& rotation :
             {Eigen::Matrix3d(Eigen::Matrix3d::Zero()), Eigen::Matrix3d(Eigen::Matrix3d::Ones()),
              Eigen::Matrix3d(1.001 * Eigen::Matrix3d::Identity()),
              Eigen::Matrix3d(-Eigen::Matrix3d::Identity())}) {
            pose.rotation = rotation;
            EXPECT_EQ(compute_lift(shape.shape, pose, scene.ground).status, QueryStatus::invalid);
            EXPECT_EQ(signed_distance(shape.shape, pose, scene.ground, 1.0).status,
                      QueryStatus::invalid);
            Motion motion;
            motion.start = pose;
            EXPECT_EQ(cast(shape.shape, motion, scene.ground).status, QueryStatus::invalid);
        }
        pose.rotation = (1.0 + 1e-8) * Eigen::Matrix3d::Identity();
        EXPECT_EQ(compute_lift(shape.shape, pose, scene.ground).status, QueryStatus::complete);
    }
}

TEST(Extremes, LargeDistancesAndMarginsAreAnswered) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    std::array<Contact, 8> contacts;
    for (const LawScene& scene : law_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            const Pose pose = random_pose(random, scene, shape, -0.3);
            SCOPED_TRACE(describe(scene, shape, pose));
            const double near = signed_distance(shape.shape, pose, scene.ground, 1.0).distance;
            for (const double largest : {1e3, 1e9, 1e300, kInfinity}) {
                const DistanceAnswer far =
                    signed_distance(shape.shape, pose, scene.ground, largest);
                EXPECT_EQ(far.status, QueryStatus::complete);
                EXPECT_TRUE(far.has_ground);
                EXPECT_NEAR(far.distance, near, 1e-12);
            }
            for (const double margin : {10.0, 1e6, 1e300}) {
                const ContactAnswer answer =
                    find_contacts(shape.shape, pose, scene.ground, margin, contacts);
                EXPECT_NE(answer.status, QueryStatus::not_resident);
                if (answer.status == QueryStatus::invalid) continue;
                ASSERT_GT(answer.count, 0u);
                EXPECT_NEAR(contacts[0].depth, -near, 1e-9);
            }
            // from the distance of the moon
            const Pose high = moved(pose, {0.0, 0.0, 3.8e8});
            const DistanceAnswer moon = signed_distance(shape.shape, high, scene.ground, kInfinity);
            EXPECT_EQ(moon.status, QueryStatus::complete);
            if (moon.has_ground) {
                EXPECT_NEAR(moon.distance, 3.8e8, 126e3);
            }
        }
    }
}

}  // namespace extremes_test
}  // namespace terrane
