// SPDX-License-Identifier: MIT
// Depths that are known from the shape of the ground.
#include "collision/ground_laws/oracles/sampled_depth.h"
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>

namespace terrane {
namespace depth_extremes_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261124;

Pose pose_at(double x, double y, double z) {
    Pose pose;
    pose.translation = {x, y, z};
    return pose;
}

// Expects this depth, and a lower bound that proves it.
void expect_depth(const Shape& shape, const Pose& pose, const Ground& ground, double depth) {
    const DistanceAnswer answer = signed_distance(shape, pose, ground, 1.0);
    ASSERT_EQ(answer.status, QueryStatus::complete);
    const double tolerance = 1e-6 * depth + 1e-9;
    EXPECT_NEAR(-answer.distance, depth, tolerance);
    EXPECT_NEAR(answer.distance_lower_bound, depth, tolerance);
    EXPECT_LE(answer.distance_lower_bound, -answer.distance);
}

TEST(ShortestTranslation, OverFlatGroundIsStraightUpAtAnyDepth) {
    const LawScene flat = make_scene(
        "flat", [](double, double) { return 2.0; }, TableGroundSettings{});
    for (const double depth : {1e-9, 1e-6, 1e-3, 0.3, 1.0, 7.0, 40.0}) {
        expect_depth(Sphere{0.5}, pose_at(64.3, 64.2, 2.5 - depth), flat.ground, depth);
        expect_depth(Capsule{0.4, 0.8}, pose_at(64.3, 64.2, 3.2 - depth), flat.ground, depth);
        expect_depth(Box{{1.0, 1.5, 0.5}}, pose_at(64.0, 64.0, 2.5 - depth), flat.ground, depth);
    }
}

TEST(ShortestTranslation, OverARampIsAlongItsNormal) {
    const LawScene ramp = make_scene(
        "ramp", [](double x, double) { return 0.75 * x; }, TableGroundSettings{});
    const double up = 1.25;  // vertical distance per distance along the normal
    for (const double depth : {1e-6, 1e-3, 0.3, 2.0, 15.0}) {
        expect_depth(Sphere{0.5}, pose_at(64.3, 64.2, 0.75 * 64.3 + up * (0.5 - depth)),
                     ramp.ground, depth);
        // A box that touches with an edge of its bottom, level along y.
        const double reach = 0.6 * 1.0 + 0.8 * 0.5;
        expect_depth(Box{{1.0, 1.5, 0.5}}, pose_at(64.3, 64.2, 0.75 * 64.3 + up * (reach - depth)),
                     ramp.ground, depth);
    }
}

TEST(ShortestTranslation, InAPitIsNotLongerThanRandomSearchFinds) {
    // One vertex 4 m down: a funnel one cell wide to each side.
    const LawScene pit = make_scene(
        "pit", [](double x, double y) { return x == 64.0 && y == 64.0 ? -4.0 : 0.0; },
        TableGroundSettings{});
    Random random(kSeed);
    for (const double z : {0.9, 0.5, 0.0, -0.5, -2.0}) {
        for (const char* name : {"sphere", "capsule", "box", "hull", "compound"}) {
            const LawShape& shape = shape_named(name);
            const Pose pose = pose_at(64.1, 63.95, z);
            const DistanceAnswer answer = signed_distance(shape.shape, pose, pit.ground, 1.0);
            ASSERT_EQ(answer.status, QueryStatus::complete);
            const double depth = -answer.distance;
            if (depth <= 0.0) continue;
            const double found = sampled_depth(pit.soup, shape.oracle, pose, depth, {}, random);
            EXPECT_GE(found, depth * (1.0 - 1e-6) - 1e-9) << name << " at " << z;
            EXPECT_GE(answer.distance_lower_bound, depth * (1.0 - 1e-6) - 1e-9)
                << name << " at " << z;
        }
    }
}

TEST(ShortestTranslation, OverCellsOfACentimetreIsExactForALargeShape) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    TableGroundSettings settings;
    settings.spacing = 0.01;
    settings.roots = 4;
    const LawScene fine = make_scene(
        "fine noise",
        [](double x, double y) {
            Random hash(static_cast<std::uint64_t>(std::lround(100.0 * x)) * 0x10001u +
                        static_cast<std::uint64_t>(std::lround(100.0 * y)));
            return 0.05 * hash.between(0.0, 1.0);
        },
        settings);
    Random random(kSeed);
    for (const Shape& kind :
         std::initializer_list<Shape>{Sphere{0.4}, Box{{0.3, 0.4, 0.2}}, Capsule{0.3, 0.2}}) {
        const LawShape shape{"large", kind, make_oracle(kind)};
        for (const double share : {0.02, 0.4, 1.0}) {
            Pose pose = pose_at(2.56, 2.561, 0.0);
            pose.rotation = random.rotation();
            pose.translation.z() = brute_lift<double>(fine.soup, shape.oracle, pose) -
                                   share * smallest_half_extent(kind);
            SCOPED_TRACE(describe(fine, shape, pose));
            const DistanceAnswer answer = signed_distance(kind, pose, fine.ground, 1.0);
            ASSERT_EQ(answer.status, QueryStatus::complete);
            const double depth = -answer.distance;
            const double least = depth * (1.0 - 1e-6) - 1e-9;
            EXPECT_GE(answer.distance_lower_bound, least);
            const SampledDepthSettings few{.samples = 20, .starts = 1, .refinements = 10};
            EXPECT_GE(sampled_depth(fine.soup, shape.oracle, pose, depth, few, random), least);
        }
    }
}

// The sides of the ground do not block: the minimum translation may be sideways.
TEST(ShortestTranslation, AtTheBorderOfTheGroundIsOutOverTheBorder) {
    const LawScene flat = make_scene(
        "flat", [](double, double) { return 0.0; }, TableGroundSettings{});
    const double west = flat.ground.extent().west;
    expect_depth(Sphere{0.5}, pose_at(west + 0.2, 64.2, -20.0), flat.ground, 0.7);
    expect_depth(Sphere{2.0}, pose_at(west + 3.25, 64.2, -20.0), flat.ground, 5.25);
    expect_depth(Capsule{0.4, 0.8}, pose_at(west + 0.2, 64.2, -20.0), flat.ground, 0.6);
    expect_depth(Box{{1.0, 1.5, 0.5}}, pose_at(west + 0.3, 64.2, -20.0), flat.ground, 1.3);
    // In a corner: out over the nearer side.
    const double south = flat.ground.extent().south;
    expect_depth(Sphere{0.5}, pose_at(west + 0.4, south + 0.1, -20.0), flat.ground, 0.6);
    // Near the surface the translation up is shorter.
    expect_depth(Sphere{0.5}, pose_at(west + 0.2, 64.2, 0.1), flat.ground, 0.4);
}

TEST(ShortestTranslation, AtTheRimOfAHoleIsIntoTheHole) {
    TableGroundSettings settings;
    settings.is_outside = [](double x, double y) {
        return x > 60.0 && x < 70.0 && y > 60.0 && y < 70.0;
    };
    const LawScene holed = make_scene(
        "holed", [](double, double) { return 0.0; }, settings);
    const LawScene narrow = [&] {
        settings.is_outside = [](double x, double y) {
            return x > 64.0 && x < 65.0 && y > 64.0 && y < 65.0;
        };
        return make_scene(
            "narrow hole", [](double, double) { return 0.0; }, settings);
    }();
    expect_depth(Sphere{0.5}, pose_at(59.8, 64.2, -20.0), holed.ground, 0.7);
    expect_depth(Box{{1.0, 1.5, 0.5}}, pose_at(59.8, 64.2, -20.0), holed.ground, 1.2);
    // A sphere that fits moves into a hole of one cell; a larger one rests on its four sides.
    expect_depth(Sphere{0.25}, pose_at(63.9, 64.5, -20.0), narrow.ground, 0.35);
    expect_depth(Sphere{0.75}, pose_at(64.5, 64.5, -3.0), narrow.ground,
                 3.0 + std::sqrt(0.75 * 0.75 - 0.5 * 0.5));
}

TEST(ShortestTranslation, IntoGroundThatIsNotLoadedIsNotResident) {
    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = [](int column, int) { return column == 0; };
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, settings);
    const double seam = ground.extent().west + 128.0;
    const DistanceAnswer deep =
        signed_distance(Sphere{0.25}, pose_at(seam - 0.5, 64.0, -20.0), ground, 1.0);
    EXPECT_EQ(deep.status, QueryStatus::not_resident);
    const DistanceAnswer far =
        signed_distance(Sphere{0.25}, pose_at(seam - 40.0, 64.0, -20.0), ground, 1.0);
    EXPECT_EQ(far.status, QueryStatus::complete);
    EXPECT_NEAR(far.distance, -20.25, 1e-6);
}

// The lower bound is loose for them: it comes from single columns.
TEST(ShortestTranslation, OfShapesWithoutVolumeIsThatOfTheirLowestPoint) {
    const LawScene ramp = make_scene(
        "ramp", [](double x, double) { return 0.75 * x; }, TableGroundSettings{});
    for (const auto& [shape, below] : std::initializer_list<std::pair<Shape, double>>{
             {Sphere{0.0}, 1.0}, {Capsule{0.0, 0.5}, 0.5}}) {
        const DistanceAnswer answer =
            signed_distance(shape, pose_at(64.3, 64.2, 0.75 * 64.3 - below), ramp.ground, 1.0);
        ASSERT_EQ(answer.status, QueryStatus::complete);
        EXPECT_NEAR(answer.distance, -0.8, 1e-9);
        EXPECT_GE(answer.distance_lower_bound, 0.0);
        EXPECT_LE(answer.distance_lower_bound, 0.8 + 1e-9);
    }
}

TEST(ShortestTranslation, OfInvalidInputIsInvalid) {
    const LawScene flat = make_scene(
        "flat", [](double, double) { return 0.0; }, TableGroundSettings{});
    const DistanceAnswer answer =
        signed_distance(Sphere{0.5}, pose_at(std::nan(""), 0.0, 0.0), flat.ground, 1.0);
    EXPECT_EQ(answer.status, QueryStatus::invalid);
    EXPECT_EQ(answer.distance_lower_bound, 0.0);
}

}  // namespace depth_extremes_test
}  // namespace terrane
