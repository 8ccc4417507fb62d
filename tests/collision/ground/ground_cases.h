// SPDX-License-Identifier: MIT
#pragma once

#include "collision/shapes/point_clouds.h"
#include "ground_oracle.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <ostream>
#include <span>
#include <string>
#include <vector>

// Poses, motions and grounds of random tests.
namespace terrane::test {

inline Pose pose_at(double x, double y, double z) { return Pose{.translation = {x, y, z}}; }

inline Pose moved(Pose pose, const Eigen::Vector3d& d) {
    pose.translation += d;
    return pose;
}

inline Pose random_pose(Random& random, const Ground& ground, double low, double high) {
    Pose pose{.rotation = random.rotation()};
    const double x = random.between(10.0, 118.0);
    const double y = random.between(10.0, 118.0);
    pose.translation = {x, y, ground.height(x, y).height + random.between(low, high)};
    return pose;
}

inline Motion straight(const Eigen::Vector3d& from, const Eigen::Vector3d& translation) {
    Motion motion{.start = {.translation = from}, .translation = translation};
    return motion;
}

inline Motion random_motion(Random& random, const Ground& ground, double distance, double spin) {
    Motion motion{.start = random_pose(random, ground, 2.0, 7.0),
                  .translation = distance * random.direction(),
                  .rotation_vector = spin * random.direction()};
    return motion;
}

/// Motion number i: 5 or 60 m long, with up to four turns.
inline Motion random_motion(Random& random, const Ground& ground, int i) {
    constexpr std::array<double, 4> kSpins{0.0, 0.3, 3.0, 25.0};
    return random_motion(random, ground, i % 3 == 0 ? 5.0 : 60.0,
                         kSpins[static_cast<std::size_t>(i % 4)]);
}

/// The shortest translation that satisfies all contacts, by Dykstra's projection algorithm.
inline Eigen::Vector3d resolve(std::span<const Contact> contacts) {
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
    std::vector<double> corrections(contacts.size(), 0.0);
    for (int round = 0; round < 20000; ++round) {
        double change = 0.0;
        for (std::size_t i = 0; i < contacts.size(); ++i) {
            const double rest = contacts[i].depth - contacts[i].normal.dot(d);
            const double correction = std::max(-corrections[i], rest);
            corrections[i] += correction;
            d += correction * contacts[i].normal;
            change = std::max(change, std::abs(correction));
        }
        if (change < 1e-13) break;
    }
    return d;
}

/// Identical rough ground at the origin and 1e7 m east and north of it, shifted by whole root squares.
struct FarGround {
    static constexpr std::int32_t kRoots = 78125;  // root squares of 128 m
    static constexpr double kShift = 128.0 * kRoots;

    Ground near = make_test_ground(hash_height, 1.0, 1);
    Ground far = make_far();

private:
    static Ground make_far() {
        TableGroundSettings settings{.first_root = kRoots};
        return make_test_ground(
            [](double x, double y) { return hash_height(x - kShift, y - kShift); }, settings);
    }
};

// Hulls and compounds for ground queries, and oracles that share no method with the library.

inline ConvexHull make_hull(const Points& points) { return ConvexHull::create(points).value(); }

inline Points box_corners(const Eigen::Vector3d& half) {
    Points points;
    for (int k = 0; k < 8; ++k) {
        points.emplace_back((k & 1) != 0 ? half.x() : -half.x(),
                            (k & 2) != 0 ? half.y() : -half.y(),
                            (k & 4) != 0 ? half.z() : -half.z());
    }
    return points;
}

struct NamedHull {
    std::string name;
    Points points;
};

/// Hulls of every dimension, none centred on its origin.
inline std::vector<NamedHull> make_hulls(Random& random) {
    const Eigen::Vector3d off(0.3, -0.2, 0.4);
    const auto turned = [&](const Points& points) {
        return transformed(points, 1.0, random.rotation(), off);
    };
    return {
        {"box", turned(box_corners({1.0, 1.5, 0.5}))},
        {"ball of 20", turned(stretched(sphere(random, 20), {1.2, 0.9, 0.7}))},
        {"tetrahedron", turned({{1, 0, 0}, {-0.5, 1, 0}, {-0.5, -1, 0}, {0, 0, 1.2}})},
        {"prism of 12", turned(prism(12, 0.8))},
        {"quadrangle", turned({{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}})},
        {"triangle", turned({{1, 0, 0}, {-0.5, 1, 0}, {-0.5, -1, 0}})},
        {"segment", turned({{0.9, 0, 0}, {-0.9, 0, 0}})},
        {"point", turned({{0, 0, 0}})},
    };
}

/// Triangles that cover the hull of a few points: every triple with all other points on one side. Fewer than three
/// points are returned as they are.
inline std::vector<Points> cover_hull(const Points& points) {
    if (points.size() < 3) return {points};
    std::vector<Points> cover;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = i + 1; j < points.size(); ++j) {
            for (std::size_t k = j + 1; k < points.size(); ++k) {
                const Eigen::Vector3d n = (points[j] - points[i]).cross(points[k] - points[i]);
                double low = 0.0, high = 0.0;
                for (std::size_t m = 0; m < points.size(); ++m) {
                    if (m == i || m == j || m == k) continue;
                    low = std::min(low, n.dot(points[m] - points[i]));
                    high = std::max(high, n.dot(points[m] - points[i]));
                }
                if (low < -1e-9 && high > 1e-9) continue;
                cover.push_back({points[i], points[j], points[k]});
            }
        }
    }
    return cover;
}

/// Lift by clipping: surface polygons of the shape over the triangles of the ground.
inline double clip_hull_lift(const std::vector<Points>& cover, const Pose& pose,
                             std::span<const Corners> soup) {
    double lift = -std::numeric_limits<double>::infinity();
    for (const Points& polygon : cover) {
        Points placed;
        for (const Eigen::Vector3d& p : polygon) placed.push_back(pose * p);
        for (const Corners& triangle : soup) {
            lift = std::max(lift, clip_polygon_lift(placed, triangle));
        }
    }
    return lift;
}

/// The triangles of the ground under the AABB of a sphere around a pose.
inline std::vector<Corners> soup_around(const Ground& ground, const Pose& pose, double radius) {
    const Eigen::Vector3d& p = pose.translation;
    return make_soup(ground, p.x() - radius, p.y() - radius, p.x() + radius, p.y() + radius);
}

/// A named shape for parametrised tests.
struct NamedShape {
    std::string name;  ///< letters, digits and underscores
    Shape shape;
};

inline std::ostream& operator<<(std::ostream& out, const NamedShape& named) {
    return out << named.name;
}

/// One shape of every kind: make_shapes(), make_hulls(), a compound of those hulls, and a compound of all kinds.
inline std::vector<NamedShape> make_named_shapes() {
    Random random(20261102);
    std::vector<NamedShape> shapes;
    const std::array<const char*, 3> names{"sphere", "capsule", "box"};
    for (const Shape& shape : make_shapes()) shapes.push_back({names[shapes.size()], shape});
    std::vector<CompoundPart> side_by_side;
    for (NamedHull& named : make_hulls(random)) {
        const ConvexHull hull = make_hull(named.points);
        std::replace(named.name.begin(), named.name.end(), ' ', '_');
        shapes.push_back({"hull_" + named.name, hull});
        side_by_side.push_back({hull, pose_at(random.between(-2.0, 2.0), 0.0, 0.0)});
    }
    shapes.push_back({"compound_of_hulls", Compound::create(side_by_side).value()});
    const std::vector<CompoundPart> parts{
        {make_hull(sphere(random, 20)), pose_at(2.0, 0.0, 0.3)},
        {Box{{0.5, 1.0, 0.2}}, pose_at(-1.5, 1.0, 0.0)},
        {Capsule{0.3, 0.6}, pose_at(0.0, -2.0, 0.5)},
        {Sphere{0.4}, pose_at(0.5, 0.5, -1.0)},
    };
    shapes.push_back({"compound", Compound::create(parts).value()});
    return shapes;
}

/// Tests that run once per shape of make_named_shapes().
class EveryShape : public testing::TestWithParam<NamedShape> {
protected:
    const Shape& shape() const { return GetParam().shape; }
};

inline std::string shape_name(const testing::TestParamInfo<NamedShape>& info) {
    return info.param.name;
}

}  // namespace terrane::test
