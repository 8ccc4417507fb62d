// SPDX-License-Identifier: MIT
//
// Batches of heights and rays, scans of a lidar and windows of samples, beside single calls.
#include "benchmark/bench.h"
#include "benchmark/collision/contact_workload.h"
#include "support/random.h"

#include <terrane/collision/lidar.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground_batch.h>
#include <terrane/terrain/ground_window.h>

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

namespace terrane {
namespace {

using bench::value_or_exit;
using test::Random;

/// Fractal ground of 2 km x 2 km around (0, 0), 1 m between samples, all of it resident: 256 chunks of 0.13 MB.
const Ground& fractal_ground() {
    static const Ground ground = [] {
        FractalSettings settings;
        settings.seed = 3;
        settings.root_size_log2 = 10;
        settings.finest_spacing_log2 = 0;
        settings.wavelength_log2 = 10;
        settings.amplitude = 100.0;
        const std::shared_ptr<const HeightSource> source =
            value_or_exit(FractalHeights::create(settings));
        return bench::load_ground(source);
    }();
    return ground;
}

/// The counter `per_item`: seconds of the clock that the benchmark uses, for one of `count` items of an iteration.
void set_item_time(benchmark::State& state, std::size_t count) {
    const double items = static_cast<double>(state.iterations()) * static_cast<double>(count);
    state.counters["per_item"] =
        benchmark::Counter(items, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

constexpr std::size_t kCount = 1'000'000;
constexpr double kHalfSide = 1000.0;

std::vector<double> random_places() {
    Random random(1);
    std::vector<double> places;
    for (std::size_t i = 0; i < 2 * kCount; ++i)
        places.push_back(random.between(-kHalfSide, kHalfSide));
    return places;
}

// Row by row over a square of 1000 x 1000 points, 0.7 m apart.
std::vector<double> grid_places() {
    std::vector<double> places;
    for (int row = 0; row < 1000; ++row) {
        for (int column = 0; column < 1000; ++column) {
            places.push_back(-340.0 + 0.7 * column);
            places.push_back(-350.0 + 0.7 * row);
        }
    }
    return places;
}

std::vector<double> places_of(std::int64_t order) {
    return order == 0 ? random_places() : grid_places();
}

void heights_one_by_one(benchmark::State& state) {
    const Ground& ground = fractal_ground();
    const std::vector<double> places = places_of(state.range(0));
    std::vector<double> heights(kCount);
    for (auto _ : state) {
        for (std::size_t i = 0; i < kCount; ++i)
            heights[i] = ground.height(places[2 * i], places[2 * i + 1]).height;
        benchmark::ClobberMemory();
    }
    set_item_time(state, kCount);
}
BENCHMARK(heights_one_by_one)->ArgName("grid")->Arg(0)->Arg(1)->UseRealTime();

void heights_in_batch(benchmark::State& state) {
    const Ground& ground = fractal_ground();
    const std::vector<double> places = places_of(state.range(0));
    GroundBatch batch =
        value_or_exit(GroundBatch::create({.worker_count = static_cast<int>(state.range(1))}));
    std::vector<double> heights(kCount), normals(3 * kCount), errors(kCount);
    std::vector<QueryStatus> statuses(kCount);
    HeightArrays out{.heights = heights};
    if (state.range(2) != 0) {
        out.normals = normals;
        out.errors_m = errors;
        out.statuses = statuses;
    }
    for (auto _ : state) {
        if (!batch.heights(ground, PointArray::interleaved_xy(places), out)) std::exit(1);
        benchmark::ClobberMemory();
    }
    set_item_time(state, kCount);
}
BENCHMARK(heights_in_batch)
    ->ArgNames({"grid", "threads", "all"})
    ->ArgsProduct({{0, 1}, {1, 2}, {0, 1}})
    ->UseRealTime();

// Segments of 200 m: a scan of 1000 azimuths x 100 elevations from 2 m above the ground at each of 10 places, or from
// random places 2 to 40 m above the ground in random directions.
struct Segments {
    std::vector<double> from, to;
};

Segments make_segments(std::int64_t is_scan) {
    const Ground& ground = fractal_ground();
    Random random(2);
    Segments segments;
    const auto add = [&](const WorldPos& from, double azimuth, double elevation) {
        const Eigen::Vector3d direction(std::cos(azimuth) * std::cos(elevation),
                                        std::sin(azimuth) * std::cos(elevation),
                                        std::sin(elevation));
        const WorldPos to = from + 200.0 * direction;
        segments.from.insert(segments.from.end(), from.data(), from.data() + 3);
        segments.to.insert(segments.to.end(), to.data(), to.data() + 3);
    };
    const auto place = [&](double above) {
        const double x = random.between(-700.0, 700.0), y = random.between(-700.0, 700.0);
        return WorldPos(x, y, ground.height(x, y).height + above);
    };
    if (is_scan != 0) {
        for (int scan = 0; scan < 10; ++scan) {
            const WorldPos from = place(2.0);
            for (int ring = 0; ring < 100; ++ring) {
                for (int step = 0; step < 1000; ++step)
                    add(from, 2.0 * std::numbers::pi * step / 1000.0, -0.4 + 0.006 * ring);
            }
        }
        return segments;
    }
    for (std::size_t i = 0; i < kCount; ++i) {
        const WorldPos from = place(random.between(2.0, 40.0));
        const double azimuth = random.between(0.0, 2.0 * std::numbers::pi);
        add(from, azimuth, random.between(-0.4, 0.2));
    }
    return segments;
}

void rays_one_by_one(benchmark::State& state) {
    const Ground& ground = fractal_ground();
    const Segments segments = make_segments(state.range(0));
    std::vector<double> fractions(kCount);
    std::size_t hits = 0;
    for (auto _ : state) {
        hits = 0;
        for (std::size_t i = 0; i < kCount; ++i) {
            const RayAnswer answer = ground.ray(Eigen::Map<const WorldPos>(&segments.from[3 * i]),
                                                Eigen::Map<const WorldPos>(&segments.to[3 * i]));
            hits += answer.status == QueryStatus::ok;
            fractions[i] = answer.fraction;
        }
        benchmark::ClobberMemory();
    }
    state.counters["hit_share"] = static_cast<double>(hits) / static_cast<double>(kCount);
    set_item_time(state, kCount);
}
BENCHMARK(rays_one_by_one)->ArgName("scan")->Arg(0)->Arg(1)->UseRealTime();

void rays_in_batch(benchmark::State& state) {
    const Ground& ground = fractal_ground();
    const Segments segments = make_segments(state.range(0));
    GroundBatch batch =
        value_or_exit(GroundBatch::create({.worker_count = static_cast<int>(state.range(1))}));
    std::vector<double> fractions(kCount);
    std::vector<QueryStatus> statuses(kCount);
    for (auto _ : state) {
        if (!batch.rays(ground, PointArray::interleaved_xyz(segments.from),
                        PointArray::interleaved_xyz(segments.to),
                        {.fractions = fractions, .statuses = statuses})) {
            std::exit(1);
        }
        benchmark::ClobberMemory();
    }
    set_item_time(state, kCount);
}
BENCHMARK(rays_in_batch)
    ->ArgNames({"scan", "threads"})
    ->ArgsProduct({{0, 1}, {1, 2}})
    ->UseRealTime();

// Scans of 64 x 1024 directions, 0.5 to 200 m, from 2 m above the ground, among no bodies and among 100.
constexpr LidarGridSettings kGrid{
    .elevation_count = 64, .first_elevation = -0.4, .elevation_step = 0.01};

Pose sensor_pose() {
    Pose pose;
    pose.translation = {40.0, -70.0, fractal_ground().height(40.0, -70.0).height + 2.0};
    return pose;
}

// Boxes and capsules on the ground within 150 m of the sensor.
World make_world(std::int64_t count) {
    World world = value_or_exit(World::create({}));
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
        state.pose.translation = {x, y, fractal_ground().height(x, y).height + 0.9};
        value_or_exit(world.add(body, state));
    }
    return world;
}

void lidar_scan(benchmark::State& state) {
    const Ground& ground = fractal_ground();
    const World world = make_world(state.range(0));
    const std::vector<Eigen::Vector3d> directions = value_or_exit(make_lidar_grid(kGrid));
    Lidar lidar = value_or_exit(Lidar::create(
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
    set_item_time(state, directions.size());
}
BENCHMARK(lidar_scan)
    ->ArgNames({"bodies", "threads"})
    ->ArgsProduct({{0, 100}, {1, 2}})
    ->UseRealTime();

void lidar_rays_one_by_one(benchmark::State& state) {
    const Ground& ground = fractal_ground();
    const World world = make_world(state.range(0));
    const std::vector<Eigen::Vector3d> directions = value_or_exit(make_lidar_grid(kGrid));
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
    set_item_time(state, directions.size());
}
BENCHMARK(lidar_rays_one_by_one)->ArgName("bodies")->Arg(0)->Arg(100)->UseRealTime();

// A window of 255 x 255 cells that follows a box to and fro: by one column an update, except for a few after each turn;
// or reading all of it.
void window_update(benchmark::State& state) {
    const Ground& ground = fractal_ground();
    GroundWindow window = value_or_exit(GroundWindow::create({.margin = 120}));
    double x = -400.0, step = 1.0;
    for (auto _ : state) {
        if (state.range(0) != 0) window.set_base(0.0);  // reads everything
        x += step;
        if (std::abs(x) >= 400.0) step = -step;
        window.update(ground, {{x, 0.0, 0.0}, {x + 1.0, 1.0, 1.0}});
    }
}
BENCHMARK(window_update)->ArgName("all")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace terrane

BENCHMARK_MAIN();
