// SPDX-License-Identifier: MIT
//
// Extreme sizes and arguments give the right answer or status `invalid`.
#include "law_cases.h"
#include "support/allocation_counter.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cstring>

namespace terrane::extremes_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260308;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<LawShape> small_shapes() {
    return make_law_shapes({
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
        {"hull of a point", make_hull({{0.3, -0.2, 0.4}})},
        {"hull of a segment", make_hull({{1.0, 0.0, 0.3}, {-0.5, 0.4, 0.0}})},
        {"hull of a triangle", make_hull({{1.0, 0.0, 0.0}, {-0.5, 1.0, 0.0}, {-0.5, -1.0, 0.0}})},
    });
}

std::vector<LawShape> large_shapes() {
    return make_law_shapes({
        {"box larger than a chunk", Box{{90.0, 100.0, 1.0}}},
        {"box of ten kilometres", Box{{5000.0, 5000.0, 5000.0}}},
        {"sphere of ten kilometres", Sphere{5000.0}},
        {"capsule of ten kilometres", Capsule{100.0, 4900.0}},
    });
}

void expect_right_answers(std::uint64_t seed, const std::vector<const LawScene*>& scenes,
                          const std::vector<LawShape>& shapes, const std::vector<double>& lifts) {
    SeededRandom random(seed);
    std::array<Contact, 256> contacts;
    for (const LawScene* of : scenes) {
        const LawScene& scene = *of;
        for (const LawShape& shape : shapes) {
            for (const double lift : lifts) {
                const Pose pose = random_pose(random, scene, shape, lift);
                SCOPED_TRACE(describe(scene, shape, pose));
                // 1e-9 plus the rounding of coordinates of 5 km
                const double slack = 1e-9 + 1e-13 * bounding_radius(shape.shape);
                const LiftAnswer answer = compute_lift(shape.shape, pose, scene.ground);
                EXPECT_EQ(answer.status, QueryStatus::ok);
                EXPECT_NEAR(answer.lift, lift, slack);
                const DistanceAnswer distance =
                    signed_distance(shape.shape, pose, scene.ground, 1.0);
                EXPECT_EQ(distance.status, QueryStatus::ok);
                const ContactAnswer found =
                    find_contacts(shape.shape, pose, scene.ground, 0.0, contacts);
                EXPECT_NE(found.status, QueryStatus::invalid);
                if (lift > 0.0) {
                    EXPECT_LT(distance.distance, 0.0);
                    EXPECT_GE(distance.distance, -lift - slack);
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
                    EXPECT_LE(distance.distance, -lift + slack);
                }
                const bool is_touching = test_contact(shape.shape, pose, scene.ground).is_touching;
                EXPECT_EQ(is_touching, lift >= 0.0);
                Motion motion{.start = moved(pose, {0.0, 0.0, 1.0 + lift}),
                              .translation = {0.0, 0.0, -2.0}};
                const CastAnswer hit = cast(shape.shape, motion, scene.ground);
                EXPECT_TRUE(hit.hit);
                EXPECT_LE(2.0 * hit.fraction, 1.0 + slack);
                EXPECT_FALSE(is_deeper<long double>(
                    scene.soup, shape.oracle, motion.at(hit.fraction), Vec<long double>::Zero(),
                    static_cast<long double>(slack)));
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
    expect_right_answers(kSeed + 2, {&scene_named("level plane")}, large_shapes(), {0.5});
    expect_right_answers(kSeed + 3, {&scene_named("rough")}, large_shapes(), {-0.3, 0.5});
}

void expect_right_turning_casts(std::uint64_t seed, const std::vector<LawShape>& shapes,
                                std::initializer_list<const char*> scenes) {
    SeededRandom random(seed);
    for (const char* name : scenes) {
        const LawScene& scene = scene_named(name);
        for (const LawShape& shape : shapes) {
            Motion motion{.start = random_pose(random, scene, shape, -1.0),
                          .translation = {0.0, 0.0, -2.0},
                          .rotation_vector = {0.3, 0.2, 0.1}};
            SCOPED_TRACE(describe(scene, shape, motion.start));
            const CastAnswer hit = cast(shape.shape, motion, scene.ground);
            EXPECT_EQ(hit.status, QueryStatus::ok);
            EXPECT_FALSE(is_deeper<long double>(scene.soup, shape.oracle, motion.at(hit.fraction),
                                                Vec<long double>::Zero(), 1e-8L));
        }
    }
}

TEST(Extremes, CastsOfSmallTurningShapesStopWhereTheyTouch) {
    expect_right_turning_casts(kSeed + 3, small_shapes(), {"level plane", "rough"});
}

TEST(Extremes, CastsOfLargeTurningShapesStopWhereTheyTouch) {
    expect_right_turning_casts(kSeed + 4, large_shapes(), {"rough"});
}

// Over the noise.
void expect_refused(const Shape& shape, const Pose& pose) {
    const Ground& ground = scene_named("rough").ground;
    std::array<Contact, 4> contacts;
    EXPECT_EQ(compute_lift(shape, pose, ground).status, QueryStatus::invalid);
    EXPECT_EQ(test_contact(shape, pose, ground).status, QueryStatus::invalid);
    EXPECT_EQ(pseudodistance(shape, pose, ground).status, QueryStatus::invalid);
    EXPECT_EQ(signed_distance(shape, pose, ground, 1.0).status, QueryStatus::invalid);
    EXPECT_EQ(find_contacts(shape, pose, ground, 0.0, contacts).status, QueryStatus::invalid);
    EXPECT_EQ(cast(shape, {pose}, ground).status, QueryStatus::invalid);
}

// Each number of a query is replaced by NaN or infinity.
TEST(Extremes, NonFiniteArgumentsAreInvalid) {
    const Ground& ground = scene_named("rough").ground;
    const Pose pose{.translation = {60.0, 60.0, 1.0}};
    std::array<Contact, 4> contacts;
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
        for (const LawShape& shape : law_shapes()) {
            for (int i = 0; i < 12; ++i) {
                Pose spoilt = pose;
                (i < 3 ? spoilt.translation[i] : spoilt.rotation(i % 3, i / 3 - 1)) = bad;
                SCOPED_TRACE(i);
                expect_refused(shape.shape, spoilt);
            }
            for (int i = 0; i < 6; ++i) {
                Motion motion{.start = {.translation = {60.0, 60.0, 3.0}}};
                (i < 3 ? motion.translation[i] : motion.rotation_vector[i - 3]) = bad;
                EXPECT_EQ(cast(shape.shape, motion, ground).status, QueryStatus::invalid);
            }
            for (const double margin : {bad, -1.0}) {
                EXPECT_EQ(find_contacts(shape.shape, pose, ground, margin, contacts).status,
                          QueryStatus::invalid);
            }
            EXPECT_EQ(cast(shape.shape, {pose}, ground, {.tolerance = 0.0}).status,
                      QueryStatus::invalid);
            if (bad != kInfinity) {
                EXPECT_EQ(signed_distance(shape.shape, pose, ground, bad).status,
                          QueryStatus::invalid);
            }
        }
        for (const Shape& shape :
             {Shape(Sphere{bad}), Shape(Capsule{bad, 0.5}), Shape(Capsule{0.5, bad}),
              Shape(Box{{bad, 1.0, 1.0}}), Shape(Box{{1.0, bad, 1.0}}), Shape(Box{{1.0, 1.0, bad}}),
              Shape(Sphere{-1.0}), Shape(Box{{1.0, -1.0, 1.0}})}) {
            expect_refused(shape, pose);
        }
    }
}

TEST(Extremes, MatricesThatAreNotRotationsAreInvalid) {
    Eigen::Matrix3d skewed = Eigen::Matrix3d::Identity(), mirror = skewed;
    skewed(0, 1) = 1e-3;
    mirror(2, 2) = -1.0;
    for (const LawShape& shape : law_shapes()) {
        for (const Eigen::Matrix3d& rotation :
             {Eigen::Matrix3d(Eigen::Matrix3d::Zero()), Eigen::Matrix3d(Eigen::Matrix3d::Ones()),
              Eigen::Matrix3d(1.001 * Eigen::Matrix3d::Identity()),
              Eigen::Matrix3d(-Eigen::Matrix3d::Identity()), skewed, mirror}) {
            expect_refused(shape.shape, {rotation, {60.0, 60.0, 1.0}});
        }
        const Pose rounded{(1.0 + 1e-8) * Eigen::Matrix3d::Identity(), {60.0, 60.0, 1.0}};
        EXPECT_EQ(compute_lift(shape.shape, rounded, scene_named("rough").ground).status,
                  QueryStatus::ok);
    }
}

TEST(Extremes, LargeDistancesAndMarginsAreAnswered) {
    SeededRandom random(kSeed + 1);
    std::array<Contact, 8> contacts;
    long cases = 0, answered = 0;
    for (const LawScene& scene : law_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            const Pose pose = random_pose(random, scene, shape, -0.3);
            ++cases;
            SCOPED_TRACE(describe(scene, shape, pose));
            const double near = signed_distance(shape.shape, pose, scene.ground, 1.0).distance;
            for (const double largest : {1e3, 1e9, 1e300, kInfinity}) {
                const DistanceAnswer far =
                    signed_distance(shape.shape, pose, scene.ground, largest);
                EXPECT_EQ(far.status, QueryStatus::ok);
                EXPECT_TRUE(far.has_ground);
                EXPECT_NEAR(far.distance, near, 1e-12);
            }
            for (const double margin : {10.0, 1e6, 1e300}) {
                const ContactAnswer answer =
                    find_contacts(shape.shape, pose, scene.ground, margin, contacts);
                EXPECT_NE(answer.status, QueryStatus::not_resident);
                if (answer.status == QueryStatus::invalid) continue;
                ++answered;
                ASSERT_GT(answer.count, 0u);
                EXPECT_NEAR(contacts[0].depth, -near, 1e-9);
            }
            // from the distance of the moon
            const Pose high = moved(pose, {0.0, 0.0, 3.8e8});
            const DistanceAnswer moon = signed_distance(shape.shape, high, scene.ground, kInfinity);
            EXPECT_EQ(moon.status, QueryStatus::ok);
            if (moon.has_ground) {
                EXPECT_NEAR(moon.distance, 3.8e8, 126e3);
            }
        }
    }
    EXPECT_GT(answered, cases / 4);
}

}  // namespace terrane::extremes_test

// The same query on the same ground elsewhere: shifted by whole chunks or arbitrarily, mirrored, or rotated by 90
// degrees.

namespace terrane::invariance_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260307;

bool is_same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

bool is_same(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

// A pose whose coordinates are exact on both grounds.
Pose rounded(Pose pose) {
    for (int k = 0; k < 3; ++k) {
        pose.translation[k] = std::floor(pose.translation[k] * 0x1p20) * 0x1p-20;
    }
    return pose;
}

LawScene shifted_scene(const LawScene& scene, double shift, std::int32_t first_root) {
    TableGroundSettings settings{
        .spacing = scene.soup.spacing(), .roots = scene.roots, .first_root = first_root};
    settings.origin_x = settings.origin_y = first_root == 0 ? shift : 0.0;
    return make_scene(
        scene.name,
        [&scene, shift](double x, double y) {
            // rounds to the exact lattice
            const double h = scene.soup.spacing();
            return scene.height(h * std::round((x - shift) / h), h * std::round((y - shift) / h));
        },
        settings);
}

TEST(LawsOfInvariance, ShiftedByWholeChunksNoBitChanges) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(8, 4'000);
    long cases = 0, contacts = 0, distances = 0, hits = 0;
    for (const std::int32_t roots : {3, -1000, 78125}) {
        for (const LawScene& near : law_scenes()) {
            const double shift = 128.0 * near.soup.spacing() * roots;
            const LawScene far = shifted_scene(near, shift, roots);
            for (const LawShape& shape : law_shapes()) {
                for (long i = 0; i < count; ++i) {
                    const Pose here =
                        rounded(random_pose(random, near, shape, random.between(-0.5, 0.3)));
                    const Pose there = moved(here, {shift, shift, 0.0});
                    SCOPED_TRACE(describe(near, shape, here));
                    std::array<Contact, 64> a, b;
                    const ContactAnswer ca = find_contacts(shape.shape, here, near.ground, 0.1, a);
                    const ContactAnswer cb = find_contacts(shape.shape, there, far.ground, 0.1, b);
                    ASSERT_EQ(ca.count, cb.count);
                    ++cases;
                    contacts += static_cast<long>(ca.count);
                    ASSERT_TRUE(is_same(ca.lift, cb.lift));
                    for (std::size_t k = 0; k < ca.count; ++k) {
                        ASSERT_TRUE(is_same(a[k].depth, b[k].depth));
                        ASSERT_TRUE(is_same(a[k].normal, b[k].normal));
                        ASSERT_EQ(a[k].feature, b[k].feature);
                        ASSERT_EQ(a[k].part, b[k].part);
                    }
                    const DistanceAnswer da = signed_distance(shape.shape, here, near.ground, 2.0);
                    const DistanceAnswer db = signed_distance(shape.shape, there, far.ground, 2.0);
                    distances += da.has_ground ? 1 : 0;
                    ASSERT_TRUE(is_same(da.distance, db.distance));
                    ASSERT_TRUE(is_same(da.normal, db.normal));
                    Motion motion{.start = here,
                                  .translation = 20.0 * random.direction(),
                                  .rotation_vector = (i % 2) * random.direction()};
                    Motion far_motion = motion;
                    far_motion.start = there;
                    const CastAnswer ma = cast(shape.shape, motion, near.ground);
                    const CastAnswer mb = cast(shape.shape, far_motion, far.ground);
                    hits += ma.hit ? 1 : 0;
                    ASSERT_EQ(ma.hit, mb.hit);
                    ASSERT_TRUE(is_same(ma.fraction, mb.fraction));
                }
            }
        }
    }
    EXPECT_GT(contacts, cases);
    EXPECT_GT(distances, cases / 2);
    EXPECT_GT(hits, cases / 2);
}

// Every second case overlaps.
TEST(LawsOfInvariance, ShiftedByAnythingDistancesChangeByLessThan10Nanometres) {
    SeededRandom random(kSeed + 1);
    const long count = count_of_cases(40, 8'000);
    for (const double shift : {0.3, -1234.567, 1e7 / 3.0, 1e7 + 0.1}) {
        for (const LawScene& near : law_scenes()) {
            const LawScene far = shifted_scene(near, shift, 0);
            for (const LawShape& shape : law_shapes()) {
                std::array<long, 2> compared{};
                for (long i = 0; i < count; ++i) {
                    const double deepest = shallow_depth(shape);
                    const double lift = random.between(0.0, i % 2 == 1 ? deepest : -0.5);
                    const Pose here = random_pose(random, near, shape, lift);
                    const Pose there = moved(here, {shift, shift, 0.0});
                    SCOPED_TRACE(describe(near, shape, here));
                    const double a = signed_distance(shape.shape, here, near.ground, 2.0).distance;
                    const double b = signed_distance(shape.shape, there, far.ground, 2.0).distance;
                    if (a < -deepest || b < -deepest) continue;
                    ++compared[static_cast<std::size_t>(i % 2)];
                    ASSERT_NEAR(a, b, 1e-8) << shift;
                }
                for (const long each : compared) {
                    EXPECT_GT(each, count / 40) << near.name << ", " << shape.name;
                }
            }
        }
    }
}

// Cell diagonals alternate like the squares of a chess board: a reflection or 90 degree rotation about a lattice point
// maps diagonals to diagonals. Every second case overlaps.
TEST(LawsOfInvariance, MirroredAndTurnedBy90DegreesDistancesStay) {
    SeededRandom random(kSeed + 2);
    const long count = count_of_cases(60, 12'000);
    Eigen::Matrix3d quarter, mirror;
    quarter << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
    mirror << -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0;
    for (const LawScene& scene : law_scenes()) {
        const double middle = 0.5 * scene.soup.cells() * scene.soup.spacing();
        const Eigen::Vector3d centre(middle, middle, 0.0);
        for (const Eigen::Matrix3d& turn : {quarter, mirror}) {
            TableGroundSettings settings{.spacing = scene.soup.spacing(), .roots = scene.roots};
            const LawScene turned = make_scene(
                scene.name,
                [&](double x, double y) {
                    const Eigen::Vector3d p =
                        turn.transpose() * (Eigen::Vector3d(x, y, 0.0) - centre) + centre;
                    return scene.height(p.x(), p.y());
                },
                settings);
            for (const LawShape& shape : law_shapes()) {
                const bool is_symmetric = shape.shape.index() < 3;  // sphere, capsule, box
                if (turn == mirror && !is_symmetric) continue;
                // any overlap of a flat shape is deep, so its result depends on rounding
                const long kinds = shape.name == "flat hull" ? 1 : 2;
                std::array<long, 2> compared{};
                for (long i = 0; i < count; i += 3 - kinds) {
                    const double deepest = shallow_depth(shape);
                    const double lift = random.between(0.0, i % 2 == 1 ? deepest : -0.5);
                    const Pose here = random_pose(random, scene, shape, lift);
                    Pose there{turn * here.rotation, turn * (here.translation - centre) + centre};
                    if (turn == mirror) there.rotation = there.rotation * mirror;
                    SCOPED_TRACE(describe(scene, shape, here));
                    // on a slope of 1e6 a rounding error in x is amplified 1e6 times in z
                    if (scene.name != "cliffs") {
                        ASSERT_NEAR(compute_lift(shape.shape, there, turned.ground).lift, lift,
                                    1e-9);
                    }
                    const double a = signed_distance(shape.shape, here, scene.ground, 2.0).distance;
                    const double b =
                        signed_distance(shape.shape, there, turned.ground, 2.0).distance;
                    if (a < -deepest || b < -deepest) continue;
                    ++compared[static_cast<std::size_t>(i % 2)];
                    ASSERT_NEAR(a, b, 1e-9);
                }
                for (long kind = 0; kind < kinds; ++kind) {
                    EXPECT_GT(compared[static_cast<std::size_t>(kind)], count / 40)
                        << scene.name << ", " << shape.name;
                }
            }
        }
    }
}

}  // namespace terrane::invariance_test

// No query allocates memory.

namespace terrane::allocation_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260309;

TEST(LawsOfMemory, NoQueryAllocates) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(8, 20);
    std::array<Contact, 256> contacts;
    for (const LawScene& scene : law_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            for (long i = 0; i < count; ++i) {
                const Pose pose = random_pose(random, scene, shape, random.between(-2.0, 2.0));
                Motion motion{.start = pose,
                              .translation = 50.0 * random.direction(),
                              .rotation_vector = random.direction()};
                CastSettings skipping{.skip_separating = true};
                const AllocationCounter counter;
                static_cast<void>(compute_lift(shape.shape, pose, scene.ground));
                static_cast<void>(test_contact(shape.shape, pose, scene.ground));
                static_cast<void>(pseudodistance(shape.shape, pose, scene.ground));
                static_cast<void>(signed_distance(shape.shape, pose, scene.ground, 3.0));
                static_cast<void>(find_contacts(shape.shape, pose, scene.ground, 0.1, contacts));
                static_cast<void>(cast(shape.shape, motion, scene.ground));
                static_cast<void>(cast(shape.shape, motion, scene.ground, skipping));
                ASSERT_EQ(counter.count(), 0u) << describe(scene, shape, pose);
            }
        }
    }
}

TEST(LawsOfMemory, TheCounterCounts) {
    if (!AllocationCounter::kCounts) GTEST_SKIP() << "this sanitizer replaces operator new";
    const AllocationCounter counter;
    const std::vector<double> some(3, 1.0);
    EXPECT_EQ(counter.count(), 1u) << some[0];
}

}  // namespace terrane::allocation_test
