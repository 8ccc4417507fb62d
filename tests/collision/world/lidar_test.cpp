// SPDX-License-Identifier: MIT
//
// Scans against World::ray() and Ground::ray() for each direction.
#include "collision/world/body_cases.h"
#include "support/random.h"

#include <terrane/collision/lidar.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace terrane::lidar_test {

using namespace test;

constexpr std::uint64_t kSeed = 21;
constexpr LidarSettings kSettings{.min_range = 0.5, .max_range = 80.0};

std::uint64_t bits_of(double number) { return std::bit_cast<std::uint64_t>(number); }

// 3 x 3 chunks; the north-eastern one is absent.
Ground make_ground() {
    return make_test_ground(
        [](double x, double y) { return 5.0 * std::sin(0.1 * x) + 4.0 * std::cos(0.13 * y); },
        {.roots = 3, .is_resident = [](int x, int y) { return x != 2 || y != 2; }});
}

World make_world_of(Random& random, std::size_t count) {
    World world = make_world();
    const std::array<Shape, 3> shapes{Box{{2.0, 1.0, 3.0}}, Capsule{0.5, 2.0}, Sphere{1.5}};
    for (std::size_t i = 0; i < count; ++i) {
        BodySettings body{.shape = shapes[i % 3], .type = BodyType::static_body};
        body.filter.layers = i % 2 == 0 ? 1u : 2u;
        BodyState state = at(
            {random.between(90.0, 270.0), random.between(90.0, 270.0), random.between(0.0, 14.0)});
        state.pose.rotation = random.rotation();
        add(world, body, state);
    }
    return world;
}

std::vector<Eigen::Vector3d> make_directions(Random& random, std::size_t count) {
    std::vector<Eigen::Vector3d> directions(count);
    for (Eigen::Vector3d& direction : directions) direction = random.direction();
    return directions;
}

struct Arrays {
    explicit Arrays(std::size_t count)
        : ranges(count, -1.0),
          points(3 * count, -1.0),
          normals(3 * count, -1.0),
          bodies(count, BodyId{7, 7}),
          parts(count, 99),
          statuses(count, LidarStatus::invalid) {}
    LidarArrays out() { return {ranges, points, normals, bodies, parts, statuses}; }

    std::vector<double> ranges, points, normals;
    std::vector<BodyId> bodies;
    std::vector<std::uint32_t> parts;
    std::vector<LidarStatus> statuses;
};

void expect_answer(const Arrays& arrays, std::size_t i, const RayQueryAnswer& expected,
                   const LidarSettings& settings) {
    const double length = settings.max_range - settings.min_range;
    const double range = settings.min_range + expected.fraction * length;
    ASSERT_EQ(bits_of(arrays.ranges[i]), bits_of(expected.hit ? range : kNan));
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<Eigen::Index>(axis);
        const double point = expected.hit ? expected.point_world[k] : kNan;
        const double normal = expected.hit ? expected.normal[k] : kNan;
        ASSERT_EQ(bits_of(arrays.points[3 * i + axis]), bits_of(point));
        ASSERT_EQ(bits_of(arrays.normals[3 * i + axis]), bits_of(normal));
    }
    ASSERT_EQ(arrays.bodies[i], expected.body);
    ASSERT_EQ(arrays.parts[i], expected.part);
    const LidarStatus status = arrays.statuses[i];
    if (expected.status == QueryStatus::not_resident) {
        ASSERT_EQ(status, LidarStatus::not_resident);
    } else if (expected.hit) {
        ASSERT_EQ(status, expected.hits_ground() ? LidarStatus::ground : LidarStatus::body);
    } else {
        ASSERT_TRUE(status == LidarStatus::miss || status == LidarStatus::outside);
    }
}

TEST(Lidar, HasTheBitsOfSingleRaysOfTheWorldOnAnyNumberOfThreads) {
    const Ground ground = make_ground();
    Random random(kSeed);
    const World world = make_world_of(random, 100);
    const std::vector<Eigen::Vector3d> directions = make_directions(random, 1500);
    QueryFilter filter{.layers = 1u};
    std::array<int, 6> counts{};
    for (int workers = 1; workers <= 4; ++workers) {
        LidarSettings settings = kSettings;
        settings.worker_count = workers;
        Lidar lidar = Lidar::create(settings, directions).value();
        ASSERT_EQ(lidar.count(), directions.size());
        Random places(kSeed);
        for (int scan = 0; scan < 6; ++scan) {
            Pose pose{places.rotation(),
                      {places.between(100.0, 330.0), places.between(100.0, 330.0),
                       places.between(10.0, 20.0)}};
            if (scan == 5) pose.translation.y() = -20.0;
            Arrays arrays(directions.size());
            ASSERT_TRUE(lidar.scan(ground, &world, pose, arrays.out(), filter));
            for (std::size_t i = 0; i < directions.size(); ++i) {
                SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", workers " << workers
                                                << ", scan " << scan << ", ray " << i);
                const Eigen::Vector3d& d = directions[i];
                const Eigen::Matrix3d& r = pose.rotation;
                const Eigen::Vector3d direction =
                    r.col(0) * d[0] + r.col(1) * d[1] + r.col(2) * d[2];
                const WorldPos begin = pose.translation + settings.min_range * direction;
                const WorldPos end = pose.translation + settings.max_range * direction;
                expect_answer(arrays, i, world.ray(ground, begin, end, filter), settings);
                if (HasFatalFailure()) return;
                const LidarStatus status = arrays.statuses[i];
                ++counts[static_cast<std::size_t>(status)];
                const bool ends_outside =
                    end.x() < 0.0 || end.x() > 384.0 || end.y() < 0.0 || end.y() > 384.0;
                ASSERT_FALSE(status == LidarStatus::miss && ends_outside);
                ASSERT_FALSE(status == LidarStatus::outside && !ends_outside);
            }
        }
    }
    for (const LidarStatus status : {LidarStatus::miss, LidarStatus::ground, LidarStatus::body,
                                     LidarStatus::not_resident, LidarStatus::outside}) {
        EXPECT_GT(counts[static_cast<std::size_t>(status)], 20);
    }
}

TEST(Lidar, WithoutAWorldSeesTheGroundAsAnEmptyWorldDoes) {
    const Ground ground = make_ground();
    Random random(kSeed);
    const World empty = make_world();
    const std::vector<Eigen::Vector3d> directions = make_directions(random, 2000);
    Lidar lidar = Lidar::create(kSettings, directions).value();
    Pose pose{.translation = {230.0, 240.0, 14.0}};
    Arrays alone(2000), with_world(2000);
    ASSERT_TRUE(lidar.scan(ground, nullptr, pose, alone.out()));
    ASSERT_TRUE(lidar.scan(ground, &empty, pose, with_world.out()));
    EXPECT_EQ(alone.statuses, with_world.statuses);
    for (std::size_t i = 0; i < 2000; ++i) {
        ASSERT_EQ(bits_of(alone.ranges[i]), bits_of(with_world.ranges[i]));
        const RayAnswer below = ground.ray(pose.translation + 0.5 * directions[i],
                                           pose.translation + 80.0 * directions[i]);
        ASSERT_EQ(alone.statuses[i] == LidarStatus::ground, below.status == QueryStatus::ok);
        ASSERT_EQ(alone.statuses[i] == LidarStatus::not_resident,
                  below.status == QueryStatus::not_resident);
        if (below.status == QueryStatus::ok) {
            ASSERT_EQ(alone.ranges[i], 0.5 + below.fraction * 79.5);
        }
    }
}

/// Of the error; empty if there is none.
std::string message_of(const auto& result) {
    return result ? std::string() : result.error().message;
}

// Neither the body that carries the sensor nor bodies beyond the largest range are seen.
TEST(Lidar, SeesNothingNearerOrFartherThanItsRanges) {
    const Ground ground = make_ground();
    World world = make_world();
    const BodySettings body{.shape = Sphere{0.4}, .type = BodyType::static_body};
    const Pose pose = at({64.0, 64.0, 40.0}).pose;
    add(world, body, at(pose.translation));
    const BodyId far_body = add(world, body, at({80.0, 64.0, 40.0}));
    const std::array directions{Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(-1.0, 0.0, 0.0)};
    for (const double max_range : {15.0, 16.0}) {
        const bool is_seen = max_range > 15.6;
        Lidar lidar = Lidar::create({.min_range = 0.5, .max_range = max_range}, directions).value();
        Arrays arrays(2);
        ASSERT_TRUE(lidar.scan(ground, &world, pose, arrays.out()));
        EXPECT_EQ(arrays.statuses[1], LidarStatus::miss);
        EXPECT_EQ(arrays.statuses[0], is_seen ? LidarStatus::body : LidarStatus::miss);
        EXPECT_EQ(arrays.bodies[0], is_seen ? far_body : BodyId{});
        if (is_seen) {
            EXPECT_NEAR(arrays.ranges[0], 15.6, 1e-12);
        }
    }
}

// A sensor that flies over paged ground, 2 m above the surface and then far above it. The pager loads in update(), so
// that all the ground of a need is resident.
std::size_t count_undecided(bool has_need, const Eigen::Vector3d& velocity, double height) {
    const auto source =
        FractalHeights::create(
            {.seed = 5, .amplitude = 90.0, .wavelength_log2 = 8, .root_size_log2 = 12})
            .value();
    Pager pager = Pager::create(source, {.memory_bytes = 64 << 20, .worker_count = 0}).value();
    const std::vector<Eigen::Vector3d> directions =
        make_lidar_grid({.azimuth_count = 180,
                         .azimuth_step = std::numbers::pi / 90.0,
                         .elevation_count = 24,
                         .first_elevation = -0.9,
                         .elevation_step = 0.05})
            .value();
    Lidar lidar = Lidar::create({.min_range = 0.5, .max_range = 400.0}, directions).value();
    Arrays arrays(directions.size());
    Pose pose{.translation = {-300.0, 40.0, 0.0}};
    std::size_t undecided = 0, hits = 0;
    constexpr double kStepTime = 0.1;
    for (int step = 0; step < 15; ++step) {
        pose.translation.z() = source->height(pose.translation.x(), pose.translation.y()) + height;
        std::vector<BodyNeed> needs;
        if (has_need) needs.push_back(lidar.need(pose, velocity));
        pager.update({}, needs, kStepTime * step);
        pose.translation += kStepTime * velocity;
        EXPECT_TRUE(lidar.scan(pager.ground(), nullptr, pose, arrays.out()));
        for (const LidarStatus status : arrays.statuses) {
            undecided += status == LidarStatus::not_resident ? 1 : 0;
            hits += status == LidarStatus::ground ? 1 : 0;
        }
    }
    EXPECT_TRUE(!has_need || hits > 1000) << hits;
    EXPECT_EQ(pager.stats().cut_needs, 0u);
    return undecided;
}

TEST(Lidar, ItsNeedLoadsAllGroundThatItsBeamsMayMeet) {
    const Eigen::Vector3d velocity(60.0, 25.0, 0.0);
    for (const double height : {2.0, 120.0, 300.0}) {
        EXPECT_EQ(count_undecided(true, velocity, height), 0u) << height;
        EXPECT_GT(count_undecided(false, velocity, height), 0u) << height;
    }
}

TEST(Lidar, IsInvalidFromAPoseThatIsNone) {
    const Ground ground = make_ground();
    const std::array directions{Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, -1.0)};
    Lidar lidar = Lidar::create(kSettings, directions).value();
    Pose not_finite, scaled, mirrored;
    not_finite.translation.x() = kNan;
    scaled.rotation *= 1.1;
    mirrored.rotation(2, 2) = -1.0;
    for (const Pose& pose : {not_finite, scaled, mirrored}) {
        Arrays arrays(2);
        arrays.statuses.assign(2, LidarStatus::miss);
        ASSERT_TRUE(lidar.scan(ground, nullptr, pose, arrays.out()));
        for (std::size_t i = 0; i < 2; ++i) {
            EXPECT_EQ(arrays.statuses[i], LidarStatus::invalid);
            EXPECT_TRUE(std::isnan(arrays.ranges[i]));
            EXPECT_FALSE(arrays.bodies[i].is_valid());
        }
    }
}

TEST(Lidar, RefusesSettingsDirectionsAndArraysWithALine) {
    const std::array directions{Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, -1.0)};
    const auto refusal = [&](const LidarSettings& settings) {
        return message_of(Lidar::create(settings, directions));
    };
    EXPECT_EQ(refusal({.min_range = -1.0}), "min_range must be 0 to 1e+06, got -1");
    EXPECT_EQ(refusal({.min_range = kNan}), "min_range must be 0 to 1e+06, got nan");
    EXPECT_EQ(refusal({.min_range = 5.0, .max_range = 5.0}),
              "max_range must be above min_range, 5, and at most 1e+06, got 5");
    EXPECT_EQ(refusal({.max_range = 2e6}),
              "max_range must be above min_range, 0.1, and at most 1e+06, got 2e+06");
    EXPECT_EQ(refusal({.worker_count = 0}), "worker_count must be 1 to 64, got 0");
    EXPECT_EQ(refusal({}), "");
    for (const double x : {0.0, 2.0, kNan}) {
        const std::array wrong{Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(x, 0.0, 0.0)};
        const auto lidar = Lidar::create({}, wrong);
        ASSERT_FALSE(lidar);
        EXPECT_EQ(lidar.error().message.substr(0, 24), "direction 1 must be unit");
    }
    Lidar lidar = Lidar::create({}, directions).value();
    std::vector<double> three(3, -1.0);
    const auto result = lidar.scan(make_ground(), nullptr, {}, LidarArrays{.ranges = three});
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().message,
              "ranges must be empty or have 2 entries for 2 directions, has 3");
    EXPECT_EQ(three, std::vector<double>(3, -1.0));
    Lidar none = Lidar::create({}, {}).value();
    EXPECT_TRUE(none.scan(make_ground(), nullptr, {}, {}));
}

TEST(LidarGrid, HasTheDirectionsOfItsAngles) {
    const LidarGridSettings settings{.azimuth_count = 720,
                                     .first_azimuth = -6.2,
                                     .azimuth_step = 0.02,
                                     .elevation_count = 17,
                                     .first_elevation = -1.57,
                                     .elevation_step = 0.19};
    const std::vector<Eigen::Vector3d> directions = make_lidar_grid(settings).value();
    ASSERT_EQ(directions.size(), 720u * 17u);
    for (int j = 0; j < 17; ++j) {
        for (int i = 0; i < 720; ++i) {
            const double azimuth = -6.2 + 0.02 * i, elevation = -1.57 + 0.19 * j;
            const Eigen::Vector3d expected(std::cos(elevation) * std::cos(azimuth),
                                           std::cos(elevation) * std::sin(azimuth),
                                           std::sin(elevation));
            const Eigen::Vector3d& found = directions[static_cast<std::size_t>(j * 720 + i)];
            EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 4e-15);
            EXPECT_NEAR(found.squaredNorm(), 1.0, 4e-15);
        }
    }
}

TEST(LidarGrid, RefusesAnglesAndCountsOutOfRangeWithALine) {
    const auto refusal = [](const LidarGridSettings& settings) {
        return message_of(make_lidar_grid(settings));
    };
    EXPECT_EQ(refusal({}), "");
    EXPECT_EQ(refusal({.azimuth_count = 1, .elevation_count = 1}), "");
    EXPECT_EQ(refusal({.azimuth_count = 0}), "azimuth_count must be 1 to 1048576, got 0");
    EXPECT_EQ(refusal({.azimuth_count = 1 << 20, .elevation_count = 65, .elevation_step = 0.0}),
              "azimuth_count * elevation_count must be 1 to 67108864, got 68157440");
    EXPECT_NE(refusal({.first_azimuth = kNan}), "");
    EXPECT_NE(refusal({.azimuth_step = 7.0}), "");
    EXPECT_NE(refusal({.first_elevation = -1.6}), "");
    EXPECT_NE(refusal({.elevation_count = 200}), "");
    EXPECT_NE(refusal({.elevation_count = -3}), "");
}

}  // namespace terrane::lidar_test
