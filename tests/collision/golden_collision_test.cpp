// SPDX-License-Identifier: MIT
//
// Bits of body states after a second of falling, bouncing and sliding. They may change only with an entry in
// CHANGELOG.md; a failure prints the new hash. Built with both compilers at several optimisation levels, which must
// agree.
#include "support/random.h"

#include <terrane/collision/collision_proxy.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/vehicle.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

namespace terrane::golden_bodies_test {

/// A world on paged fractal ground.
struct PagedWorld {
    explicit PagedWorld(const WorldSettings& settings) : world(World::create(settings).value()) {}

    /// A position above the ground.
    WorldPos above(double x, double y, double height) const {
        return {x, y, source->height(x, y) + height};
    }
    StepReport step(int number) {
        pager.update({}, world.needs(), number / 60.0);
        return world.step(pager.ground(), 1.0 / 60.0);
    }
    void expect_hash(std::uint64_t hash) const {
        EXPECT_EQ(world.state_hash(), hash) << std::hex << world.state_hash();
    }

    std::shared_ptr<const HeightSource> source =
        FractalHeights::create({.seed = 12, .root_size_log2 = 12}).value();
    Pager pager = Pager::create(source, {.worker_count = 0, .horizon = 0.1}).value();
    World world;
};

TEST(GoldenBodies, AreTheSameWithEveryCompilerAtEveryLevel) {
    PagedWorld paged({});
    const std::array<Shape, 3> shapes{Sphere{0.5}, Capsule{0.4, 0.8}, Box{{1.0, 2.0, 0.5}}};
    for (int i = 0; i < 18; ++i) {
        BodyState state;
        state.pose.translation = paged.above(11.0 * i - 90.0, 7.0 * (i % 5), 4.0 + 0.5 * i);
        state.velocity = {3.0 * (i % 4), -2.0, -20.0 * (i % 6)};
        state.angular_velocity = {0.5 * i, 1.0, -2.0};
        ASSERT_TRUE(paged.world.add({.shape = shapes[static_cast<std::size_t>(i) % 3]}, state));
    }
    for (int step = 0; step < 60; ++step) paged.step(step);
    paged.expect_hash(0x653de30922f4de9bu);
}

// A heap of all shapes, on several threads.
TEST(GoldenBodies, OfAHeapAreTheSameWithEveryCompilerAtEveryLevel) {
    PagedWorld paged({.worker_count = 3});
    const ConvexHull wedge =
        ConvexHull::create(
            std::vector<Eigen::Vector3d>{{0, 0, 0}, {1.1, 0, 0}, {0, 0.9, 0}, {0.2, 0.1, 0.8}})
            .value();
    CompoundPart knob{Sphere{0.4}, {}};
    knob.body_from_part.translation = {0.9, 0.1, 0.0};
    const Compound club =
        Compound::create(std::vector<CompoundPart>{{Box{{0.7, 0.2, 0.2}}, {}}, knob}).value();
    const std::array<Shape, 5> shapes{Sphere{0.5}, Capsule{0.4, 0.8}, Box{{1.0, 0.6, 0.5}}, wedge,
                                      club};
    for (int i = 0; i < 15; ++i) {
        BodyState state;
        const int row = i / 3 % 2, layer = i / 6;
        state.pose.translation = paged.above(1.3 * (i % 3), 1.1 * row, 3.0 + 1.2 * layer);
        state.velocity = {0.5 * (i % 4), -1.0, -3.0 * (i % 5)};
        state.angular_velocity = {0.5 * i, 1.0, -2.0};
        ASSERT_TRUE(paged.world.add({.shape = shapes[static_cast<std::size_t>(i) % 5]}, state));
    }
    std::uint64_t pairs = 0;
    for (int step = 0; step < 60; ++step) pairs += paged.step(step).touching_pairs;
    EXPECT_GT(pairs, 100u);
    paged.expect_hash(0x1741451deec80cfdu);
}

TEST(GoldenVehicles, AreTheSameWithEveryCompilerAtEveryLevel) {
    PagedWorld paged({});
    World& world = paged.world;
    const auto add = [&](const VehicleSettings& kind, double y, double height) {
        return world.add_vehicle(kind, {.translation = paged.above(0.0, y, height)}).value();
    };
    const BodyId truck = add(make_truck(), 0.0, 2.0);
    const BodyId tracked = add(make_tracked(), 30.0, 2.0);
    const BodyId six = add(make_six_wheeler(), 50.0, 2.5);
    const BodyId walker = world.add_character({}, paged.above(8.0, 20.0, 1.2)).value();
    PathDriver driver =
        PathDriver::create({{0.0, 0.0}, {20.0, 2.0}, {30.0, 15.0}, {25.0, 60.0}}, {}).value();
    for (int step = 0; step < 240; ++step) {
        const double turn = step < 120 ? 0.3 : -0.6;
        ASSERT_TRUE(world.set_controls(truck, driver.drive(*world.vehicle_settings(truck),
                                                           *world.vehicle(truck), 1.0 / 60.0)));
        ASSERT_TRUE(world.set_controls(tracked, {.throttle = 0.8, .steer = turn}));
        ASSERT_TRUE(world.set_controls(six, {.throttle = 0.5, .steer = turn}));
        CharacterControls pace{.velocity = {2.0, step < 120 ? 1.0 : -1.0},
                               .jump_speed = step == 90 ? 3.0 : 0.0};
        ASSERT_TRUE(world.set_controls(walker, pace));
        EXPECT_EQ(paged.step(step).parked, 0u);
    }
    EXPECT_GT(world.vehicle(truck)->chassis.velocity.norm(), 1.0);
    paged.expect_hash(0x8a35d4495aaed353u);
}

}  // namespace terrane::golden_bodies_test

// Bits of hulls and of queries of all pairs of shapes. They may change only with an entry in CHANGELOG.md; a failure
// prints the new hash. Built with both compilers at several optimisation levels, which must agree.

namespace terrane::golden_pairs_test {

using namespace test;

// One draw per statement: the order of evaluation of operands is unspecified.
Eigen::Vector3d vector_up_to(Random& random, double longest) {
    const double size = random.between(0.0, longest);
    return size * random.direction();
}

Pose random_pose(Random& random, double far) {
    Motion turn{.start = {}, .rotation_vector = vector_up_to(random, 3.1)};
    Pose pose{turn.at(1.0).rotation, vector_up_to(random, far)};
    return pose;
}

void add(Hash& hash, const Eigen::Vector3d& v) {
    for (int i = 0; i < 3; ++i) hash.add(v[i]);
}

ConvexHull random_hull(Random& random, int count, double flat) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < count; ++i) {
        points.push_back(random.direction());
        points.back().z() *= flat;
    }
    return ConvexHull::create(points).value();
}

std::vector<ConvexHull> make_hulls() {
    Random random(41);
    std::vector<ConvexHull> hulls;
    for (const int count : {1, 2, 3, 4, 8, 20, 100, 1000}) {
        hulls.push_back(random_hull(random, count, 1.0));
        hulls.push_back(random_hull(random, count, 0.0));
    }
    // A rotated grid: many collinear and coplanar points, none exactly.
    std::vector<Eigen::Vector3d> grid;
    const Pose pose = random_pose(random, 1.0);
    for (int i = 0; i < 125; ++i) {
        const double x = i % 5, y = i / 5 % 5, z = i / 25;
        const Eigen::Matrix3d& r = pose.rotation;
        grid.emplace_back((r(0, 0) * x + r(0, 1) * y) + r(0, 2) * z,
                          (r(1, 0) * x + r(1, 1) * y) + r(1, 2) * z,
                          (r(2, 0) * x + r(2, 1) * y) + r(2, 2) * z);
    }
    hulls.push_back(ConvexHull::create(grid).value());
    return hulls;
}

TEST(GoldenHulls, AreTheSameWithEveryCompilerAtEveryLevel) {
    Hash hash;
    Random random(42);
    for (const ConvexHull& hull : make_hulls()) {
        for (const Eigen::Vector3d& vertex : hull.vertices()) add(hash, vertex);
        hash.add(hull.face_count());
        hash.add(bounding_radius(hull));
        hash.add(smallest_half_extent(hull));
        for (int i = 0; i < 20; ++i) hash.add(support_distance(hull, random.direction()));
    }
    EXPECT_EQ(hash.value(), 0x7f52b77af9f94df3u) << std::hex << hash.value();
}

std::vector<Shape> make_shapes() {
    Random random(43);
    std::vector<CompoundPart> parts(4);
    parts[0].shape = Box{{0.6, 0.2, 0.3}};
    parts[1].shape = Sphere{0.4};
    parts[2].shape = Capsule{0.15, 0.5};
    parts[3].shape = random_hull(random, 12, 0.5);
    for (CompoundPart& part : parts) part.body_from_part = random_pose(random, 0.8);
    std::vector<Eigen::Vector3d> corners;
    for (int i = 0; i < 9; ++i) {
        corners.emplace_back(i % 3 - 1.0, i / 3 - 1.0, random.between(-0.2, 0.2));
    }
    const std::vector<std::array<std::uint32_t, 3>> triangles{
        {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {3, 4, 7}, {3, 7, 6}, {4, 5, 8}, {4, 8, 7}};
    return {Sphere{0.5},
            Capsule{0.3, 0.6},
            Box{{0.7, 0.4, 0.5}},
            random_hull(random, 20, 0.6),
            random_hull(random, 200, 1.0),
            Compound::create(parts).value(),
            Compound::from_triangles(corners, triangles).value()};
}

void add_contacts(Hash& hash, std::span<const PairContact> contacts) {
    hash.add(contacts.size());
    for (const PairContact& contact : contacts) {
        add(hash, contact.point_world);
        add(hash, contact.normal);
        hash.add(contact.depth);
        hash.add(contact.feature_a.first);
        hash.add(contact.feature_a.second);
        hash.add(contact.feature_b.first);
        hash.add(contact.feature_b.second);
        hash.add(contact.part_a);
        hash.add(contact.part_b);
    }
}

// All queries of two shapes.
void add_answers(Hash& hash, const Shape& a, const Motion& motion_a, const Shape& b,
                 const Motion& motion_b) {
    const Pose& pose_a = motion_a.start;
    const Pose& pose_b = motion_b.start;
    hash.add(test_contact(a, pose_a, b, pose_b).is_touching);
    std::array<PairContact, 96> contacts;
    const PairContactAnswer found = find_contacts(a, pose_a, b, pose_b, 0.05, contacts);
    add_contacts(hash, std::span(contacts).first(found.count));
    const PairDistanceAnswer distance = signed_distance(a, pose_a, b, pose_b);
    hash.add(distance.distance);
    add(hash, distance.normal);
    add(hash, distance.point_a_world);
    add(hash, distance.point_b_world);
    const PseudodistanceAnswer pseudo = pseudodistance(a, pose_a, b, pose_b);
    hash.add(pseudo.pseudodistance);
    add(hash, pseudo.normal);
    for (const bool skips : {false, true}) {
        CastSettings settings{.skip_separating = skips};
        const PairCastAnswer met = cast(a, motion_a, b, motion_b, settings);
        hash.add(met.hit);
        hash.add(met.fraction);
        hash.add(met.started_in_contact);
        add_contacts(hash, std::span(met.contacts).first(met.count));
    }
    const ShapeRayAnswer ray = cast_ray(a, pose_a, pose_b.translation, pose_a.translation);
    hash.add(ray.hit);
    hash.add(ray.fraction);
    add(hash, ray.point_world);
    add(hash, ray.normal);
    hash.add(ray.part);
}

TEST(GoldenPairs, AnswerTheSameWithEveryCompilerAtEveryLevel) {
    Hash hash;
    Random random(44);
    const std::vector<Shape> shapes = make_shapes();
    for (const Shape& a : shapes) {
        for (const Shape& b : shapes) {
            for (int i = 0; i < 6; ++i) {
                Motion motion_a, motion_b;
                motion_a.start = random_pose(random, 1.0);
                motion_b.start = random_pose(random, 1.6);
                if (i % 5 == 0) motion_b.start.rotation = motion_a.start.rotation;
                motion_a.translation = 4.0 * random.direction();
                if (i % 2 == 0) motion_a.rotation_vector = 2.0 * random.direction();
                if (i % 3 == 0) motion_b.rotation_vector = random.direction();
                add_answers(hash, a, motion_a, b, motion_b);
            }
        }
    }
    EXPECT_EQ(hash.value(), 0x0f26b0728dd586c7u) << std::hex << hash.value();
}

}  // namespace terrane::golden_pairs_test

// Bits of collision proxies. They may change only with an entry in CHANGELOG.md; a failure prints the new hash. Built
// with both compilers at several optimisation levels, which must agree.

namespace terrane::golden_proxy_test {

using namespace test;

// An octahedron whose triangles are divided into four, `cuts` times, with vertices at random distances of 0.6 to 1. The
// only irrational function is the square root, which IEEE 754 rounds correctly.
TriangleMesh rock(int cuts) {
    TriangleMesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int cut = 0; cut < cuts; ++cut) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [place, is_new] =
                middles.try_emplace(std::minmax(a, b), mesh.positions.size());
            if (is_new) {
                const Eigen::Vector3d sum = mesh.positions[a] + mesh.positions[b];
                const double size =
                    std::sqrt(sum.x() * sum.x() + sum.y() * sum.y() + sum.z() * sum.z());
                mesh.positions.emplace_back(sum.x() / size, sum.y() / size, sum.z() / size);
            }
            return place->second;
        };
        std::vector<TriangleMesh::Triangle> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    Random random(21);
    for (Eigen::Vector3d& p : mesh.positions) p *= random.between(0.6, 1.0);
    return mesh;
}

void add_part(Hash& hash, const CompoundPart& part) {
    hash.add_all(std::span<const double>(part.body_from_part.rotation.data(), 9));
    hash.add_all(std::span<const double>(part.body_from_part.translation.data(), 3));
    if (const auto* hull = std::get_if<ConvexHull>(&part.shape)) {
        for (const Eigen::Vector3d& p : hull->vertices())
            hash.add_all(std::span<const double>(p.data(), 3));
    }
}

TEST(GoldenProxy, IsTheSameWithEveryCompilerAtEveryLevel) {
    const TriangleMesh mesh = rock(1);
    Hash hash;
    std::size_t hulls = 0;
    for (const double error : {0.3, 0.05, 0.01}) {
        const CollisionProxy proxy = make_collision_proxy(mesh, {.proxy_error = error}).value();
        hash.add(proxy.distance_m);
        hash.add(proxy.mesh_to_proxy_m);
        hash.add(proxy.proxy_to_mesh_m);
        hash.add(proxy.mesh_volume);
        hash.add(proxy.parts_volume);
        for (const CompoundPart& part : proxy.shape.parts()) add_part(hash, part);
        hulls += proxy.shape.parts().size();
    }
    EXPECT_GT(hulls, 3u);
    EXPECT_EQ(hash.value(), 0x8bad73fb5873fc9eu) << std::hex << hash.value();
}

}  // namespace terrane::golden_proxy_test
