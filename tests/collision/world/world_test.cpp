// SPDX-License-Identifier: MIT
#include "collision/world/body_cases.h"
#include "collision/world/lone_vehicle.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/surface.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace terrane::bodies_test {

using namespace test;

TEST(World, LetsNoBodyFallThroughRoughGroundAtAnySpeedSpinOrStep) {
    SeededRandom random(2024);
    for (const RoughGround& rough : kRoughGrounds) {
        const Ground ground = make_test_ground(rough.height, 1.0, 1);
        for (const Shape& shape : all_shapes()) {
            for (const double speed : {0.0, 300.0, 3000.0}) {
                for (const double dt : {kStep, 0.1}) {
                    SCOPED_TRACE(testing::Message() << rough.name << ' ' << name_of(shape) << " at "
                                                    << speed << " m/s, dt " << dt);
                    World world = make_world();
                    for (int body = 0; body < few_or_many(3, 12); ++body) {
                        const double x = random.between(30, 98), y = random.between(30, 98);
                        BodyState state =
                            at({x, y, 75.0}, {random.between(-0.3, 0.3) * speed,
                                              random.between(-0.3, 0.3) * speed, -speed});
                        state.pose.rotation =
                            turned({random.between(-3, 3), random.between(-3, 3), 0.0});
                        const double spin = body % 3 == 0 ? 0.0 : body % 3 == 1 ? 5.0 : 100.0;
                        state.angular_velocity = {random.between(-spin, spin),
                                                  random.between(-spin, spin),
                                                  random.between(-spin, spin)};
                        add(world, {.shape = shape}, state);
                    }
                    double lived = 0.0, lost = 0.0;
                    for (double time = 0.0; time < 4.5; time += dt) {
                        const StepReport report = world.step(ground, dt);
                        ASSERT_EQ(report.too_deep, 0u)
                            << "depth " << report.max_depth_m << " m after " << time << " s";
                        EXPECT_EQ(report.parked, 0u);
                        lived += report.simulated_time;
                        lost += report.lost_time;
                    }
                    EXPECT_LE(lost, 0.05 * (lived + lost));
                }
            }
        }
    }
}

TEST(World, NoneOfAThousandAtFiveKilometresASecondPassesARidgeOneCellThick) {
    constexpr double kRidge = 256.0, kTop = 400.0;
    const Ground ground =
        make_test_ground([](double x, double) { return x == kRidge ? kTop : 0.0; }, 1.0, 4);
    SeededRandom random(5);
    const std::vector<Shape> shapes = all_shapes();
    for (const double dt : {kStep, 0.1}) {
        World world = make_world();
        for (int body = 0; body < 1000; ++body) {
            const int row = body / 10 % 25, layer = body / 250;
            BodyState state =
                at({40.0 + 14.0 * (body % 10), 60.0 + 16.0 * row, 10.0 + 24.0 * layer});
            state.pose.translation += 3.0 * random.direction();
            state.pose.rotation = random.rotation();
            state.velocity = {5000.0, random.between(-50.0, 50.0), random.between(-50.0, 50.0)};
            state.angular_velocity = 20.0 * random.direction();
            add(world, {.shape = shapes[static_cast<std::size_t>(body) % shapes.size()]}, state);
        }
        std::vector<bool> has_left(1000, false);
        std::uint64_t too_deep = 0, impacts = 0;
        double lived = 0.0, lost = 0.0;
        long compared = 0;
        for (double time = 0.0; time < 1.0; time += dt) {
            const StepReport report = world.step(ground, dt);
            too_deep += report.too_deep;
            impacts += report.impacts;
            lived += report.simulated_time;
            lost += report.lost_time;
            ASSERT_EQ(report.parked, 0u);
            for (std::size_t body = 0; body < has_left.size(); ++body) {
                // A body may pass the ridge at its ends, outside the world, and above the ridge where the impact throws
                // it up.
                const BodyState& state = world.states()[body];
                if (state.condition == BodyCondition::left_world ||
                    state.pose.translation.z() > kTop) {
                    has_left[body] = true;
                }
                if (has_left[body]) continue;
                ++compared;
                ASSERT_LT(state.pose.translation.x(), kRidge) << "dt " << dt << ", body " << body;
            }
        }
        EXPECT_EQ(too_deep, 0u) << dt;
        EXPECT_GE(impacts, 1000u) << dt;
        EXPECT_GT(compared, 50) << dt;
        EXPECT_LE(lost, 0.01 * (lived + lost)) << dt;
    }
}

TEST(World, BringsADeepStartOutWithoutEverGoingDeeperOrGivingItVelocity) {
    const Ground ground = make_test_ground(
        [](double x, double y) { return 2.0 * std::sin(0.5 * x) * std::sin(0.4 * y); }, 1.0, 1);
    const double deepest = few_or_many(3, 6);
    const int stride =
        few_or_many(4, 1);  // steps between measurements of the depth, which are slow
    for (const Shape& shape : all_shapes()) {
        for (const double below : {0.3, 1.5, deepest}) {
            SCOPED_TRACE(testing::Message() << name_of(shape) << " from " << below << " m");
            World world = make_world();
            const BodyId body = add(world, {.shape = shape},
                                    at({kMiddle, kMiddle, 2.0 - below}, {1.0, 2.0, -30.0}));
            const auto depth_now = [&] {
                return -signed_distance(shape, world.state(body).pose, ground, 0.0).distance;
            };
            double depth = depth_now();
            for (int step = 0; step < 60 * 8; ++step) {
                EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
                if (depth <= 0.01 || step % stride != 0) continue;
                const double now = depth_now();
                // From far below, the minimum translation results from a search and its length may vary between steps.
                EXPECT_LE(now, depth + (below > 2.0 ? 0.02 * depth : 1e-6)) << "step " << step;
                depth = now;
                if (depth > 0.01) {
                    EXPECT_LT(world.state(body).velocity.norm(), 0.5);
                }
            }
            EXPECT_LE(depth, 0.01);
        }
    }
}

TEST(World, FallsFreelyBeyondTheWorldAndCountsIt) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId body = add(world, {.shape = Box{}}, at({120.0, 64.0, 7.0}, {40.0, 0.0, 0.0}));
    StepReport report;
    for (int step = 0; step < 120; ++step) report = world.step(ground, kStep);
    EXPECT_EQ(report.left_world, 1u);
    EXPECT_EQ(report.awake, 0u);
    EXPECT_EQ(world.state(body).condition, BodyCondition::left_world);
    EXPECT_LT(world.state(body).pose.translation.z(), 0.0);
    EXPECT_GT(world.state(body).pose.translation.x(), 128.0);
}

// The edges of the extent cut the cells from 60 to 70 and from 30 to 40.
TEST(World, ItsGroundEndsAtTheExtentAlsoWithinACell) {
    const Ground ground =
        make_test_ground([](double, double) { return 5.0; },
                         {.spacing = 10.0, .extent = WorldRect{35.0, 35.0, 65.0, 65.0}});
    for (const Shape& shape : {Shape{Sphere{0.5}}, Shape{Capsule{0.5, 0.0}},
                               Shape{Box{Eigen::Vector3d::Constant(0.5)}}}) {
        World world = make_world();
        std::vector<BodyId> beyond, within;
        for (const auto& [x, y] : {std::pair(1.0, 0.0), std::pair(-1.0, 0.0), std::pair(0.0, 1.0),
                                   std::pair(0.0, -1.0), std::pair(1.0, 1.0)}) {
            const auto place = [x = x, y = y](double from_middle) {
                return at({50.0 + from_middle * x, 50.0 + from_middle * y, 5.6});
            };
            beyond.push_back(add(world, {.shape = shape}, place(15.6)));
            within.push_back(add(world, {.shape = shape}, place(14.4)));
        }
        for (int step = 0; step < 120; ++step) {
            EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
        }
        for (const BodyId body : beyond) {
            EXPECT_EQ(world.state(body).condition, BodyCondition::left_world);
            EXPECT_LT(world.state(body).pose.translation.z(), -5.0);
        }
        for (const BodyId body : within) {
            EXPECT_NEAR(world.state(body).pose.translation.z(), 5.5, 0.01);
        }
    }
}

TEST(World, RefusesWhatIsNotFiniteByNameAndKeepsTheLastGoodState) {
    World world = make_world();
    const auto expect_named = [](const Error& error, const std::string& field) {
        EXPECT_EQ(error.code, ErrorCode::invalid_argument);
        EXPECT_NE(error.message.find(field), std::string::npos) << error.message;
    };
    const ConvexHull point = ConvexHull::create(std::array{Eigen::Vector3d(0, 0, 0)}).value();
    // Its extent about the centre of mass exceeds the limit for hulls.
    const ConvexHull wide =
        ConvexHull::create(std::vector<Eigen::Vector3d>{
                               {1e5, 0, 0}, {1e5, 9e4, 0}, {1e5, 0, 9e4}, {-1e5, 1e4, 1e4}})
            .value();
    const std::pair<BodySettings, const char*> bad_settings[] = {
        {{.mass = kNan}, "mass"},         {{.mass = 0.0}, "mass"},
        {{.mass = -1.0}, "mass"},         {{.mass = kInfinity}, "mass"},
        {{.friction = -1.0}, "friction"}, {{.restitution = 1.5}, "restitution"},
        {{.shape = Sphere{0.0}}, ""},     {{.shape = point}, "contact_tolerance"},
        {{.shape = wide}, "hull"},
    };
    for (const auto& [settings, field] : bad_settings) {
        const Result<BodyId> added = world.add(settings, {});
        ASSERT_FALSE(added.has_value()) << field;
        expect_named(added.error(), field);
    }
    EXPECT_EQ(world.states().size(), 0u);

    const BodyId body = add(world, {}, at({1.0, 2.0, 3.0}));
    const std::uint64_t hash = world.state_hash();
    BodyState scaled, mirrored;
    scaled.pose.rotation(1, 1) = 0.5;
    mirrored.pose.rotation = -Eigen::Matrix3d::Identity();
    const Eigen::Vector3d zero(0.0, 0.0, 0.0);
    const std::pair<BodyState, const char*> bad_states[] = {
        {at({0.0, kNan, 0.0}), "pose.translation.y"},
        {at(zero, {0.0, 0.0, kNan}), "velocity.z"},
        {at(zero, zero, {kNan, 0.0, 0.0}), "angular_velocity.x"},
        {scaled, "pose.rotation"},
        {mirrored, "pose.rotation"},
    };
    for (const auto& [state, field] : bad_states) {
        const Result<void> moved = world.teleport(body, state);
        ASSERT_FALSE(moved.has_value()) << field;
        expect_named(moved.error(), field);
    }
    EXPECT_EQ(world.state_hash(), hash);
    EXPECT_FALSE(World::create({.gravity = {0.0, 0.0, kNan}}).has_value());
    EXPECT_FALSE(World::create({.max_substep = 0.0}).has_value());
}

TEST(World, ItsSubstepCanChangeBetweenStepsAndIsSaved) {
    const Ground ground = make_test_ground(kRoughGrounds[1].height, 1.0, 1);
    const auto with_boxes = [](double max_substep) {
        World world = make_world({.max_substep = max_substep});
        for (int i = 0; i < 5; ++i) add(world, {.shape = Box{}}, at({60.0, 60.0, 20.0 + 1.5 * i}));
        return world;
    };
    constexpr double kUsual = 1.0 / 120.0, kFine = 1.0 / 480.0;
    World usual = with_boxes(kUsual), fine = with_boxes(kFine), changed = with_boxes(kUsual);
    ASSERT_TRUE(changed.set_max_substep(kFine).has_value());
    for (const double refused : {0.0, -1.0, 1.5, kNan}) {
        const Result<void> answer = changed.set_max_substep(refused);
        ASSERT_FALSE(answer.has_value()) << refused;
        EXPECT_NE(answer.error().message.find("max_substep"), std::string::npos);
    }
    World loaded = World::load(changed.save()).value();
    for (int step = 0; step < 120; ++step) {
        for (World* world : {&usual, &fine, &changed, &loaded}) {
            EXPECT_EQ(world->step(ground, kStep).too_deep, 0u) << step;
        }
        ASSERT_EQ(changed.state_hash(), fine.state_hash()) << step;
        ASSERT_EQ(loaded.state_hash(), fine.state_hash()) << step;
    }
    EXPECT_NE(usual.state_hash(), fine.state_hash());
}

TEST(World, GivesTheSameBitsForTheSameCalls) {
    const Ground ground = make_test_ground(kRoughGrounds[1].height, 1.0, 1);
    const auto run = [&ground](bool measures_depth) {
        Random random(5);
        World world = make_world({.measure_depth = measures_depth});
        const std::vector<Shape> shapes = all_shapes();
        for (int body = 0; body < 30; ++body) {
            BodyState state = at({random.between(30, 98), random.between(30, 98), 9.0});
            state.velocity = {0.0, 0.0, random.between(-60, 0)};
            state.angular_velocity = {random.between(-5, 5), random.between(-5, 5), 1.0};
            add(world, {.shape = shapes[static_cast<std::size_t>(body) % shapes.size()]}, state);
        }
        std::uint64_t hash = 0;
        for (int step = 0; step < 120; ++step) {
            world.step(ground, kStep);
            hash = hash * 31 + world.state_hash();
        }
        return hash;
    };
    const std::uint64_t hash = run(true);
    EXPECT_EQ(run(true), hash);
    EXPECT_EQ(run(false), hash) << "measuring depths changes no state";
}

}  // namespace terrane::bodies_test

// Bodies 2e9 m from the origin, where doubles are 2.4e-7 m apart, compared with the same bodies near the origin.

namespace terrane::far_bodies_test {

using namespace test;

constexpr double kGrain = 0x1p-22;    // metres, spacing of doubles from 2^30 to 2^31
constexpr double kFar = 2e9 - 128.0;  // metres, a multiple of 128
constexpr double kSlope = 0.25;

struct Fall {
    double max_depth_m = 0.0;
    double lowest_tolerance = 1.0;
    std::vector<Eigen::Vector3d> places;  // relative to the ground's corner
    std::vector<double> speeds;
};

/// Drops one body of each shape, side by side, on ground of one root square with its south-western corner at
/// (origin, -origin); heights are a function of the position in it.
template <class Height>
Fall drop(double origin, Height height, double seconds) {
    const Ground ground =
        make_test_ground([=](double x, double y) { return height(x - origin, y + origin); },
                         {.origin_x = origin, .origin_y = -origin});
    World world = make_world();
    double x = 20.0;
    Fall run;
    for (const Shape& shape : all_shapes()) {
        const double z = height(x, 60.0) + 3.0;
        add(world, {.shape = shape, .friction = 0.6}, at({origin + x, 60.0 - origin, z}));
        run.lowest_tolerance = std::min(run.lowest_tolerance, default_contact_tolerance(shape));
        x += 16.0;
    }
    for (int i = 0; i * kStep < seconds; ++i) {
        const StepReport report = world.step(ground, kStep);
        EXPECT_EQ(report.too_deep, 0u);
        EXPECT_EQ(report.left_world + report.parked, 0u);
        run.max_depth_m = std::max(run.max_depth_m, report.max_depth_m);
    }
    for (const BodyState& state : world.states()) {
        run.places.push_back(state.pose.translation - Eigen::Vector3d(origin, -origin, 0.0));
        run.speeds.push_back(state.velocity.norm());
    }
    return run;
}

TEST(FarBodies, RestAsDeepAsNearTheOrigin) {
    const auto flat = [](double, double) { return 5.0; };
    const Fall near = drop(0.0, flat, 4.0), far = drop(kFar, flat, 4.0);
    EXPECT_LE(far.max_depth_m, far.lowest_tolerance);
    EXPECT_NEAR(far.max_depth_m, near.max_depth_m, 64.0 * kGrain);
    for (std::size_t i = 0; i < far.places.size(); ++i) {
        // the first three shapes rest in their initial pose; the others tip over, and small differences grow
        EXPECT_NEAR(far.places[i].z(), near.places[i].z(), i < 3 ? 64.0 * kGrain : 1e-3) << i;
        EXPECT_LT(far.speeds[i], 1e-2) << i;
    }
}

TEST(FarBodies, RollDownASlopeAsNearTheOrigin) {
    const auto slope = [](double x, double y) { return kSlope * y + 0.01 * x; };
    const Fall near = drop(0.0, slope, 3.0), far = drop(kFar, slope, 3.0);
    EXPECT_LE(far.max_depth_m, far.lowest_tolerance);
    EXPECT_NEAR(far.max_depth_m, near.max_depth_m, 1e-3);
    const Eigen::Vector3d way = far.places[0] - near.places[0];
    EXPECT_LT(way.norm(), 1e-3) << "the sphere";
    EXPECT_LT(far.places[0].y(), 58.0) << "it rolled";
}

TEST(FarBodies, FallOnRoughGroundAndNobodyIsTooDeep) {
    const auto rough = [](double x, double y) {
        return 2.0 * std::sin(0.9 * x) * std::sin(0.7 * y) +
               (static_cast<int>(x) % 9 == 0 ? 4.0 : 0.0);
    };
    const Fall far = drop(kFar, rough, 6.0);
    EXPECT_LE(far.max_depth_m, far.lowest_tolerance);
}

}  // namespace terrane::far_bodies_test

// Friction and restitution by position: bodies and tyres on ground with a surface map.

namespace terrane::surface_test {

using namespace test;

/// Flat ground at z = 5 with one surface west of x = 64 and another east of it.
Ground make_two_surfaces(const SurfaceProperties& west, const SurfaceProperties& east) {
    const SurfaceRect eastern{
        {.west = 64.0, .south = -kInfinity, .east = kInfinity, .north = kInfinity}, east};
    return make_test_ground([](double, double) { return 5.0; },
                            {.surface = SurfaceMap::from_rects({&eastern, 1}, west).value()});
}

/// Distance along x that a sliding box covers until it stops.
double slide(const Ground& ground, double x, double speed, double friction) {
    World world = make_world({.allow_sleep = false});
    const BodyId body = add(world, {.shape = Box{{0.5, 0.5, 0.25}}, .friction = friction},
                            at({x, 64.3, 5.25}, {speed, 0.0, 0.0}));
    take_steps(world, ground, 600);
    return world.state(body).pose.translation.x() - x;
}

TEST(SurfaceByPlace, FrictionIsThatOfBothSurfaces) {
    constexpr double kBody = 0.4, kRoad = 0.9, kMud = 0.1, kSpeed = 3.0;
    const Ground ground = make_two_surfaces({.friction = kMud}, {.friction = kRoad});
    for (const auto& [x, surface] : {std::pair(30.0, kMud), std::pair(80.0, kRoad)}) {
        const double friction = std::sqrt(kBody * surface);
        const double distance = kSpeed * kSpeed / (2.0 * friction * kGravity);
        EXPECT_NEAR(slide(ground, x, kSpeed, kBody), distance, 0.03 * distance) << surface;
    }
}

TEST(SurfaceByPlace, DefaultsOfBothSidesAreAsWithoutAMap) {
    const double without = slide(make_flat(), 40.0, 3.0, BodySettings{}.friction);
    const double with = slide(make_two_surfaces({}, {}), 40.0, 3.0, BodySettings{}.friction);
    EXPECT_NEAR(with, without, 1e-9);
}

TEST(SurfaceByPlace, ABoxSlidesOverIceAndStopsOnTheRoadBehind) {
    const Ground ground = make_two_surfaces({.friction = 0.0}, {.friction = 1.0});
    const double distance = slide(ground, 50.0, 5.0, 0.6);
    EXPECT_GT(50.0 + distance, 63.5);
    EXPECT_LT(50.0 + distance, 63.5 + 5.0 * 5.0 / (2.0 * 0.7 * kGravity) + 0.6);
}

TEST(SurfaceByPlace, RestitutionIsTheLargerOne) {
    const Ground ground = make_two_surfaces({.restitution = 0.0}, {.restitution = 0.9});
    for (const auto& [x, least, most] : {std::tuple(30.3, 0.0, 0.1), std::tuple(80.3, 1.4, 1.8)}) {
        World world = make_world({.allow_sleep = false});
        const BodyId body =
            add(world, {.shape = Sphere{0.5}, .restitution = 0.0}, at({x, 64.3, 7.5}));
        double highest = 0.0;
        bool has_struck = false;
        for (int step = 0; step < 90; ++step) {
            has_struck = world.step(ground, kStep).impacts > 0 || has_struck;
            if (has_struck) {
                highest = std::max(highest, world.state(body).pose.translation.z() - 5.5);
            }
        }
        EXPECT_GE(highest, least) << x;
        EXPECT_LE(highest, most) << x;
    }
}

TEST(SurfaceByPlace, ATruckNeedsALongerWayToStopOnIce) {
    double distances[2];
    for (const int i : {0, 1}) {
        const double friction = i == 0 ? 0.05 : 0.9;
        const Ground ground = make_two_surfaces({.friction = friction}, {.friction = friction});
        LoneVehicle truck({20.0, 64.3, 5.75});
        truck.drive(ground, {.throttle = 1.0}, 2.0);
        const double start = truck.place().x();
        const double speed = truck.chassis().velocity.x();
        ASSERT_GT(speed, 1.0);
        truck.drive(ground, {.brake = 1.0}, 5.0);
        // Relative to v^2, so that the speeds reached may differ.
        distances[i] = (truck.place().x() - start) / (speed * speed);
    }
    EXPECT_GT(distances[0], 2.5 * distances[1]);
}

}  // namespace terrane::surface_test
