// SPDX-License-Identifier: MIT
//
// Source: C. Ericson. Real-Time Collision Detection. 2005, sections 5.1 and 5.2 (closest points of
//         segments, separating axes).
#include "benchmark/collision/contact_engine.h"
#include "support/random.h"
#include "world/solver/ground_contact_cache.h"

#include <terrane/collision/ground_queries.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace terrane::bench {
namespace {

using Vector = Eigen::Vector3d;
using Corners = std::array<Vector, 3>;

double distance_of_segments(const Vector& p, const Vector& q, const Vector& a, const Vector& b) {
    const Vector along = q - p, edge = b - a, between = p - a;
    const double aa = along.dot(along), ee = edge.dot(edge), ae = along.dot(edge);
    const double ab = along.dot(between), eb = edge.dot(between);
    const double denominator = aa * ee - ae * ae;
    double s = denominator > 1e-18 ? std::clamp((ae * eb - ab * ee) / denominator, 0.0, 1.0) : 0.0;
    double t = (ae * s + eb) / ee;
    if (t < 0.0 || t > 1.0) {
        t = std::clamp(t, 0.0, 1.0);
        s = aa > 0.0 ? std::clamp((ae * t - ab) / aa, 0.0, 1.0) : 0.0;
    }
    return (between + s * along - t * edge).norm();
}

bool is_foot_inside(const Vector& p, const Corners& triangle, const Vector& normal) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Vector edge = triangle[(i + 1) % 3] - triangle[i];
        if (edge.cross(p - triangle[i]).dot(normal) < 0.0) return false;
    }
    return true;
}

// Of the segment p to q, which may be a point.
double distance_of_core(const Vector& p, const Vector& q, const Corners& triangle) {
    const Vector normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
    const double over_p = normal.dot(p - triangle[0]), over_q = normal.dot(q - triangle[0]);
    if ((over_p < 0.0) != (over_q < 0.0) &&
        is_foot_inside(p + over_p / (over_p - over_q) * (q - p), triangle, normal)) {
        return 0.0;
    }
    double distance = std::numeric_limits<double>::infinity();
    if (is_foot_inside(p, triangle, normal)) distance = std::abs(over_p);
    if (is_foot_inside(q, triangle, normal)) distance = std::min(distance, std::abs(over_q));
    for (std::size_t i = 0; i < 3; ++i) {
        distance =
            std::min(distance, distance_of_segments(p, q, triangle[i], triangle[(i + 1) % 3]));
    }
    return distance;
}

double overlap_of_box(const Box& box, const Pose& pose, const Corners& triangle) {
    Corners body;
    for (std::size_t i = 0; i < 3; ++i) {
        body[i] = pose.rotation.transpose() * (triangle[i] - pose.translation);
    }
    double least = std::numeric_limits<double>::infinity();
    const auto look_along = [&](Vector axis) {
        const double size = axis.norm();
        if (size < 1e-9) return;  // parallel edges: covered by other axes
        axis /= size;
        const double reach = axis.cwiseAbs().dot(box.half_extents);
        const std::array<double, 3> at{axis.dot(body[0]), axis.dot(body[1]), axis.dot(body[2])};
        const auto [low, high] = std::minmax_element(at.begin(), at.end());
        least = std::min({least, reach - *low, reach + *high});
    };
    const Corners edges{body[1] - body[0], body[2] - body[1], body[0] - body[2]};
    look_along(edges[0].cross(edges[1]));
    for (int axis = 0; axis < 3; ++axis) {
        look_along(Vector::Unit(axis));
        for (const Vector& edge : edges) look_along(Vector::Unit(axis).cross(edge));
    }
    return least;
}

}  // namespace

double ContactOracle::height(double x, double y) const {
    const int column = std::clamp(static_cast<int>(x / table_.spacing), 0, table_.columns - 2);
    const int row = std::clamp(static_cast<int>(y / table_.spacing), 0, table_.rows - 2);
    const double u = x / table_.spacing - column, v = y / table_.spacing - row;
    const auto at = [&](int i, int j) {
        return static_cast<double>(table_.at(column + i, row + j));
    };
    if (is_cut_to_north_east_(column, row)) {
        if (u > v) return at(0, 0) + u * (at(1, 0) - at(0, 0)) + v * (at(1, 1) - at(1, 0));
        return at(0, 0) + u * (at(1, 1) - at(0, 1)) + v * (at(0, 1) - at(0, 0));
    }
    if (u + v < 1.0) return at(0, 0) + u * (at(1, 0) - at(0, 0)) + v * (at(0, 1) - at(0, 0));
    return at(1, 1) - (1.0 - u) * (at(1, 1) - at(0, 1)) - (1.0 - v) * (at(1, 1) - at(1, 0));
}

double ContactOracle::deepest(const Shape& shape, const Pose& pose) const {
    const Vector& centre = pose.translation;
    const double radius = bounding_radius(shape);
    double deepest = -std::numeric_limits<double>::infinity();
    const auto look_at = [&](const Corners& triangle) {
        double depth = 0.0;
        if (const Box* box = std::get_if<Box>(&shape)) {
            depth = overlap_of_box(*box, pose, triangle);
        } else if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
            const Vector core = capsule->half_height * pose.rotation.col(2);
            depth = capsule->radius - distance_of_core(centre - core, centre + core, triangle);
        } else {
            depth = std::get<Sphere>(shape).radius - distance_of_core(centre, centre, triangle);
        }
        deepest = std::max(deepest, depth);
    };
    const auto cell_of = [&](double p) { return static_cast<int>(std::floor(p / table_.spacing)); };
    const int west = std::max(cell_of(centre.x() - radius), 0);
    const int east = std::min(cell_of(centre.x() + radius), table_.columns - 2);
    const int south = std::max(cell_of(centre.y() - radius), 0);
    const int north = std::min(cell_of(centre.y() + radius), table_.rows - 2);
    const auto corner = [&](int column, int row) {
        return Vector(table_.spacing * column, table_.spacing * row,
                      static_cast<double>(table_.at(column, row)));
    };
    for (int row = south; row <= north; ++row) {
        for (int column = west; column <= east; ++column) {
            const Vector sw = corner(column, row), se = corner(column + 1, row);
            const Vector nw = corner(column, row + 1), ne = corner(column + 1, row + 1);
            if (is_cut_to_north_east_(column, row)) {
                look_at({sw, se, ne});
                look_at({sw, ne, nw});
            } else {
                look_at({sw, se, nw});
                look_at({se, ne, nw});
            }
        }
    }
    return deepest;
}

namespace {

// Nearer than this to the height of first touch, metres: below the oracle's own tolerance.
constexpr double kTouchPrecision = 1e-9;

// Axes of a rectangle that lies on the ground: x and y along its sides, z out of the ground.
Eigen::Matrix3d rotation_along_ground(const ContactOracle& surface, const WorldPos& place,
                                      const Eigen::Vector2d& half, double angle) {
    const Eigen::Vector3d level_x(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Vector3d level_y(-level_x.y(), level_x.x(), 0.0);
    const auto ground_at = [&](const Eigen::Vector3d& offset) {
        const WorldPos p = place + offset;
        return WorldPos(p.x(), p.y(), surface.height(p.x(), p.y()));
    };
    const Eigen::Vector3d x =
        (ground_at(half.x() * level_x) - ground_at(-half.x() * level_x)).normalized();
    const Eigen::Vector3d along_y = ground_at(half.y() * level_y) - ground_at(-half.y() * level_y);
    const Eigen::Vector3d z = x.cross(along_y).normalized();
    Eigen::Matrix3d rotation;
    rotation << x, z.cross(x), z;
    return rotation;
}

// At rest a box stands on its broad side, and a capsule lies along the ground.
Eigen::Matrix3d resting_rotation(const ContactOracle& surface, const Shape& shape,
                                 const WorldPos& place, double angle) {
    if (const Box* const box = std::get_if<Box>(&shape)) {
        return rotation_along_ground(surface, place, box->half_extents.head<2>(), angle);
    }
    const double half = bounding_radius(shape);
    const Eigen::Matrix3d along =
        rotation_along_ground(surface, place, Eigen::Vector2d(half, half), angle);
    Eigen::Matrix3d lying;
    lying << along.col(1), along.col(2), along.col(0);
    return lying;
}

// The height of the centre at which the shape, from above, first touches the surface.
double find_touching_height(const ContactOracle& surface, const Shape& shape, Pose pose) {
    const WorldPos& centre = pose.translation;
    double inside = surface.height(centre.x(), centre.y());
    double apart = inside + bounding_radius(shape);
    const auto overlaps_at = [&](double z) {
        pose.translation.z() = z;
        return surface.deepest(shape, pose) > 0.0;
    };
    while (overlaps_at(apart)) apart += bounding_radius(shape);
    while (apart - inside > kTouchPrecision) {
        const double middle = 0.5 * (inside + apart);
        (overlaps_at(middle) ? inside : apart) = middle;
    }
    return apart;
}

WorldPos random_place(test::Random& random, const ContactMap& map, double border) {
    const double x = random.between(border, map.width() - border);
    const double y = random.between(border, map.width() - border);
    return {x, y, map.ground.height(x, y).height};
}

// The highest sample of the cells within a distance along both axes.
double highest_near(const test::HeightTable& table, double x, double y, double distance) {
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

std::vector<Pose> make_poses(const ContactMap& map, std::size_t count, double highest,
                             double border, std::uint64_t seed) {
    test::Random random(seed);
    std::vector<Pose> poses(count);
    for (Pose& pose : poses) {
        pose.translation = random_place(random, map, border);
        pose.translation.z() += random.between(0.0, highest);
        pose.rotation = random.rotation();
    }
    return poses;
}

std::vector<Pose> make_standing_poses(const ContactMap& map, std::size_t count, const Box& box,
                                      std::uint64_t seed) {
    constexpr double kDepth = 0.001;
    const ContactOracle surface(map.table, cut_as_terrane);
    const double border = box.half_extents.norm() + map.table.spacing;
    test::Random random(seed);
    std::vector<Pose> poses(count);
    for (Pose& pose : poses) {
        pose.translation = random_place(random, map, border);
        pose.rotation = resting_rotation(surface, box, pose.translation,
                                         random.between(0.0, 2.0 * std::numbers::pi));
        pose.translation.z() += compute_lift(box, pose, map.ground).lift - kDepth;
    }
    return poses;
}

std::vector<Sweep> make_sweeps(const ContactMap& map, std::size_t count, const Shape& shape,
                               double length, double highest, bool grazing, std::uint64_t seed) {
    const double radius = bounding_radius(shape);
    test::Random random(seed);
    std::vector<Sweep> sweeps(count);
    for (std::size_t i = 0; i < count; ++i) {
        Sweep& sweep = sweeps[i];
        WorldPos& from = sweep.start.translation;
        from = random_place(random, map, length + 5.0);
        from.z() = highest_near(map.table, from.x(), from.y(), radius) + radius +
                   random.between(0.05, highest);
        sweep.start.rotation = random.rotation();
        Eigen::Vector3d direction;
        if (grazing && i % 2 == 1) {
            const double angle = random.between(0.0, 2.0 * std::numbers::pi);
            direction = {std::cos(angle), std::sin(angle), -random.between(0.0, 0.4)};
            direction.normalize();
        } else {
            do direction = random.direction();
            while (direction.z() > -0.05);
        }
        sweep.translation = length * direction;
    }
    return sweeps;
}

ShallowPoses make_shallow_poses(const ContactMap& map, Cut cut, const Shape& shape,
                                std::size_t count, std::uint64_t seed) {
    const ContactOracle surface(map.table, cut);
    const double tolerance = default_contact_tolerance(shape);
    ShallowPoses shallow;
    shallow.margin = internal::kContactMargin * tolerance;
    test::Random random(seed);
    const double border = 2.0 * bounding_radius(shape) + map.table.spacing;
    const std::vector<Pose> places = make_poses(map, count, 0.0, border, seed + 1);
    for (std::size_t i = 0; i < count; ++i) {
        Pose pose = places[i];
        const double angle = random.between(0.0, 2.0 * std::numbers::pi);
        const double gap = random.between(-tolerance, shallow.margin);
        if (i % 2 == 0) pose.rotation = resting_rotation(surface, shape, pose.translation, angle);
        pose.translation.z() = find_touching_height(surface, shape, pose) + gap;
        shallow.poses.push_back(pose);
        shallow.vertical_gaps.push_back(gap);
    }
    return shallow;
}

}  // namespace terrane::bench
