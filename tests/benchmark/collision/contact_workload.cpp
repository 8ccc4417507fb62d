// SPDX-License-Identifier: MIT
#include "benchmark/collision/contact_workload.h"

#include "support/random.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/pager.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

namespace terrane::bench {
namespace {

using test::HeightTable;
using test::Random;

template <class Value>
Value value_or_exit(Result<Value> result) {
    if (result) return std::move(*result);
    std::fprintf(stderr, "contact_benchmark: %s\n", result.error().message.c_str());
    std::exit(1);
}

// Spread evenly over all rotations (K. Shoemake, Uniform Random Rotations, 1992).
Eigen::Matrix3d random_rotation(Random& random) {
    const double u = random.between(0.0, 1.0);
    const double a = random.between(0.0, 2.0 * std::numbers::pi);
    const double b = random.between(0.0, 2.0 * std::numbers::pi);
    const double r = std::sqrt(1.0 - u), s = std::sqrt(u);
    const Eigen::Quaterniond q(s * std::cos(b), r * std::sin(a), r * std::cos(a), s * std::sin(b));
    return q.normalized().toRotationMatrix();
}

Eigen::Vector3d random_direction(Random& random) {
    const double z = random.between(-1.0, 1.0);
    const double angle = random.between(0.0, 2.0 * std::numbers::pi);
    const double ring = std::sqrt(1.0 - z * z);
    return {ring * std::cos(angle), ring * std::sin(angle), z};
}

WorldPos random_place(Random& random, const ContactMap& map, double border) {
    const double x = random.between(border, map.width() - border);
    const double y = random.between(border, map.width() - border);
    return {x, y, map.ground.height(x, y).height};
}

// The highest sample of the cells within a distance along both axes.
double highest_near(const HeightTable& table, double x, double y, double distance) {
    const auto first = [&](double p) {
        return std::clamp(static_cast<int>(std::floor((p - distance) / table.spacing)), 0,
                          table.columns - 1);
    };
    const auto last = [&](double p) {
        return std::clamp(static_cast<int>(std::ceil((p + distance) / table.spacing)), 0,
                          table.columns - 1);
    };
    float highest = table.at(first(x), first(y));
    for (int row = first(y); row <= last(y); ++row) {
        for (int column = first(x); column <= last(x); ++column) {
            highest = std::max(highest, table.at(column, row));
        }
    }
    return static_cast<double>(highest);
}

}  // namespace

ContactMap make_contact_map(int side, double spacing) {
    return make_map(test::make_contact_table(side, spacing));
}

ContactMap make_map(const HeightTable& heights) {
    const int side = heights.columns;
    const auto source = std::make_shared<const test::TableHeights>(heights);
    PagerSettings settings;
    settings.memory_bytes = std::size_t{2} << 30;
    settings.worker_count = 0;
    Pager pager = value_or_exit(Pager::create(source, settings));
    RequiredRegion required = pager.require(source->extent(), 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    if (!required.is_ready()) {
        std::fprintf(stderr, "contact_benchmark: %d x %d samples are not all resident\n", side,
                     side);
        std::exit(1);
    }
    ContactMap map{pager.ground(), {}};
    map.table.columns = map.table.rows = side;
    map.table.spacing = heights.spacing;
    const double quantum = map.ground.lattice().quantum;
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const bool last_column = column + 1 == side, last_row = row + 1 == side;
            const GroundCell cell = map.ground.cell(column - last_column, row - last_row);
            const std::int32_t quanta = last_row
                                            ? (last_column ? cell.north_east : cell.north_west)
                                            : (last_column ? cell.south_east : cell.south_west);
            map.table.heights.push_back(static_cast<float>(quantum * quanta));
        }
    }
    return map;
}

std::vector<Ray> make_vertical_rays(const ContactMap& map, std::size_t count, std::uint64_t seed) {
    constexpr double kAbove = 200.0, kBelow = -200.0;
    Random random(seed);
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) {
        ray.from = ray.to = random_place(random, map, map.table.spacing);
        ray.from.z() = kAbove;
        ray.to.z() = kBelow;
    }
    return rays;
}

std::vector<Ray> make_grazing_rays(const ContactMap& map, std::size_t count, double length,
                                   std::uint64_t seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) {
        ray.from = random_place(random, map, map.table.spacing);
        ray.from.z() += random.between(1.5, 40.0);
        const double angle = random.between(0.0, 2.0 * std::numbers::pi);
        const Eigen::Vector3d direction(std::cos(angle), std::sin(angle),
                                        -random.between(0.0, 0.15));
        ray.to = ray.from + length * direction.normalized();
    }
    return rays;
}

std::vector<Pose> make_poses(const ContactMap& map, std::size_t count, double highest,
                             double border, std::uint64_t seed) {
    Random random(seed);
    std::vector<Pose> poses(count);
    for (Pose& pose : poses) {
        pose.translation = random_place(random, map, border);
        pose.translation.z() += random.between(0.0, highest);
        pose.rotation = random_rotation(random);
    }
    return poses;
}

std::vector<Pose> make_standing_poses(const ContactMap& map, std::size_t count, const Box& box,
                                      std::uint64_t seed) {
    constexpr double kDepth = 0.001;
    const Eigen::Vector3d& half = box.half_extents;
    Random random(seed);
    std::vector<Pose> poses(count);
    for (Pose& pose : poses) {
        const WorldPos place = random_place(random, map, half.norm() + map.table.spacing);
        const double angle = random.between(0.0, 2.0 * std::numbers::pi);
        const Eigen::Vector3d level_x(std::cos(angle), std::sin(angle), 0.0);
        const Eigen::Vector3d level_y(-level_x.y(), level_x.x(), 0.0);
        const auto ground_at = [&](const Eigen::Vector3d& offset) {
            const WorldPos p = place + offset;
            return WorldPos(p.x(), p.y(), map.ground.height(p.x(), p.y()).height);
        };
        const Eigen::Vector3d x =
            (ground_at(half.x() * level_x) - ground_at(-half.x() * level_x)).normalized();
        const Eigen::Vector3d along_y =
            ground_at(half.y() * level_y) - ground_at(-half.y() * level_y);
        const Eigen::Vector3d z = x.cross(along_y).normalized();
        pose.rotation << x, z.cross(x), z;
        pose.translation = place;
        pose.translation.z() += compute_lift(box, pose, map.ground).lift - kDepth;
    }
    return poses;
}

std::vector<Sweep> make_sweeps(const ContactMap& map, std::size_t count, const Shape& shape,
                               double length, double highest, bool grazing, std::uint64_t seed) {
    const double radius = bounding_radius(shape);
    Random random(seed);
    std::vector<Sweep> sweeps(count);
    for (std::size_t i = 0; i < count; ++i) {
        Sweep& sweep = sweeps[i];
        WorldPos& from = sweep.start.translation;
        from = random_place(random, map, length + 5.0);
        from.z() = highest_near(map.table, from.x(), from.y(), radius) + radius +
                   random.between(0.05, highest);
        sweep.start.rotation = random_rotation(random);
        Eigen::Vector3d direction;
        if (grazing && i % 2 == 1) {
            const double angle = random.between(0.0, 2.0 * std::numbers::pi);
            direction = {std::cos(angle), std::sin(angle), -random.between(0.0, 0.4)};
            direction.normalize();
        } else {
            do direction = random_direction(random);
            while (direction.z() > -0.05);
        }
        sweep.translation = length * direction;
    }
    return sweeps;
}

BodyDrop lay_out_drop(const ContactMap& map, std::span<const Shape> shapes, std::size_t count,
                      double half_width, double distance, const Eigen::Vector3d& velocity) {
    test::Random random(5);
    const auto row = static_cast<std::size_t>(2.0 * half_width / distance);
    const double middle = 0.5 * map.width();
    BodyDrop drop;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t layer = i / (row * row), place = i % (row * row);
        const double x = middle - half_width + distance * (0.5 + static_cast<double>(place % row));
        const double y = middle - half_width + distance * (0.5 + static_cast<double>(place / row));
        BodyState state;
        state.pose.translation = {
            x, y, map.ground.height(x, y).height + 5.0 + distance * static_cast<double>(layer)};
        const Eigen::Vector3d turn = 3.0 * random.direction();
        state.pose.rotation = Motion{{}, Eigen::Vector3d::Zero(), turn}.at(1.0).rotation;
        state.velocity = velocity;
        drop.settings.push_back({.shape = shapes[i % shapes.size()]});
        drop.states.push_back(state);
    }
    return drop;
}

}  // namespace terrane::bench
