// SPDX-License-Identifier: MIT
// Bodies of every shape and size on every kind of ground, vehicles and characters, static and kinematic bodies among
// them, for as many steps as TERRANE_BODY_STEPS says: none falls through.
#include "collision/bodies/body_cases.h"
#include "references/reference_maps.h"
#include "rough_grounds.h"
#include "support/heights/table_ground.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace terrane {
namespace marathon_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261122;
constexpr int kRoots = 4;             // of 128 m a side
constexpr std::size_t kBodies = 160;  // dynamic, of one shape each
constexpr int kOthers = 8;            // of each other kind

struct NamedGround {
    std::string name;
    Ground ground;
};

std::vector<NamedGround> make_grounds() {
    std::vector<NamedGround> grounds;
    for (const RoughGround& rough : kRoughGrounds) {
        grounds.push_back({rough.name, make_test_ground(rough.height, 1.0, kRoots)});
    }
    constexpr int kSide = 128 * kRoots + 1;
    const HeightTable table = make_contact_table(kSide, 1.0);
    const auto height = [&table](double x, double y) {
        return double{table.at(static_cast<int>(std::clamp(x, 0.0, kSide - 1.0)),
                               static_cast<int>(std::clamp(y, 0.0, kSide - 1.0)))};
    };
    grounds.push_back({"contact terrain", make_test_ground(height, 1.0, kRoots)});
    return grounds;
}

/// The parameters of a run: a function of its number.
struct Trial {
    explicit Trial(std::uint64_t number, std::size_t ground_count) : random(kSeed + number) {
        const auto one_of = [this](std::initializer_list<double> values) {
            return values.begin()[random.below(static_cast<int>(values.size()))];
        };
        ground = number % ground_count;
        speed = one_of({0.0, 30.0, 300.0});
        spin = one_of({0.0, 20.0, 200.0});
        // A step of 0.1 s has twelve substeps, and a body that spins at 3 km/s costs as much as hundreds of others.
        dt = one_of({1.0 / 240.0, 1.0 / 240.0, 1.0 / 120.0, 1.0 / 120.0, 1.0 / 60.0, 1.0 / 10.0});
        if (random.below(32) == 0) speed = 3000.0;
        scale = one_of({0.1, 0.3, 1.0, 3.0});
    }

    /// A random state, its lowest point above the ground by a share of `size`.
    BodyState make_start(const Shape& shape, const Ground& on, double size) {
        BodyState state = at({random.between(120.0, 392.0), random.between(120.0, 392.0), 0.0});
        state.pose.rotation = random.rotation();
        const double above = size * random.between(0.5, 10.0);
        state.pose.translation.z() += compute_lift(shape, state.pose, on).lift + above;
        state.velocity = {random.between(-0.3, 0.3) * speed, random.between(-0.3, 0.3) * speed,
                          -speed};
        state.angular_velocity = spin * random.direction();
        return state;
    }

    World make_world(const Ground& on) {
        WorldSettings settings;
        settings.allow_sleep = false;
        settings.report_contacts = random.below(2) == 0;
        World world = *World::create(settings);
        const std::vector<Shape> shapes = all_shapes(scale);
        for (std::size_t i = 0; i < kBodies; ++i) {
            BodySettings body;
            body.shape = shapes[i % shapes.size()];
            body.friction = random.between(0.0, 1.0);
            body.restitution = random.between(0.0, 1.0);
            EXPECT_TRUE(world.add(body, make_start(body.shape, on, scale)));
        }
        for (int i = 0; i < kOthers; ++i) {
            const Box block{scale * Eigen::Vector3d(random.between(0.2, 4.0),
                                                    random.between(0.2, 4.0),
                                                    random.between(0.1, 2.0))};
            BodyState state = make_start(block, on, scale);
            state.velocity = state.angular_velocity = Eigen::Vector3d::Zero();
            EXPECT_TRUE(world.add({.shape = block, .type = BodyType::static_body}, state));
            state = make_start(block, on, scale);
            state.velocity = 5.0 * random.direction();
            state.angular_velocity = random.direction();
            EXPECT_TRUE(world.add({.shape = block, .type = BodyType::kinematic_body}, state));
        }
        // Vehicles and characters have their sizes.
        for (int i = 0; i < kOthers; ++i) {
            const VehicleSettings kinds[] = {make_truck(), make_tracked(), make_six_wheeler()};
            const VehicleSettings& kind = kinds[i % 3];
            BodyState state = make_start(Sphere{4.0}, on, 1.0);
            vehicles.push_back(world.add_vehicle(kind, state.pose).value());
            EXPECT_TRUE(
                world.set_velocity(vehicles.back(), state.velocity, state.angular_velocity));
            state = make_start(Capsule{0.35, 0.55}, on, 1.0);
            characters.push_back(world.add_character({}, state.pose.translation).value());
            EXPECT_TRUE(
                world.set_velocity(characters.back(), state.velocity, Eigen::Vector3d::Zero()));
        }
        return world;
    }

    /// New controls for all.
    void control(World& world) {
        for (const BodyId vehicle : vehicles) {
            const VehicleControls controls{.throttle = random.between(-1.0, 1.0),
                                           .brake = random.below(4) == 0 ? 1.0 : 0.0,
                                           .steer = random.between(-1.0, 1.0)};
            EXPECT_TRUE(world.set_controls(vehicle, controls));
        }
        for (const BodyId character : characters) {
            const double pace = random.below(8) == 0 ? 60.0 : 6.0;
            CharacterControls controls;
            controls.velocity = {random.between(-pace, pace), random.between(-pace, pace)};
            controls.jump_speed = random.below(3) == 0 ? 6.0 : 0.0;
            EXPECT_TRUE(world.set_controls(character, controls));
        }
    }

    Random random;
    std::size_t ground = 0;
    double speed = 0.0, spin = 0.0, dt = 0.0, scale = 0.0;
    std::vector<BodyId> vehicles, characters;
};

// At least TERRANE_BODY_STEPS awake body steps, few by default, from run TERRANE_FIRST_RUN on, so that a long test can
// be split.
TEST(NobodyFalls, HoweverManyStepsAreTaken) {
    constexpr double kSeconds = 10.0;
    const char* asked = std::getenv("TERRANE_BODY_STEPS");
    const double most = asked == nullptr ? 1e5 : std::atof(asked);
    const std::vector<NamedGround> grounds = make_grounds();
    double steps = 0.0, lived = 0.0, lost = 0.0, shown = 0.0;
    const char* first = std::getenv("TERRANE_FIRST_RUN");
    std::uint64_t number = first == nullptr ? 0 : std::strtoull(first, nullptr, 10);
    std::uint64_t too_deep = 0, parked = 0;
    for (; steps < most; ++number) {
        Trial run(number, grounds.size());
        SCOPED_TRACE(testing::Message() << "run " << number << ", seed " << kSeed);
        const NamedGround& on = grounds[run.ground];
        World world = run.make_world(on.ground);
        std::uint64_t deep_here = 0;
        for (double time = 0.0; time < kSeconds && steps < most; time += run.dt) {
            if (std::floor(time) != std::floor(time - run.dt)) run.control(world);
            const StepReport report = world.step(on.ground, run.dt);
            deep_here += report.too_deep;
            parked += report.parked;
            lived += report.simulated_time;
            lost += report.lost_time;
            steps += static_cast<double>(report.awake);
        }
        EXPECT_EQ(deep_here, 0u) << on.name << ", " << run.speed << " m/s, " << run.spin
                                 << " rad/s, dt " << run.dt << ", scale " << run.scale;
        too_deep += deep_here;
        if (steps < shown + 1e6) continue;
        shown = steps;
        std::printf(
            "run %llu: %.0f of %.0f body steps, %.0f s lived, %.3g %% lost, %llu fell, "
            "%llu parked\n",
            static_cast<unsigned long long>(number), steps, most, lived,
            100.0 * lost / (lived + lost), static_cast<unsigned long long>(too_deep),
            static_cast<unsigned long long>(parked));
        std::fflush(stdout);
    }
    EXPECT_EQ(parked, 0u);
}

}  // namespace marathon_test
}  // namespace terrane
