// SPDX-License-Identifier: MIT
//
// Dry-stone structures that stand only if contacts, friction and warm starts are correct; nothing sleeps. The long
// tests last a minute.
#include "collision/world/body_cases.h"
#include "references/reference_maps.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace terrane::structures_test {

using namespace test;

constexpr double kFloor = 5.0;  // height of make_flat()
constexpr double kX = 64.0, kY = 64.0;

/// A world whose bodies must stay in place.
class Structure {
public:
    /// Adds a body that does not bounce.
    BodyId add(BodySettings settings, const BodyState& state) {
        settings.restitution = 0.0;
        starts_.push_back(state.pose.translation);
        return test::add(world_, settings, state);
    }

    /// Largest displacement of a body after the time that structures must stand, metres.
    double moved() {
        const double seconds = number_from("TERRANE_STANDING_SECONDS", 10.0);
        take_steps(world_, make_flat(), static_cast<int>(seconds / kStep));
        double most = 0.0;
        for (std::size_t i = 0; i < starts_.size(); ++i) {
            most = std::max(most, (world_.states()[i].pose.translation - starts_[i]).norm());
        }
        std::printf("moved %.3g m in %.0f s\n", most, seconds);
        return most;
    }

    const WorldPos& place_of(BodyId id) const { return world_.state(id).pose.translation; }

private:
    World world_ = make_world({.allow_sleep = false});
    std::vector<WorldPos> starts_;
};

TEST(Structures, ABrickWallStands) {
    Structure wall;
    const Eigen::Vector3d brick(0.2, 0.1, 0.08);
    for (int row = 0; row < 10; ++row) {
        for (int i = 0; i < 10; ++i) {
            const double x = kX + (0.4 * i) + (row % 2 == 0 ? 0.0 : 0.2);
            wall.add({.shape = Box{brick}, .mass = 4.0, .friction = 0.7},
                     at({x, kY, kFloor + 0.08 + 0.16 * row}));
        }
    }
    EXPECT_LT(wall.moved(), 0.02);
}

TEST(Structures, AHouseOfCardsStands) {
    Structure house;
    const Eigen::Vector3d card(0.005, 0.1, 0.15);
    const double lean = 0.25, rise = 0.15 * std::cos(lean) + 0.005 * std::sin(lean);
    const double run = 0.15 * std::sin(lean) + 0.005 * std::cos(lean);
    const BodySettings of_card{.shape = Box{card}, .mass = 0.1, .friction = 0.8};
    double z = kFloor;
    for (int storey = 0; storey < 2; ++storey) {
        for (int tent = 0; tent < 2 - storey; ++tent) {
            const double x = kX + 4.2 * run * (tent + 0.5 * storey);
            for (const double side : {-1.0, 1.0}) {
                BodyState state = at({x + side * run, kY, z + rise});
                state.pose.rotation = turned({0.0, -side * lean, 0.0});
                house.add(of_card, state);
            }
        }
        z += 2.0 * rise;
        if (storey > 0) break;
        house.add({.shape = Box{{0.2, 0.1, 0.005}}, .mass = 0.1, .friction = 0.8},
                  at({kX + 2.1 * run, kY, z + 0.005}));
        z += 0.01;
    }
    EXPECT_LT(house.moved(), 0.02);
}

TEST(Structures, AnArchOfWedgesStands) {
    Structure arch;
    constexpr int kWedges = 9;
    const double inner = 1.5, outer = 2.0, angle = std::numbers::pi / kWedges;
    for (int i = 0; i < kWedges; ++i) {
        std::vector<Eigen::Vector3d> points;
        for (const double y : {-0.25, 0.25}) {
            for (const double side : {-0.5, 0.5}) {
                for (const double radius : {inner, outer}) {
                    points.emplace_back(radius * std::sin(side * angle), y,
                                        radius * std::cos(side * angle));
                }
            }
        }
        BodyState state = at({kX, kY, kFloor});
        state.pose.rotation = turned({0.0, (i - 0.5 * (kWedges - 1)) * angle, 0.0});
        arch.add({.shape = ConvexHull::create(points).value(), .mass = 100.0, .friction = 0.8},
                 state);
    }
    EXPECT_LT(arch.moved(), 0.05);
}

TEST(Structures, ABallLiesOnAHundredPlates) {
    Structure stack;
    for (int i = 0; i < 100; ++i) {
        stack.add({.shape = Box{{0.5, 0.5, 0.02}}, .mass = 20.0},
                  at({kX, kY, kFloor + 0.02 + 0.04 * i}));
    }
    const BodyId ball =
        stack.add({.shape = Sphere{0.3}, .mass = 50.0}, at({kX, kY, kFloor + 4.0 + 0.3}));
    stack.moved();
    const WorldPos& place = stack.place_of(ball);
    EXPECT_GT(place.z(), kFloor + 4.0);
    EXPECT_LT((place.head<2>() - Eigen::Vector2d(kX, kY)).norm(), 0.1);
}

TEST(Structures, AWeightOfAMillionTimesTheMassLiesOnASmallBox) {
    for (const double mass : {1e3, 1e6}) {
        Structure stack;
        stack.add({.shape = Box{}, .mass = 1.0}, at({kX, kY, kFloor + 0.5}));
        stack.add({.shape = Box{}, .mass = mass}, at({kX, kY, kFloor + 1.5}));
        EXPECT_LT(stack.moved(), 0.05) << mass;
    }
}

TEST(Structures, ThreeLightBoxesBearOneOfAThousandTimesTheirMass) {
    Structure stack;
    for (int i = 0; i < 4; ++i) {
        stack.add({.shape = Box{}, .mass = i < 3 ? 1.0 : 1e3}, at({kX, kY, kFloor + 0.5 + i}));
    }
    EXPECT_LT(stack.moved(), 0.05);
}

// Dzhanibekov effect: a body that spins about its intermediate axis flips again and again at constant energy and
// momentum.
TEST(Structures, ASpinningTTurnsOverWithoutGainingEnergy) {
    CompoundPart stem{Box{{0.1, 0.1, 0.4}}, {}};
    stem.body_from_part.translation = {0.0, 0.0, -0.5};
    const Compound tee =
        Compound::create(std::vector<CompoundPart>{{Box{{0.5, 0.1, 0.1}}, {}}, stem}).value();
    const double seconds = number_from("TERRANE_SPIN_SECONDS", 120.0);
    World world = make_world({.gravity = Eigen::Vector3d::Zero(), .allow_sleep = false});
    // nearly about the intermediate principal axis
    const BodyState state = at({kX, kY, 50.0}, {0.0, 0.0, 0.0}, {6.0, 0.01, 0.02});
    const BodyId body = add(world, {.shape = tee, .mass = 2.0}, state);
    const Ground ground = make_flat();
    const Eigen::Vector3d axis_before = world.state(body).pose.rotation.col(0);
    double most = 6.0;
    int flips = 0;
    double side = 1.0;
    for (double time = 0.0; time < seconds; time += kStep) {
        world.step(ground, kStep);
        const double along = world.state(body).pose.rotation.col(0).dot(axis_before);
        most = std::max(most, world.state(body).angular_velocity.norm());
        if (along * side < -0.5) {
            side = -side;
            ++flips;
        }
    }
    const double speed = world.state(body).angular_velocity.norm();
    std::printf("after %.0f s: %d flips, spin %.6g rad/s of 6, at most %.6g\n", seconds, flips,
                speed, most);
    EXPECT_GT(flips, seconds / 20.0);
    EXPECT_LE(world.state(body).velocity.norm(), 1e-9);
    EXPECT_GT(speed, 3.0);
    EXPECT_LT(speed, 9.0);
}

}  // namespace terrane::structures_test

// Bodies of every shape and size on every kind of ground, with vehicles, characters, static and kinematic bodies among
// them, for TERRANE_BODY_STEPS steps: none falls through.

namespace terrane::marathon_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261122;
constexpr int kRoots = 4;             // root squares of 128 m along a side
constexpr std::size_t kBodies = 160;  // dynamic, all of one shape
constexpr int kOthers = 8;            // of each other kind

std::vector<std::pair<std::string, Ground>> make_grounds() {
    std::vector<std::pair<std::string, Ground>> grounds;
    for (const RoughGround& rough : kRoughGrounds) {
        grounds.emplace_back(rough.name, make_test_ground(rough.height, 1.0, kRoots));
    }
    constexpr int kSide = 128 * kRoots + 1;
    const HeightTable table = make_contact_table(kSide, 1.0);
    const auto height = [&table](double x, double y) {
        return double{table.at(static_cast<int>(std::clamp(x, 0.0, kSide - 1.0)),
                               static_cast<int>(std::clamp(y, 0.0, kSide - 1.0)))};
    };
    grounds.emplace_back("contact terrain", make_test_ground(height, 1.0, kRoots));
    return grounds;
}

/// The parameters of a run, by its number.
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

    /// A random state whose lowest point is above the ground by a multiple of `size`.
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
        World world =
            test::make_world({.allow_sleep = false, .report_contacts = random.below(2) == 0});
        const std::vector<Shape> shapes = all_shapes(scale);
        for (std::size_t i = 0; i < kBodies; ++i) {
            BodySettings body{.shape = shapes[i % shapes.size()],
                              .friction = random.between(0.0, 1.0),
                              .restitution = random.between(0.0, 1.0)};
            add(world, body, make_start(body.shape, on, scale));
        }
        for (int i = 0; i < kOthers; ++i) {
            const Box block{scale * Eigen::Vector3d(random.between(0.2, 4.0),
                                                    random.between(0.2, 4.0),
                                                    random.between(0.1, 2.0))};
            BodyState state = make_start(block, on, scale);
            state.velocity = state.angular_velocity = Eigen::Vector3d::Zero();
            add(world, {.shape = block, .type = BodyType::static_body}, state);
            state = make_start(block, on, scale);
            state.velocity = 5.0 * random.direction();
            state.angular_velocity = random.direction();
            add(world, {.shape = block, .type = BodyType::kinematic_body}, state);
        }
        // Vehicles and characters keep their own sizes.
        for (int i = 0; i < kOthers; ++i) {
            const VehicleSettings kinds[] = {make_truck(), make_tracked(), make_six_wheeler()};
            BodyState state = make_start(Sphere{4.0}, on, 1.0);
            vehicles.push_back(world.add_vehicle(kinds[i % 3], state.pose).value());
            EXPECT_TRUE(
                world.set_velocity(vehicles.back(), state.velocity, state.angular_velocity));
            state = make_start(Capsule{0.35, 0.55}, on, 1.0);
            characters.push_back(world.add_character({}, state.pose.translation).value());
            EXPECT_TRUE(
                world.set_velocity(characters.back(), state.velocity, Eigen::Vector3d::Zero()));
        }
        return world;
    }

    /// New controls for all vehicles and characters.
    void control(World& world) {
        for (const BodyId vehicle : vehicles) {
            const VehicleControls controls{.throttle = random.between(-1.0, 1.0),
                                           .brake = random.below(4) == 0 ? 1.0 : 0.0,
                                           .steer = random.between(-1.0, 1.0)};
            EXPECT_TRUE(world.set_controls(vehicle, controls));
        }
        for (const BodyId character : characters) {
            const double pace = random.below(8) == 0 ? 60.0 : 6.0;
            CharacterControls controls{
                .velocity = {random.between(-pace, pace), random.between(-pace, pace)},
                .jump_speed = random.below(3) == 0 ? 6.0 : 0.0};
            EXPECT_TRUE(world.set_controls(character, controls));
        }
    }

    Random random;
    std::size_t ground = 0;
    double speed = 0.0, spin = 0.0, dt = 0.0, scale = 0.0;
    std::vector<BodyId> vehicles, characters;
};

// Runs at least TERRANE_BODY_STEPS steps of awake bodies, few by default, beginning with run TERRANE_FIRST_RUN, so that
// a long test can be split.
TEST(NobodyFalls, HoweverManyStepsAreTaken) {
    constexpr double kSeconds = 10.0;
    const double most = number_from("TERRANE_BODY_STEPS", 1e5);
    const std::vector<std::pair<std::string, Ground>> grounds = make_grounds();
    double steps = 0.0, lived = 0.0, lost = 0.0, shown = 0.0;
    auto number = number_from<std::uint64_t>("TERRANE_FIRST_RUN", 0);
    std::uint64_t too_deep = 0, parked = 0;
    for (; steps < most; ++number) {
        Trial run(number, grounds.size());
        SCOPED_TRACE(testing::Message() << "run " << number << ", seed " << kSeed);
        const auto& [name, ground] = grounds[run.ground];
        World world = run.make_world(ground);
        std::uint64_t deep_here = 0;
        for (double time = 0.0; time < kSeconds && steps < most; time += run.dt) {
            if (std::floor(time) != std::floor(time - run.dt)) run.control(world);
            const StepReport report = world.step(ground, run.dt);
            deep_here += report.too_deep;
            parked += report.parked;
            lived += report.simulated_time;
            lost += report.lost_time;
            steps += static_cast<double>(report.awake);
        }
        EXPECT_EQ(deep_here, 0u) << name << ", " << run.speed << " m/s, " << run.spin
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

}  // namespace terrane::marathon_test
