// SPDX-License-Identifier: MIT
//
// Contact with contours of volumes, against closed forms of the volumes.
#include "collision/ground/volume_ground.h"
#include "collision/world/body_cases.h"
#include "collision/world/lone_vehicle.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/vehicle.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace terrane::volume_contact_test {

using namespace test;

double flat(double, double) { return 10.0; }

/// Balls whose convex hull is the shape.
std::vector<std::pair<Eigen::Vector3d, double>> balls_of(const Shape& shape) {
    if (const Sphere* s = std::get_if<Sphere>(&shape))
        return {{Eigen::Vector3d::Zero(), s->radius}};
    if (const Capsule* c = std::get_if<Capsule>(&shape)) {
        return {{{0.0, 0.0, c->half_height}, c->radius}, {{0.0, 0.0, -c->half_height}, c->radius}};
    }
    std::vector<std::pair<Eigen::Vector3d, double>> corners;
    const Eigen::Vector3d& half = std::get<Box>(shape).half_extents;
    for (int k = 0; k < 8; ++k) {
        const Eigen::Vector3d sign(k & 1 ? 1.0 : -1.0, k & 2 ? 1.0 : -1.0, k & 4 ? 1.0 : -1.0);
        corners.emplace_back(half.cwiseProduct(sign), 0.0);
    }
    return corners;
}

TEST(VolumeContact, DepthInASphereOfTwentyVoxelsIsThatOfTheFormula) {
    const Eigen::Vector3d centre(64.2, 63.9, -30.3);
    constexpr double kRadius = 20.0, kShare = 0.05;
    const Ground ground =
        make_volume_ground(flat, {place_volume(VolumeOp::remove, VolumeSphere{kRadius}, centre)});
    SeededRandom random(31);
    double worst = 0.0;
    for (const Shape& shape : simple_shapes(1.5)) {
        const auto balls = balls_of(shape);
        for (int i = 0; i < 300; ++i) {
            Pose pose{.rotation = random.rotation()};
            const Eigen::Vector3d out = random.direction();
            const double wanted = random.between(-0.3, 0.3);  // the wanted gap
            // Bisects along a direction; the gap decreases with the distance.
            const auto gap_at = [&](double along) {
                pose.translation = centre + along * out;
                double least = 1e9;
                for (const auto& [p, r] : balls)
                    least = std::min(least, kRadius - (pose * p - centre).norm() - r);
                return least;
            };
            double near = 0.0, far = kRadius;
            for (int k = 0; k < 60; ++k)
                (gap_at(0.5 * (near + far)) > wanted ? near : far) = 0.5 * (near + far);
            const double gap = gap_at(near);
            std::array<Contact, 192> contacts;
            const ContactAnswer answer = find_contacts(shape, pose, ground, 0.5, contacts);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_GT(answer.count, 0u) << name_of(shape) << i;
            worst = std::max(worst, std::abs(contacts[0].depth + gap));
            ASSERT_NEAR(contacts[0].depth, -gap, kShare) << name_of(shape) << i;
            const DistanceAnswer distance = signed_distance(shape, pose, ground, 1.0);
            ASSERT_EQ(distance.status, QueryStatus::ok);
            if (gap > kShare) {
                ASSERT_NEAR(distance.distance, gap, kShare) << name_of(shape) << i;
            } else if (gap < -kShare) {
                ASSERT_LT(distance.distance, gap + kShare);
                ASSERT_GT(distance.distance, 2.0 * gap - kShare) << name_of(shape) << i;
            }
            ASSERT_GE(answer.error_m, std::abs(contacts[0].depth + gap));
        }
    }
    std::printf("worst difference of depths: %.3f voxels\n", worst);
}

TEST(VolumeContact, AShapeBehindTheWallComesOutTheShortWay) {
    const Eigen::Vector3d centre(64.2, 63.9, -30.3);
    const Ground ground =
        make_volume_ground(flat, {place_volume(VolumeOp::remove, VolumeSphere{20.0}, centre)});
    SeededRandom random(34);
    for (const Shape& shape : simple_shapes(0.8)) {
        for (int i = 0; i < 30; ++i) {
            const double radius = bounding_radius(shape), depth = random.between(0.0, 2.0);
            Pose pose{random.rotation(), centre + (20.0 + radius + depth) * random.direction()};
            const DistanceAnswer answer = signed_distance(shape, pose, ground, 0.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_GT(answer.distance, -1.5 * (2.0 * radius + depth)) << name_of(shape) << i;
            pose.translation -= answer.distance * answer.normal;
            for (const auto& [p, r] : balls_of(shape)) {
                ASSERT_LT((pose * p - centre).norm() + r, 20.05) << name_of(shape) << i;
            }
        }
    }
}

TEST(VolumeContact, ABodyInACliffDoesNotComeOutIntoTheRockBeforeIt) {
    // The cliff is 30 m high. The rock stands before it, and a gap between them is too narrow for the bodies.
    const auto cliff = [](double x, double) { return x < 58.5 ? 40.0 : 10.0; };
    const Eigen::Vector3d centre(72.0, 64.0, 30.0);
    const Ground ground = make_volume_ground(
        cliff, {place_volume(VolumeOp::add, VolumeBox{Eigen::Vector3d(11.0, 50.0, 25.0)}, centre)});
    SeededRandom random(35);
    for (const Shape& shape : simple_shapes(1.5)) {
        const double radius = bounding_radius(shape);
        for (int i = 0; i < 40; ++i) {
            Pose pose{random.rotation(), centre};
            pose.translation.x() = 56.0 - radius - random.between(0.0, 6.0);
            pose.translation.y() += random.between(-20.0, 20.0);
            pose.translation.z() = random.between(14.0, 36.0);
            const DistanceAnswer answer = signed_distance(shape, pose, ground, 0.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_LE(answer.distance_lower_bound, -answer.distance);
            pose.translation -= answer.distance * answer.normal;
            const DistanceAnswer after = signed_distance(shape, pose, ground, 1.0);
            EXPECT_GE(after.distance, -1e-6)
                << name_of(shape) << " " << i << " at " << pose.translation.transpose();
        }
    }
}

TEST(VolumeContact, ABoxCavityHasItsWallsTwoVoxelsFromItsEdges) {
    SeededRandom random(32);
    const Eigen::Matrix3d rotation = turned({0.3, -0.2, 0.4});
    const Eigen::Vector3d centre(64.2, 63.9, -30.3), half(15.0, 12.0, 9.0);
    const Ground ground = make_volume_ground(
        flat, {place_volume(VolumeOp::remove, VolumeBox{half}, centre, rotation)});
    for (int i = 0; i < 500; ++i) {
        const Sphere sphere{random.between(0.3, 2.0)};
        const int axis = random.below(3);
        const double side = random.below(2) == 0 ? -1.0 : 1.0;
        Eigen::Vector3d p;
        for (int k = 0; k < 3; ++k) {
            const double room = half[k] - 2.0 - sphere.radius;
            p[k] = random.between(-room, room);
        }
        const double gap = random.between(-0.2, 0.2);
        p[axis] = side * (half[axis] - sphere.radius - gap);
        Pose pose{.translation = centre + rotation * p};
        std::array<Contact, 64> contacts;
        const ContactAnswer answer = find_contacts(sphere, pose, ground, 0.5, contacts);
        ASSERT_GT(answer.count, 0u);
        ASSERT_NEAR(contacts[0].depth, -gap, 0.05) << i;
        ASSERT_NEAR(contacts[0].normal.dot(rotation.col(axis)), -side, 0.01) << i;
    }
}

TEST(VolumeBodies, StayInACavernOfTwoShapes) {
    const Eigen::Vector3d centre(64.0, 64.0, -15.0);
    const Ground ground = make_volume_ground(
        flat, {place_volume(VolumeOp::remove, VolumeSphere{12.0}, centre),
               place_volume(VolumeOp::remove, VolumeCapsule{4.0, 14.0}, {64.0, 64.0, 2.0})});
    SeededRandom random(33);
    std::vector<Eigen::Vector3d> directions;
    for (int i = 0; i < 40; ++i) directions.push_back(random.direction());
    for (const double speed : {0.0, 300.0}) {
        for (const double dt : {1.0 / 60.0, 0.1}) {
            WorldSettings settings{.collide_bodies = false};
            World world = make_world(settings);
            std::vector<BodyId> bodies;
            for (int i = 0; i < 24; ++i) {
                const auto shapes = simple_shapes(0.5);
                BodyState state = at(centre + random.between(0.0, 9.0) * random.direction());
                state.velocity = speed * random.direction();
                state.pose.rotation = random.rotation();
                bodies.push_back(
                    add(world, {.shape = shapes[static_cast<std::size_t>(i % 3)]}, state));
            }
            for (double time = 0.0; time < 4.0; time += dt) {
                ASSERT_EQ(world.step(ground, dt).too_deep, 0u) << speed << ' ' << dt;
                for (const BodyId body : bodies) {
                    const Pose& pose = world.state(body).pose;
                    for (const auto& [p, r] : balls_of(world.settings(body).shape)) {
                        const Eigen::Vector3d q = pose * p;
                        for (const Eigen::Vector3d& out : directions) {
                            const Eigen::Vector3d x = q + r * out;
                            const double sphere = (x - centre).norm() - 12.0;
                            Eigen::Vector3d axis = x - Eigen::Vector3d(64.0, 64.0, 2.0);
                            axis.z() -= std::clamp(axis.z(), -14.0, 14.0);
                            const double shaft = axis.norm() - 4.0, above = 10.0 - x.z();
                            // Contours are within 0.02 voxels of spheres but cut off edges where shapes meet.
                            const bool is_corner =
                                std::abs(shaft) < 1.5 &&
                                (std::abs(sphere) < 1.5 || std::abs(above) < 1.5);
                            ASSERT_LT(std::min({sphere, shaft, above}), is_corner ? 0.6 : 0.05)
                                << pose.translation.transpose() << " at " << time;
                        }
                    }
                }
            }
        }
    }
}

TEST(VolumeVehicles, ATruckDrivesRoundATunnel) {
    constexpr double kLoop = 40.0, kTube = 5.0, kDepth = -20.0, kFloor = -23.0;
    VolumeTube tube{{}, kTube};
    std::vector<Eigen::Vector2d> path;
    for (int i = 0; i <= 96; ++i) {
        const double a = 2.0 * 3.14159265358979 * i / 64.0;
        const Eigen::Vector2d p(64.0 + kLoop * std::cos(a), 64.0 + kLoop * std::sin(a));
        if (i <= 64) tube.path_shape.emplace_back(p.x(), p.y(), kDepth);
        path.push_back(p);
    }
    VolumeOperation road =
        place_volume(VolumeOp::add, VolumeBox{{60.0, 60.0, 2.0}}, {64.0, 64.0, kFloor - 2.0});
    const Ground ground = make_volume_ground(
        flat, {place_volume(VolumeOp::remove, tube, Eigen::Vector3d::Zero()), road});
    Pose start{turned({0.0, 0.0, 1.5707963}), {path[0].x(), path[0].y(), kFloor + 1.0}};
    LoneVehicle truck(start, make_truck());
    PathDriver driver = PathDriver::create(path, {.cruise_speed = 7.0}).value();
    double angle = 0.0, before = 0.0;
    for (int i = 0; i < 60 * 60; ++i) {
        const StepReport report = truck.step(
            ground, driver.drive(truck.settings(), truck.state(), 1.0 / 60.0), 1.0 / 60.0);
        ASSERT_EQ(report.too_deep, 0u) << i;
        ASSERT_EQ(report.parked, 0u) << i;
        const Pose& pose = truck.chassis().pose;
        const Eigen::Vector2d from = pose.translation.head<2>() - Eigen::Vector2d(64.0, 64.0);
        const double now = std::atan2(from.y(), from.x());
        double change = now - before;
        if (change < -3.0) change += 6.283185307179586;
        if (change > 3.0) change -= 6.283185307179586;
        angle += change;
        before = now;
        for (const auto& [p, r] : balls_of(Box{truck.settings().chassis_half_extents})) {
            const Eigen::Vector3d q = pose * p;
            const double across = (q.head<2>() - Eigen::Vector2d(64.0, 64.0)).norm() - kLoop;
            ASSERT_LT(std::hypot(across, q.z() - kDepth), kTube + 0.1) << i;
            ASSERT_GT(q.z(), kFloor - 0.1) << i;
        }
        if (i > 120) {
            ASSERT_NEAR(pose.translation.z(), kFloor + 0.75, 0.3) << i;
        }
    }
    EXPECT_GT(angle, 6.3);
    EXPECT_FALSE(truck.is_rolled_over());
}

TEST(VolumeCharacters, OneWalksIntoAHillAndStopsAtTheEnd) {
    const auto hill = [](double x, double) { return std::clamp(x - 40.0, 0.0, 20.0); };
    // A tunnel along x from the foot of the hill, with its floor slightly below the ground.
    const Ground ground = make_volume_ground(
        hill, {place_volume(VolumeOp::remove, VolumeBox{{30.0, 3.0, 2.5}}, {70.0, 64.0, 2.4})});
    LoneCharacter character({33.0, 64.2, 1.0});
    for (int i = 0; i < 60 * 40; ++i) {
        const StepReport report = character.step(ground, {.velocity = {2.0, 0.0}}, 1.0 / 60.0);
        ASSERT_EQ(report.too_deep, 0u) << i;
        const WorldPos& p = character.place();
        ASSERT_GT(p.z() - kTall, -0.2) << i;
        ASSERT_LT(p.z() - kTall, 0.3) << i << ": it does not climb the hill, at " << p.x();
        ASSERT_LT(p.x(), 100.0 - 0.3) << i;
        if (p.x() > 45.0 && p.x() < 95.0) {
            ASSERT_TRUE(character.state().stands) << i;
            ASSERT_NEAR(p.z() - kTall, -0.1, 0.05) << i;
        }
    }
    EXPECT_GT(character.place().x(), 98.0);
}

TEST(VolumeBodies, NeitherFallThroughABridgeNorFlyIntoItFromBelow) {
    // A floating slab of 20 x 20 x 4 voxels.
    const Ground ground = make_volume_ground(
        flat, {place_volume(VolumeOp::add, VolumeBox{{10.0, 10.0, 2.0}}, {64.0, 64.0, 30.0})});
    for (const double speed : {0.0, 30.0, 300.0, 3000.0}) {
        for (const double dt : {1.0 / 60.0, 0.1}) {
            for (const Shape& shape : all_shapes(0.5)) {
                World world = make_world();
                const BodyId above =
                    add(world, {.shape = shape}, at({64.3, 63.8, 36.0}, {0.0, 0.0, -speed}));
                const BodyId below =
                    add(world, {.shape = shape}, at({64.3, 63.8, 15.0}, {0.0, 0.0, speed}));
                for (int i = 0; i < 40; ++i) {
                    ASSERT_EQ(world.step(ground, dt).too_deep, 0u);
                    for (const BodyId body : {above, below}) {
                        const Eigen::Vector3d p =
                            world.state(body).pose.translation - Eigen::Vector3d(64.0, 64.0, 30.0);
                        if (p.head<2>().cwiseAbs().maxCoeff() >= 9.0) continue;
                        ASSERT_GT(body == above ? p.z() : -p.z(), 2.0)
                            << name_of(shape) << speed << ' ' << i;
                    }
                }
            }
        }
    }
}

TEST(VolumeBodies, ABoxSlidesOverTheBorderOfTwoChunks) {
    const Ground ground = make_volume_ground(
        flat, {place_volume(VolumeOp::remove, VolumeBox{{20.0, 10.0, 6.0}}, {128.3, 64.2, -20.0})},
        2);
    World world = make_world();
    const BodyId body =
        add(world, {.shape = Box{{0.5, 0.4, 0.3}}, .friction = 0.0, .restitution = 0.0},
            at({115.0, 64.1, -25.7}, {4.0, 0.1, 0.0}));
    for (int i = 0; i < 330; ++i) {
        ASSERT_EQ(world.step(ground, 1.0 / 60.0).too_deep, 0u);
        const BodyState& state = world.state(body);
        ASSERT_LT(state.angular_velocity.norm(), 0.02) << i;
        ASSERT_NEAR(state.velocity.x(), 4.0, 0.02) << i;
        ASSERT_NEAR(state.pose.translation.z(), -25.7, 0.02) << i;
    }
    EXPECT_GT(world.state(body).pose.translation.x(), 136.0);
}

}  // namespace terrane::volume_contact_test

// Bodies among random volumes in rough ground. The oracle is Ground::height_below(): no point of a body shrunk by its
// tolerance is in the solid.

namespace terrane::random_volume_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261124;

Ground make_random_ground(Random& random) {
    const double steep = random.between(0.0, 6.0), wave = random.between(0.1, 0.6);
    const auto height = [=](double x, double y) {
        return 10.0 + steep * std::sin(wave * x) * std::cos(0.8 * wave * y);
    };
    std::vector<VolumeOperation> operations;
    const int count = 6 + random.below(12);
    for (int i = 0; i < count; ++i) {
        const Eigen::Vector3d place(random.between(40.0, 88.0), random.between(40.0, 88.0),
                                    random.between(-12.0, 14.0));
        const Eigen::Matrix3d rotation = random.rotation();
        const VolumeOp op = random.below(4) == 0 ? VolumeOp::add : VolumeOp::remove;
        const double size = random.between(2.5, 8.0);
        switch (random.below(4)) {
            case 0:
                operations.push_back(place_volume(op, VolumeSphere{size}, place));
                break;
            case 1:
                operations.push_back(
                    place_volume(op, VolumeCapsule{0.6 * size, 2.0 * size}, place, rotation));
                break;
            case 2:
                operations.push_back(
                    place_volume(op, VolumeBox{{size, 0.6 * size, 0.8 * size}}, place, rotation));
                break;
            default:
                operations.push_back(place_volume(op,
                                                  VolumeTube{{{0.0, 0.0, 0.0},
                                                              size * random.direction() * 3.0,
                                                              size * random.direction() * 3.0},
                                                             3.0},
                                                  place));
        }
    }
    return make_volume_ground(height, operations);
}

/// Points of a body's surface, moved inwards by a tolerance; none of hulls and compounds.
std::vector<Eigen::Vector3d> inner_points(const Shape& shape, double tolerance) {
    std::vector<Eigen::Vector3d> points;
    const auto add_ball = [&](double z, double radius) {
        for (int i = 0; i < 3; ++i) {
            for (const double side : {-1.0, 1.0}) {
                points.push_back(z * Eigen::Vector3d::UnitZ() +
                                 side * (radius - tolerance) * Eigen::Vector3d::Unit(i));
            }
        }
    };
    if (const Sphere* s = std::get_if<Sphere>(&shape)) {
        add_ball(0.0, s->radius);
    } else if (const Capsule* c = std::get_if<Capsule>(&shape)) {
        for (int i = -2; i <= 2; ++i) add_ball(0.5 * i * c->half_height, c->radius);
    } else if (const Box* b = std::get_if<Box>(&shape)) {
        const Eigen::Vector3d half = b->half_extents.array() - tolerance;
        for (int k = 0; k < 27; ++k) {
            const int row = k / 3 % 3, layer = k / 9;
            points.push_back(half.cwiseProduct(Eigen::Vector3d(k % 3 - 1, row - 1, layer - 1)));
        }
    }
    return points;
}

bool is_solid(const Ground& ground, const WorldPos& p) {
    // Three points, because a vertical line may pass through an edge.
    for (const double d : {0.0, 1e-6, -1e-6}) {
        const HeightAnswer below = ground.height_below(p.x() + d, p.y() - 0.7 * d, p.z());
        if (below.status == QueryStatus::outside) return false;
        if (below.status == QueryStatus::ok && below.normal.z() > 0.0) return false;
    }
    return true;
}

TEST(RandomVolumes, NobodyGetsIntoTheSolid) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    const int first = number_from("TERRANE_VOLUME_FIRST", 240);
    const int count = number_from("TERRANE_VOLUME_SCENES", few_or_many(4, 6));
    const double seconds = few_or_many(2, 3);
    for (int scene = first; scene < first + count; ++scene) {
        Random random(kSeed + static_cast<std::uint64_t>(scene));
        const Ground ground = make_random_ground(random);
        const double speed =
            std::array{0.0, 20.0, 300.0, 3000.0}[static_cast<std::size_t>(random.below(4))];
        const double dt = random.below(2) == 0 ? 1.0 / 60.0 : 0.1;
        const double scale = std::array{0.2, 0.6, 1.5}[static_cast<std::size_t>(random.below(3))];
        WorldSettings settings{.collide_bodies = false};
        World world = make_world(settings);
        std::vector<BodyId> bodies;
        const std::vector<Shape> shapes = all_shapes(scale);
        for (int i = 0; i < 400 && bodies.size() < 30; ++i) {
            const Shape& shape = shapes[static_cast<std::size_t>(i) % shapes.size()];
            BodyState state = at({random.between(42.0, 86.0), random.between(42.0, 86.0),
                                  random.between(-12.0, 22.0)});
            state.pose.rotation = random.rotation();
            state.velocity = speed * random.direction();
            state.angular_velocity = 10.0 * random.direction();
            const DistanceAnswer free = signed_distance(shape, state.pose, ground, 1.0);
            if (free.status != QueryStatus::ok || !(free.distance > 0.01)) continue;
            bodies.push_back(world.add({.shape = shape}, state).value());
        }
        ASSERT_GT(bodies.size(), 5u) << scene;
        for (double time = 0.0; time < seconds; time += dt) {
            const StepReport report = world.step(ground, dt);
            ASSERT_EQ(report.too_deep, 0u) << "scene " << scene << " at " << time;
            ASSERT_EQ(report.placed_deep, 0u) << "scene " << scene << " at " << time;
            for (const BodyId body : bodies) {
                const Shape& shape = world.settings(body).shape;
                const Pose& pose = world.state(body).pose;
                const double inside = 1.01 * default_contact_tolerance(shape) + 1e-6;
                for (const Eigen::Vector3d& p : inner_points(shape, inside)) {
                    const WorldPos x = pose * p;
                    ASSERT_FALSE(is_solid(ground, x) && ground.extent().contains(x.x(), x.y()))
                        << "scene " << scene << ", " << name_of(shape) << ' ' << body.index
                        << " at " << time << ": " << pose.translation.transpose() << ", speed "
                        << speed << ", dt " << dt;
                }
            }
        }
    }
}

}  // namespace terrane::random_volume_test
