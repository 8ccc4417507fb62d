// SPDX-License-Identifier: MIT
//
// Lift, overlap test and sign of the signed distance against brute force over all triangles.
#include "law_cases.h"
#include "pairs/convex_core.h"

#include <terrane/collision/ground_queries.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <span>
#include <utility>

namespace terrane::lift_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260302;

// Hulls of every dimension, none centred on its origin.
std::vector<LawShape> oracle_hulls(Random& random) {
    std::vector<LawShape> made;
    for (const auto& [name, points] : make_hulls(random)) {
        made.push_back({name, make_hull(points), make_hull_oracle(points)});
    }
    return made;
}

TEST(LawsOfLift, IsTheLargestOverEveryTriangle) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(1400, 1'000'000);
    std::vector<LawShape> shapes = law_shapes();
    for (LawShape& hull : oracle_hulls(random)) shapes.push_back(std::move(hull));
    for (const LawShape& shape : shapes) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double lift = random.between(-1.0, 1.0);
            const Pose pose = random_pose(random, scene, shape, lift);
            const LiftAnswer answer = compute_lift(shape.shape, pose, scene.ground);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_NEAR(answer.lift, lift, 1e-9) << describe(scene, shape, pose);
            ASSERT_EQ(pseudodistance(shape.shape, pose, scene.ground).pseudodistance, -answer.lift);
        }
    }
}

TEST(HullLift, OfANeedleIsTheLargestOverEveryTriangle) {
    SeededRandom random(kSeed + 4);
    const long count = count_of_cases(2, 300);
    for (const char* name : {"spikes", "walls", "pits", "rough"}) {
        const LawScene& scene = scene_named(name);
        for (const double reach : {6.0, 60.0, 600.0, 3e4}) {
            for (long i = 0; i < count; ++i) {
                const Points points = transformed({{0.3, 0.0, 0.0},
                                                   {-0.2, 0.25, 0.0},
                                                   {-0.2, -0.2, 0.1},
                                                   {reach, random.between(-0.2, 0.2), 0.0}},
                                                  1.0, random.rotation());
                const LawShape needle{"needle", make_hull(points), make_hull_oracle(points)};
                const double lift = random.between(-1.0, 1.0);
                const Pose pose = random_pose(random, scene, needle, lift);
                // Coordinates of 3e4 m are rounded by 4e-12 m; the needle's slope multiplies that.
                EXPECT_NEAR(compute_lift(needle.shape, pose, scene.ground).lift, lift, 1e-8)
                    << describe(scene, needle, pose);
            }
        }
    }
}

TEST(HullLift, IsAccurateOnCliffs) {
    SeededRandom random(kSeed + 5);
    const LawScene cliff = make_scene(
        "cliff", [](double x, double) { return x >= 64.0 ? 1e5 : 0.0; },
        TableGroundSettings{.quantum = 0x1p-10});
    for (const LawShape& shape : oracle_hulls(random)) {
        for (int i = 0; i < 40; ++i) {
            const Pose pose{random.rotation(),
                            {random.between(60.0, 66.0), random.between(10.0, 118.0),
                             random.between(-1.0, 1e5)}};
            // On the cliff a rounding error in x is amplified 1e5 times in z.
            EXPECT_NEAR(compute_lift(shape.shape, pose, cliff.ground).lift,
                        true_lift(cliff, shape, pose), 1e-8)
                << describe(cliff, shape, pose);
        }
    }
}

// A shape whose surface is moved outwards by `growth` metres, inwards if negative.
LawShape grown(const Shape& shape, double growth) {
    Shape made = shape;
    if (auto* sphere = std::get_if<Sphere>(&made)) sphere->radius += growth;
    if (auto* capsule = std::get_if<Capsule>(&made)) capsule->radius += growth;
    if (auto* box = std::get_if<Box>(&made)) box->half_extents.array() += growth;
    return {"grown", made, make_oracle(made)};
}

// Ground of 128 cells of 1 m at a distance `far` from the origin, with random heights up to `size`.
LawScene rounding_scene(double far, double size) {
    TableGroundSettings settings{.first_root = static_cast<std::int32_t>(far / 128.0)};
    const auto height = [=](double x, double y) {
        Random random(static_cast<std::uint64_t>(x - far) * 0x10001 +
                      static_cast<std::uint64_t>(y - far));
        return random.between(0.0, size);
    };
    return make_scene("rounding", height, settings);
}

// The bound derived in docs/numerics.md.
TEST(LawsOfLift, LiesBetweenThoseOfShapesGrownAndShrunkByRounding) {
    static_assert(std::numeric_limits<long double>::digits >= 64);
    constexpr double kUnit = 0x1p-53, kRounding = 40.0;
    SeededRandom random(kSeed + 3);
    const long count = count_of_cases(75, 100'000);
    for (const double far : {0.0, 128.0 * 7812, 1e9}) {
        for (const double size : {1.0, 1e5}) {
            const LawScene scene = rounding_scene(far, size);
            long double worst = 0, worst_share = 0;
            for (const char* name : {"sphere", "capsule", "box"}) {
                const LawShape& shape = shape_named(name);
                const double reach = bounding_radius(shape.shape) + 2.0;
                for (long i = 0; i < count; ++i) {
                    const Pose pose = random_pose(random, scene, shape, random.between(-1.0, 1.0));
                    const double lift = compute_lift(shape.shape, pose, scene.ground).lift;
                    const double growth = kRounding * kUnit * (reach + std::abs(lift));
                    const auto of = [&](const LawShape& other) {
                        return brute_lift<long double>(scene.soup, other.oracle, pose);
                    };
                    const long double exact = of(shape);
                    const long double most = of(grown(shape.shape, growth));
                    ASSERT_LE(lift, most) << describe(scene, shape, pose);
                    ASSERT_GE(lift, of(grown(shape.shape, -growth)))
                        << describe(scene, shape, pose);
                    worst = std::max(worst, std::abs(lift - exact));
                    worst_share = std::max(worst_share, (lift - exact) / (most - exact));
                }
            }
            std::printf("%g m out, heights of %g m: largest error %.2Lg m, %.3Lf of the bound\n",
                        far, size, worst, worst_share);
            EXPECT_GT(worst_share, 1e-3L);
        }
    }
}

TEST(LawsOfSign, DistanceAndTestHaveTheSignOfTheLift) {
    SeededRandom random(kSeed + 1);
    const long count = count_of_cases(200, 200'000);
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            // of all sizes down to a few rounding errors
            const double size = std::pow(10.0, random.between(-8.0, 0.0));
            const double lift = random.below(2) == 0 ? size : -size;
            const Pose pose = random_pose(random, scene, shape, lift);
            SCOPED_TRACE(describe(scene, shape, pose));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 4.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_TRUE(answer.has_ground);
            const bool is_touching = test_contact(shape.shape, pose, scene.ground).is_touching;
            if (lift > 0.0) {
                ASSERT_LT(answer.distance, 0.0) << lift;
                ASSERT_GE(answer.distance, -lift - 1e-9);
                ASSERT_TRUE(is_touching);
            } else {
                ASSERT_GE(answer.distance, 0.0) << lift;
                ASSERT_LE(answer.distance, -lift + 1e-9);
                ASSERT_FALSE(is_touching);
            }
        }
    }
}

TEST(LawsOfSign, DistanceIsZeroWhereTheShapeTouches) {
    SeededRandom random(kSeed + 2);
    const long count = count_of_cases(200, 200'000);
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const Pose pose = random_pose(random, scene, shape, 0.0);
            SCOPED_TRACE(describe(scene, shape, pose));
            ASSERT_NEAR(signed_distance(shape.shape, pose, scene.ground, 1.0).distance, 0.0, 1e-9);
            ASSERT_TRUE(test_contact(shape.shape, pose, scene.ground).is_touching);
        }
    }
}

}  // namespace terrane::lift_laws_test

// Contacts exist wherever brute force overlaps; normals are in the ground's normal cones, depths along normals.

namespace terrane::contact_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260304;

TEST(LawsOfContacts, ExistWhereverBruteForceOverlapsAndNoneIsAGap) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(500, 100'000);
    std::array<Contact, 256> contacts;
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double lift = 1e-6 + std::pow(10.0, random.between(-6.0, 0.5));
            const Pose pose = random_pose(random, scene, shape, lift);
            const ContactAnswer answer =
                find_contacts(shape.shape, pose, scene.ground, 0.0, contacts);
            SCOPED_TRACE(describe(scene, shape, pose));
            ASSERT_EQ(answer.status, QueryStatus::ok);
            EXPECT_NEAR(answer.lift, lift, 1e-9);
            ASSERT_GT(answer.count, 0u);
            EXPECT_GT(contacts[0].depth, 0.0);
            for (std::size_t k = 0; k < answer.count; ++k) EXPECT_GE(contacts[k].depth, -1e-8);
        }
    }
}

// Whether a contact's normal is in the normal cone at a feature within reach of its point, with the supporting plane
// `depth` above the point.
bool is_normal_of_ground(const Soup& soup, const Contact& contact, double reach) {
    constexpr double kSlack = 1e-9;
    const Eigen::Vector3d& n = contact.normal;
    bool is_found = false;
    const Vec<double> around = Vec<double>::Constant(reach);
    const auto is_through = [&](const Eigen::Vector3d& v) {
        return std::abs(n.dot(v) - contact.depth) < kSlack;
    };
    // Triangles near the point, relative to it; then all triangles that share their corners.
    std::vector<SoupTriangle<double>> near;
    soup.visit<double>(contact.point_world, -around, around, -1e300,
                       [&](const SoupTriangle<double>& t) { near.push_back(t); });
    const auto all_below = [&](const Eigen::Vector3d& a, const Eigen::Vector3d* b) {
        for (const SoupTriangle<double>& t : near) {
            bool has_a = false, has_b = b == nullptr;
            for (const Eigen::Vector3d& v : t.v) {
                has_a = has_a || v == a;
                has_b = has_b || v == *b;
            }
            if (!has_a || !has_b) continue;
            for (const Eigen::Vector3d& v : t.v) {
                if (n.dot(v - a) > kSlack * (1.0 + (v - a).norm())) return false;
            }
        }
        return true;
    };
    for (const SoupTriangle<double>& t : near) {
        const Eigen::Vector3d face = (t.v[1] - t.v[0]).cross(t.v[2] - t.v[0]).normalized();
        if ((face - n).norm() < kSlack && is_through(t.v[0])) is_found = true;
        for (std::size_t k = 0; k < 3 && !is_found; ++k) {
            const Eigen::Vector3d &a = t.v[k], &b = t.v[(k + 1) % 3];
            if (!is_through(a)) continue;
            // an edge that is not perpendicular to n is not its supporting feature
            if (is_through(b) && all_below(a, &b)) is_found = true;
            if (all_below(a, nullptr)) is_found = true;
        }
        if (is_found) return true;
    }
    return false;
}

// Largest distance of a contact point from the feature that its contact names, metres.
constexpr double kOnFeature = 1e-7;

bool lies_in_some_face(const OraclePart& part, const Eigen::Vector3d& p) {
    return std::any_of(part.triangles.begin(), part.triangles.end(), [&](const auto& corners) {
        std::array<Eigen::Vector3d, 3> v;
        for (std::size_t k = 0; k < 3; ++k) v[k] = part.points[corners[k]];
        const Eigen::Vector3d n = (v[1] - v[0]).cross(v[2] - v[0]).normalized();
        bool is_inside = std::abs(n.dot(p - v[0])) < kOnFeature;
        for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector3d edge = (v[(k + 1) % 3] - v[k]).normalized();
            is_inside = is_inside && n.dot(edge.cross(p - v[k])) > -kOnFeature;
        }
        return is_inside;
    });
}

bool lies_on_feature(const LawShape& shape, const Pose& pose, const Contact& contact) {
    const OraclePart& part = shape.oracle.parts[contact.part];
    Eigen::Vector3d p = pose.rotation.transpose() * (contact.point_world - pose.translation);
    const ShapeFeature& feature = contact.feature;
    if (feature.second == ShapeFeature::kFace) {
        if (!lies_in_some_face(part, p)) return false;
        const auto* box = std::get_if<Box>(&shape.shape);
        if (const auto* compound = std::get_if<Compound>(&shape.shape)) {
            const CompoundPart& of = compound->parts()[contact.part];
            box = std::get_if<Box>(&of.shape);
            p = of.body_from_part.rotation.transpose() * (p - of.body_from_part.translation);
        }
        if (box == nullptr) return true;  // the order of a hull's faces is not public
        const auto axis = static_cast<Eigen::Index>(feature.first / 2);
        const double side = feature.first % 2 == 0 ? -1.0 : 1.0;
        return std::abs(p[axis] - side * box->half_extents[axis]) < kOnFeature;
    }
    const Eigen::Vector3d &a = part.points[feature.first], &b = part.points[feature.second];
    const Eigen::Vector3d along = b - a;
    const double s = along.squaredNorm() > 0.0
                         ? std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0)
                         : 0.0;
    return std::abs((a + s * along - p).norm() - part.radius) < kOnFeature;
}

TEST(LawsOfContacts, HaveNormalsInTheGroundsConeAndDepthsAlongThem) {
    SeededRandom random(kSeed + 1);
    const long count = count_of_cases(300, 100'000);
    std::array<Contact, 256> contacts;
    for (const LawShape& shape : law_shapes()) {
        long compared = 0;
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double lift = shallow_depth(shape) * random.between(-0.5, 1.0);
            const Pose pose = random_pose(random, scene, shape, lift);
            SCOPED_TRACE(describe(scene, shape, pose));
            const ContactAnswer answer =
                find_contacts(shape.shape, pose, scene.ground, shallow_depth(shape), contacts);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            const double reach = shallow_depth(shape) + 1e-6;
            for (std::size_t k = 0; k < answer.count; ++k) {
                const Contact& contact = contacts[k];
                ++compared;
                ASSERT_NEAR(contact.normal.norm(), 1.0, 1e-12);
                ASSERT_GT(contact.normal.z(), 0.0);
                if (k > 0) {
                    ASSERT_GE(contacts[k - 1].depth, contact.depth);
                }
                ASSERT_TRUE(lies_on_feature(shape, pose, contact)) << k;
                ASSERT_TRUE(is_normal_of_ground(scene.soup, contact, reach)) << k;
                // At most four contacts on one plane.
                int same = 0;
                for (std::size_t j = 0; j < answer.count; ++j) {
                    same += (contacts[j].normal - contact.normal).norm() < 1e-12 &&
                            std::abs(contacts[j].depth - contact.depth +
                                     contact.normal.dot(contacts[j].point_world -
                                                        contact.point_world)) < 1e-12;
                }
                ASSERT_LE(same, 4);
            }
        }
        EXPECT_GT(compared, count / 20) << shape.name;
    }
}

TEST(LawsOfContacts, AgreeWithTestAndDistance) {
    SeededRandom random(kSeed + 2);
    const long count = count_of_cases(800, 100'000);
    std::array<Contact, 256> contacts;
    for (const LawShape& shape : law_shapes()) {
        long touching = 0, single = 0;
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double lift = shallow_depth(shape) * random.between(-1.0, 1.0);
            const Pose pose = random_pose(random, scene, shape, lift);
            SCOPED_TRACE(describe(scene, shape, pose));
            const ContactAnswer answer =
                find_contacts(shape.shape, pose, scene.ground, 0.0, contacts);
            const double distance = signed_distance(shape.shape, pose, scene.ground, 1.0).distance;
            const bool is_touching = test_contact(shape.shape, pose, scene.ground).is_touching;
            ASSERT_EQ(is_touching, lift > 0.0);
            // smaller distances may count as touching
            if (std::abs(distance) > 1e-9) {
                ASSERT_EQ(answer.count > 0, is_touching);
            }
            // No contact is deeper than the minimum translation.
            if (answer.count > 0) {
                EXPECT_LE(contacts[0].depth, -distance + 1e-9);
            }
            if (!is_touching) continue;
            ++touching;
            ASSERT_LT(distance, 0.0);
            ASSERT_GT(contacts[0].depth, 0.0);
            // Any overlap of a flat shape is deep: the minimum translation may be shorter than the contact's depth.
            if (answer.count != 1 || shape.name == "flat hull") continue;
            ++single;
            EXPECT_NEAR(contacts[0].depth, -distance, 1e-9);
        }
        EXPECT_GT(touching, count / 20) << shape.name;
        EXPECT_LT(touching, count - count / 20) << shape.name;
        if (shape.name != "flat hull") {
            EXPECT_GT(single, count / 10) << shape.name;
        }
    }
}

// The shortest translation by the depth of every contact separates a shape from any depth, and no contact is deeper
// than the lift.
TEST(LawsOfContacts, ResolveDeepOverlapsWithinTheLift) {
    SeededRandom random(kSeed + 5);
    const long count = count_of_cases(100, 20'000);
    std::array<Contact, 256> contacts;
    long turn = 0, shallower = 0;
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(turn++);
            const double lift = law_scale(shape) * std::exp2(random.between(-2.0, 4.0));
            const Pose pose = random_pose(random, scene, shape, lift);
            SCOPED_TRACE(describe(scene, shape, pose));
            const ContactAnswer answer =
                find_contacts(shape.shape, pose, scene.ground, 0.0, contacts);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_GT(answer.count, 0u);
            ASSERT_LE(contacts[0].depth, answer.lift + 1e-9);
            shallower += contacts[0].depth < 0.9 * answer.lift;
            internal::HalfSpaces wanted;
            if (answer.count > internal::HalfSpaces::kMost) continue;
            for (const Contact& contact : std::span(contacts).first(answer.count))
                wanted.add({contact.normal, contact.depth});
            Eigen::Vector3d d;
            ASSERT_TRUE(internal::find_shortest(wanted, d));
            Pose moved = pose;
            moved.translation += d;
            ASSERT_LE(compute_lift(shape.shape, moved, scene.ground).lift, 1e-9);
        }
    }
    EXPECT_GT(shallower, turn / 4);
}

// Round shapes, whose gap follows from the core's, have a contact at the closest feature.
TEST(LawsOfContacts, TheFirstOfASeparatedRoundShapeIsItsGap) {
    SeededRandom random(kSeed + 4);
    const long count = count_of_cases(1'000, 100'000);
    std::array<Contact, 256> contacts;
    for (const LawShape& shape : {shape_named("sphere"), shape_named("capsule")}) {
        long near = 0, apart = 0;
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double margin = random.between(0.0, 0.5);
            const Pose pose = random_pose(random, scene, shape, -random.between(0.0, 2.0 * margin));
            SCOPED_TRACE(describe(scene, shape, pose));
            const ContactAnswer answer =
                find_contacts(shape.shape, pose, scene.ground, margin, contacts);
            const DistanceAnswer gap = signed_distance(shape.shape, pose, scene.ground, 1.0);
            if (!gap.has_ground || std::abs(gap.distance - margin) < 1e-8) continue;
            ASSERT_EQ(answer.count > 0, gap.distance < margin) << gap.distance << ' ' << margin;
            if (answer.count == 0) {
                ++apart;
                continue;
            }
            ++near;
            ASSERT_NEAR(contacts[0].depth, -gap.distance, 1e-8);
        }
        EXPECT_GT(near, count / 20) << shape.name;
        EXPECT_GT(apart, count / 50) << shape.name;
    }
}

}  // namespace terrane::contact_laws_test
