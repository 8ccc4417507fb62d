// SPDX-License-Identifier: MIT
#include "extremes/rows/grounds.h"

#include "support/random.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/function_heights.h>
#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <utility>
#include <vector>

namespace terrane::extremes {
namespace {

constexpr double kWaveSlope = 3.08, kWaveCurvature = 32.0;  // of wave()
constexpr double kSqrt2 = 1.4142135623730951;
constexpr int kPoints = 2000;
constexpr std::uint64_t kSeed = 20261127;

double wave(double t) {
    const double f = t - std::floor(t);
    const double g = f * (1.0 - f);
    return 16.0 * g * g;
}

/// Adds the chunks of the finest level over a region, and their ancestors.
void add_keys(const Lattice& lattice, const WorldRect& region, std::set<ChunkKey>& keys) {
    const double side = lattice.spacing * kChunkCells;
    const auto chunk_at = [&](double place, double origin) {
        return static_cast<std::int64_t>(std::floor((place - origin) / side));
    };
    const auto level = static_cast<std::uint8_t>(lattice.finest_level);
    for (std::int64_t y = chunk_at(region.south, lattice.origin_y);
         y <= chunk_at(region.north, lattice.origin_y); ++y) {
        for (std::int64_t x = chunk_at(region.west, lattice.origin_x);
             x <= chunk_at(region.east, lattice.origin_x); ++x) {
            ChunkKey key{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), level};
            if (!lattice.contains(key)) continue;
            while (keys.insert(key).second && key.level > 0) key = key.parent();
        }
    }
}

}  // namespace

Result<Source> make_hills(const Hills& hills) {
    const double slope = hills.amplitude / hills.wavelength * kWaveSlope * kSqrt2;
    const double curvature = hills.amplitude / hills.wavelength / hills.wavelength * kWaveCurvature;
    const auto height = [hills](double x, double y) {
        return hills.base +
               hills.amplitude * (wave(x / hills.wavelength) + wave(y / hills.wavelength));
    };
    return heights_from_function(
        height, {.extent = square_around(hills.middle_x, hills.middle_y, 0.5 * hills.side),
                 .finest_spacing = hills.spacing,
                 .quantum = hills.quantum,
                 .slope = slope,
                 .curvature = curvature,
                 .range = HeightInterval{hills.base - 0.001 * hills.amplitude,
                                         hills.base + 2.001 * hills.amplitude}});
}

Result<Source> make_valleys(double slope, double side) {
    constexpr double kPeriod = 8.0;
    const auto height = [slope](double x, double) {
        const double t = (x - 0.3) / kPeriod;
        return slope * kPeriod * std::abs(t - std::floor(t + 0.5));
    };
    // Fine enough for the slope, coarse enough for the height in 2^30 quanta.
    const double quantum = slope > 1e4 ? 0x1p-7 : 0x1p-12;
    return heights_from_function(height, {.extent = square_around(0.0, 0.0, 0.5 * side),
                                          .quantum = quantum,
                                          .slope = slope,
                                          .range = HeightInterval{0.0, 0.5 * kPeriod * slope}});
}

Source make_flat(double side, double spacing) {
    return heights_from_function([](double, double) { return 5.0; },
                                 {.extent = square_around(0.0, 0.0, 0.5 * side),
                                  .finest_spacing = spacing,
                                  .slope = 0.0,
                                  .curvature = 0.0,
                                  .range = HeightInterval{5.0, 5.0}})
        .value();
}

FractalSettings fractal_settings() { return {.seed = 7}; }

Result<Ground> load(const HeightSource& source, const WorldRect& region) {
    std::set<ChunkKey> keys;
    add_keys(source.lattice(), region, keys);
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (const ChunkKey& key : keys) {
        auto chunk = make_chunk(source, key);
        if (!chunk) return tl::unexpected(chunk.error());
        chunks.push_back(std::move(*chunk));
    }
    return Ground(std::make_shared<const ResidentSet>(source.lattice(), source.extent(),
                                                      std::move(chunks), 1),
                  source.lattice().finest_level);
}

Result<Ground> load(const HeightSource& source) { return load(source, source.extent()); }

WorldRect square_around(double x, double y, double half_side) {
    return {x - half_side, y - half_side, x + half_side, y + half_side};
}

double worst_error_share(const HeightSource& source, const Ground& ground,
                         const WorldRect& region) {
    test::Random random(kSeed);
    double worst = 0.0;
    for (int i = 0; i < kPoints; ++i) {
        const double x = random.between(region.west, region.east);
        const double y = random.between(region.south, region.north);
        const HeightAnswer answer = ground.height(x, y);
        if (answer.status != QueryStatus::ok) return std::numeric_limits<double>::quiet_NaN();
        const double share = std::abs(answer.height - source.height(x, y)) / answer.error_m;
        if (!(share <= worst)) worst = share;  // keeps NaN
        if (std::isnan(worst)) return worst;
    }
    return worst;
}

namespace {

double tolerance_of(const BodySettings& settings) {
    return settings.contact_tolerance > 0.0 ? settings.contact_tolerance
                                            : default_contact_tolerance(settings.shape);
}

/// Adds the bodies; false where one is refused or has no ground below.
bool add_bodies(World& world, const Ground& ground, const Fall& fall) {
    double x = fall.x;
    for (const Shape& shape : fall.shapes) {
        const double radius = bounding_radius(shape);
        BodyState state = at_place(x, fall.y, 0.0);
        const LiftAnswer lift = compute_lift(shape, state.pose, ground);
        if (lift.status != QueryStatus::ok || !std::isfinite(lift.lift)) return false;
        state.pose.translation.z() = lift.lift + fall.gap;
        state.velocity = fall.velocity;
        if (!world.add({.shape = shape, .restitution = 0.0}, state)) return false;
        x += 2.0 * radius + fall.gap;
    }
    return true;
}

}  // namespace

std::vector<Shape> shapes_of_size(double size) {
    std::vector<Eigen::Vector3d> corners{{-0.9, -0.6, -0.3}, {1.0, -0.7, -0.4}, {0.8, 0.9, -0.3},
                                         {-0.7, 0.8, -0.4},  {-0.5, 0.1, 0.9},  {0.3, 0.4, 0.7}};
    for (Eigen::Vector3d& corner : corners) corner *= size;
    CompoundPart head{Box{size * Eigen::Vector3d(0.3, 0.8, 0.3)}, {}};
    head.body_from_part.translation = size * Eigen::Vector3d(0.7, 0.1, 0.1);
    CompoundPart handle{Capsule{size * 0.25, size * 0.5}, {}};
    handle.body_from_part.rotation << 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
    return {Sphere{size}, Capsule{0.4 * size, 0.6 * size},
            Box{size * Eigen::Vector3d(1.0, 0.7, 0.5)}, ConvexHull::create(corners).value(),
            Compound::create(std::vector<CompoundPart>{head, handle}).value()};
}

double depth_share(const Ground& ground, const BodySettings& settings, const BodyState& state) {
    if (!state.pose.translation.allFinite() || !state.velocity.allFinite()) return kNan;
    const DistanceAnswer answer = signed_distance(settings.shape, state.pose, ground, 0.0);
    if (answer.status != QueryStatus::ok) return kInfinite;
    return std::max(0.0, -answer.distance) / tolerance_of(settings);
}

double worst_depth_share(const Ground& ground, const Fall& fall) {
    Result<World> world = World::create({.max_substep = fall.max_substep});
    if (!world || !add_bodies(*world, ground, fall)) return kNan;
    double worst = 0.0;
    for (int i = 0; i < fall.steps; ++i) {
        const StepReport report = world->step(ground, fall.dt);
        if (report.parked > 0 || report.refused_steps > 0 || report.too_deep > 0) return kInfinite;
        for (std::size_t body = 0; body < world->states().size(); ++body) {
            const double share =
                depth_share(ground, world->settings()[body], world->states()[body]);
            if (!(share <= worst)) worst = share;  // keeps NaN
            if (!(share <= kInfinite)) return share;
        }
    }
    return worst;
}

BodyState at_place(double x, double y, double z) {
    BodyState state;
    state.pose.translation = {x, y, z};
    return state;
}

}  // namespace terrane::extremes
