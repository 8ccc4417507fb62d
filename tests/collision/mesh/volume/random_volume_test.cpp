// SPDX-License-Identifier: MIT
//
// Bodies among random volumes in rough ground. The judge is Ground::height_below(): points of a body that is shrunk by
// its tolerance are never in the solid.
#include "collision/bodies/body_cases.h"
#include "support/random.h"
#include "volume_ground.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

namespace terrane {
namespace random_volume_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261124;

/// Scenes from TERRANE_VOLUME_FIRST on, TERRANE_VOLUME_SCENES or a few.
int number_from(const char* name, int otherwise) {
    const char* const text = std::getenv(name);
    return text != nullptr ? std::atoi(text) : otherwise;
}

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

/// Points and radii that a body consists of, shrunk by a tolerance along every normal.
std::vector<std::pair<Eigen::Vector3d, double>> inner_points(const Shape& shape, double tolerance) {
    std::vector<std::pair<Eigen::Vector3d, double>> points;
    const auto add_ball = [&](const Eigen::Vector3d& p, double radius) {
        for (int i = 0; i < 3; ++i) {
            for (const double side : {-1.0, 1.0}) {
                points.emplace_back(p + side * (radius - tolerance) * Eigen::Vector3d::Unit(i),
                                    0.0);
            }
        }
    };
    if (const Sphere* s = std::get_if<Sphere>(&shape)) {
        add_ball(Eigen::Vector3d::Zero(), s->radius);
    } else if (const Capsule* c = std::get_if<Capsule>(&shape)) {
        for (int i = -2; i <= 2; ++i) add_ball({0.0, 0.0, 0.5 * i * c->half_height}, c->radius);
    } else if (const Box* b = std::get_if<Box>(&shape)) {
        for (int k = 0; k < 27; ++k) {
            const int row = k / 3 % 3, layer = k / 9;
            const Eigen::Vector3d sign(k % 3 - 1, row - 1, layer - 1);
            points.emplace_back(
                (b->half_extents - Eigen::Vector3d::Constant(tolerance)).cwiseProduct(sign), 0.0);
        }
    }
    return points;
}

bool is_solid(const Ground& ground, const WorldPos& p) {
    // Three points: a vertical line may run through an edge.
    for (const double d : {0.0, 1e-6, -1e-6}) {
        const HeightAnswer below = ground.height_below(p.x() + d, p.y() - 0.7 * d, p.z());
        if (below.status == GroundStatus::outside) return false;
        if (below.status == GroundStatus::ok && below.normal.z() > 0.0) return false;
    }
    return true;
}

TEST(RandomVolumes, NobodyGetsIntoTheSolid) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    const int first = number_from("TERRANE_VOLUME_FIRST", 240);
    const int count = number_from("TERRANE_VOLUME_SCENES", 6);
    for (int scene = first; scene < first + count; ++scene) {
        Random random(kSeed + static_cast<std::uint64_t>(scene));
        const Ground ground = make_random_ground(random);
        const double speed =
            std::array{0.0, 20.0, 300.0, 3000.0}[static_cast<std::size_t>(random.below(4))];
        const double dt = random.below(2) == 0 ? 1.0 / 60.0 : 0.1;
        const double scale = std::array{0.2, 0.6, 1.5}[static_cast<std::size_t>(random.below(3))];
        WorldSettings settings;
        settings.collide_bodies = false;
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
            if (free.status != QueryStatus::complete || !(free.distance > 0.01)) continue;
            bodies.push_back(world.add({.shape = shape}, state).value());
        }
        ASSERT_GT(bodies.size(), 5u) << scene;
        for (double time = 0.0; time < 3.0; time += dt) {
            const StepReport report = world.step(ground, dt);
            ASSERT_EQ(report.too_deep, 0u) << "scene " << scene << " at " << time;
            ASSERT_EQ(report.placed_deep, 0u) << "scene " << scene << " at " << time;
            for (const BodyId body : bodies) {
                const Shape& shape = world.settings()[body.index].shape;
                const Pose& pose = world.states()[body.index].pose;
                const double inside = 1.01 * default_contact_tolerance(shape) + 1e-6;
                for (const auto& [p, r] : inner_points(shape, inside)) {
                    ASSERT_FALSE(is_solid(ground, pose * p) &&
                                 ground.extent().contains((pose * p).x(), (pose * p).y()))
                        << "scene " << scene << ", " << name_of(shape) << ' ' << body.index
                        << " at " << time << ": " << pose.translation.transpose() << ", speed "
                        << speed << ", dt " << dt;
                }
            }
        }
    }
}

}  // namespace random_volume_test
}  // namespace terrane
