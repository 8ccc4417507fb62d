// SPDX-License-Identifier: MIT
//
// Scans of 64 x 1024 directions, 0.5 to 200 m, from 2 m above the ground, among no bodies and among 100.
#include "benchmark/terrain/batch_ground.h"
#include "support/random.h"

#include <terrane/collision/lidar.h>
#include <terrane/collision/world.h>

#include <vector>

namespace terrane {
namespace {

constexpr LidarGridSettings kGrid{
    .elevation_count = 64, .first_elevation = -0.4, .elevation_step = 0.01};

Pose sensor_pose() {
    Pose pose;
    pose.translation = {40.0, -70.0, bench::fractal_ground().height(40.0, -70.0).height + 2.0};
    return pose;
}

// Boxes and capsules on the ground within 150 m of the sensor.
World make_world(std::int64_t count) {
    World world = bench::value_or_exit(World::create({}));
    test::Random random(4);
    const WorldPos centre = sensor_pose().translation;
    for (std::int64_t i = 0; i < count; ++i) {
        BodySettings body;
        body.type = BodyType::static_body;
        if (i % 2 == 0) {
            body.shape = Box{Eigen::Vector3d(2.2, 1.0, 0.9)};
        } else {
            body.shape = Capsule{0.3, 0.6};
        }
        BodyState state;
        const double x = centre.x() + random.between(-150.0, 150.0);
        const double y = centre.y() + random.between(-150.0, 150.0);
        state.pose.translation = {x, y, bench::fractal_ground().height(x, y).height + 0.9};
        bench::value_or_exit(world.add(body, state));
    }
    return world;
}

void lidar_scan(benchmark::State& state) {
    const Ground& ground = bench::fractal_ground();
    const World world = make_world(state.range(0));
    const std::vector<Eigen::Vector3d> directions = bench::value_or_exit(make_lidar_grid(kGrid));
    Lidar lidar = bench::value_or_exit(Lidar::create(
        {.min_range = 0.5, .max_range = 200.0, .worker_count = static_cast<int>(state.range(1))},
        directions));
    std::vector<double> ranges(directions.size());
    std::vector<LidarStatus> statuses(directions.size());
    LidarArrays out;
    out.ranges = ranges;
    out.statuses = statuses;
    for (auto _ : state) {
        if (!lidar.scan(ground, &world, sensor_pose(), out)) std::exit(1);
        benchmark::ClobberMemory();
    }
    bench::set_item_time(state, directions.size());
}
BENCHMARK(lidar_scan)
    ->ArgNames({"bodies", "threads"})
    ->ArgsProduct({{0, 100}, {1, 2}})
    ->UseRealTime();

void lidar_rays_one_by_one(benchmark::State& state) {
    const Ground& ground = bench::fractal_ground();
    const World world = make_world(state.range(0));
    const std::vector<Eigen::Vector3d> directions = bench::value_or_exit(make_lidar_grid(kGrid));
    const WorldPos from = sensor_pose().translation;
    std::vector<double> fractions(directions.size());
    for (auto _ : state) {
        for (std::size_t i = 0; i < directions.size(); ++i) {
            fractions[i] =
                world.ray(ground, from + 0.5 * directions[i], from + 200.0 * directions[i])
                    .fraction;
        }
        benchmark::ClobberMemory();
    }
    bench::set_item_time(state, directions.size());
}
BENCHMARK(lidar_rays_one_by_one)->ArgName("bodies")->Arg(0)->Arg(100)->UseRealTime();

}  // namespace
}  // namespace terrane
