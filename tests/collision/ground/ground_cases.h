// SPDX-License-Identifier: MIT
#pragma once

#include "collision/shapes/point_clouds.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <ostream>
#include <span>
#include <string>
#include <vector>

// Poses, motions, grounds and shapes of random tests.
namespace terrane::test {

/// Pseudorandom height of a lattice point, in [0, 1).
inline double hash_height(double x, double y) {
    auto h = static_cast<std::uint32_t>(static_cast<std::int64_t>(x) * 73856093 ^
                                        static_cast<std::int64_t>(y) * 19349663);
    h = (h ^ (h >> 16)) * 0x7feb352du;
    h = (h ^ (h >> 15)) * 0x846ca68bu;
    return static_cast<double>(h ^ (h >> 16)) / 4294967296.0;
}

struct Scene {
    const char* name;
    Ground ground;
};

/// Grounds over [0, 128]^2 with 1 m cells, each difficult in a different way. Made once.
inline const std::vector<Scene>& scenes() {
    static const auto make = [](auto height) { return make_test_ground(height, 1.0, 1); };
    static const std::vector<Scene> made{
        {"plane", make([](double x, double y) { return 0.25 * x - 0.5 * y; })},
        {"stairs", make([](double x, double) { return std::floor(x / 4.0) * 0.5; })},
        {"spikes", make([](double x, double y) {
             return std::fmod(x, 5.0) == 0.0 && std::fmod(y, 5.0) == 0.0 ? 3.0 : 0.0;
         })},
        {"ridges", make([](double x, double) { return std::abs(std::fmod(x, 4.0) - 2.0); })},
        {"walls", make([](double x, double) { return std::fmod(x, 8.0) == 0.0 ? 5.0 : 0.0; })},
        {"pits", make([](double x, double y) {
             return std::fmod(x, 6.0) == 0.0 && std::fmod(y, 6.0) == 0.0 ? -4.0 : 0.0;
         })},
        {"rough", make(hash_height)}};
    return made;
}

inline std::vector<Shape> make_shapes() {
    return {Sphere{0.5}, Capsule{0.4, 0.8}, Box{Eigen::Vector3d(1.0, 1.5, 0.5)}};
}

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

/// The shortest translation that resolves all contacts: the most violated one is added to a set, for which every choice
/// of up to three contacts is tried, until none is violated.
inline Eigen::Vector3d resolve(std::span<const Contact> contacts) {
    using Vec = Eigen::Matrix<long double, 3, 1>;
    std::vector<Vec> n;
    std::vector<long double> b;
    Vec best = Vec::Zero();
    const auto consider = [&](const Vec& d) {
        if (!(d.squaredNorm() < best.squaredNorm())) return;
        for (std::size_t i = 0; i < n.size(); ++i) {
            if (n[i].dot(d) - b[i] < -1e-13L * (1 + d.norm())) return;
        }
        best = d;
    };
    for (std::size_t round = 0; round < contacts.size(); ++round) {
        const Contact* worst = nullptr;
        long double least = -1e-12L * (1 + best.norm());
        for (const Contact& contact : contacts) {
            const long double over = contact.normal.cast<long double>().dot(best) - contact.depth;
            if (over < least) {
                least = over;
                worst = &contact;
            }
        }
        if (worst == nullptr) break;
        n.push_back(worst->normal.cast<long double>());
        b.push_back(worst->depth);
        best = Vec::Constant(1e30L);
        for (std::size_t i = 0; i < n.size(); ++i) {
            consider(b[i] * n[i] / n[i].squaredNorm());
            for (std::size_t j = i + 1; j < n.size(); ++j) {
                const Vec c = n[i].cross(n[j]);
                const long double square = c.squaredNorm();
                if (square < 1e-24L) continue;
                consider((b[i] * n[j].cross(c) + b[j] * c.cross(n[i])) / square);
                for (std::size_t k = j + 1; k < n.size(); ++k) {
                    const long double volume = c.dot(n[k]);
                    if (std::abs(volume) < 1e-12L) continue;
                    consider((b[i] * n[j].cross(n[k]) + b[j] * n[k].cross(n[i]) + b[k] * c) /
                             volume);
                }
            }
        }
    }
    return best.cast<double>();
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
