// SPDX-License-Identifier: MIT
#pragma once

#include "collision/ground/ground_cases.h"
#include "pairs/convex_pairs.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

namespace terrane::test {

/// Number of random cases; tests labelled long multiply it by TERRANE_CASE_FACTOR.
inline int case_count(int full) {
    return static_cast<int>(full * number_from("TERRANE_CASE_FACTOR", 0.4));
}

inline internal::HullView view_of(const ConvexHull& hull) {
    return {internal::polyhedron(hull), bounding_radius(hull)};
}

// Random pairs of shapes, about half of them overlapping.

enum class Kind { sphere, capsule, box, hull };
inline constexpr std::array<const char*, 4> kKindNames = {"sphere", "capsule", "box", "hull"};

inline std::string name_of(Kind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }
inline void PrintTo(Kind kind, std::ostream* out) { *out << name_of(kind); }

struct KindPair {
    Kind a, b;
    std::string name() const { return name_of(a) + "_" + name_of(b); }
};
inline void PrintTo(const KindPair& pair, std::ostream* out) { *out << pair.name(); }

inline std::vector<KindPair> all_pairs() {
    std::vector<KindPair> pairs;
    for (int a = 0; a < 4; ++a) {
        for (int b = a; b < 4; ++b) pairs.push_back({static_cast<Kind>(a), static_cast<Kind>(b)});
    }
    return pairs;
}

/// Hulls of every kind: regular, random, flat, segment, point.
inline const std::vector<ConvexHull>& test_hulls() {
    static const std::vector<ConvexHull> hulls = [] {
        std::vector<ConvexHull> made;
        made.push_back(make_hull({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}));
        made.push_back(
            make_hull({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}));
        Points prism, flat;
        for (int i = 0; i < 7; ++i) {
            const double x = std::cos(0.9 * i), y = std::sin(0.9 * i);
            prism.emplace_back(x, y, 0.3);
            prism.emplace_back(x, y, -0.3);
            flat.emplace_back(x, y, 0.0);
        }
        made.push_back(make_hull(prism));
        made.push_back(make_hull(flat));
        // off its origin
        made.push_back(make_hull({{0, 0, 0}, {1, 0.2, 0}, {0.1, 1, 0}, {-0.3, 0.4, 0}}));
        made.push_back(make_hull({{0.5, 0.2, 0.1}, {-0.5, 0.1, 0.3}}));
        made.push_back(make_hull({{0.1, 0.2, 0.3}}));
        Random random(7);
        for (const int count : {5, 8, 14, 24, 48}) made.push_back(make_hull(sphere(random, count)));
        // needle-shaped
        made.push_back(
            make_hull({{2, 0, 0}, {-1, 0.05, 0}, {-1, -0.05, 0.05}, {-1, -0.03, -0.05}}));
        return made;
    }();
    return hulls;
}

/// @param is_degenerate whether sizes may be 0
inline internal::ConvexView random_shape(Random& random, Kind kind, bool is_degenerate) {
    const auto size = [&](double low, double high) {
        return is_degenerate && random.between(0, 1) < 0.4 ? 0.0 : random.between(low, high);
    };
    switch (kind) {
        case Kind::sphere:
            return Sphere{size(0.1, 1.0)};
        case Kind::capsule:
            return Capsule{size(0.1, 0.7), size(0.1, 1.0)};
        case Kind::box:
            return Box{{size(0.1, 1.0), size(0.1, 1.0), size(0.1, 1.0)}};
        case Kind::hull:
            break;
    }
    static constexpr std::array<std::size_t, 9> kSolid = {0, 1, 2, 7, 8, 9, 10, 7, 12};
    static constexpr std::array<std::size_t, 4> kThin = {3, 4, 5, 6};
    const std::size_t which = is_degenerate
                                  ? kThin[static_cast<std::size_t>(random.between(0, 4))]
                                  : kSolid[static_cast<std::size_t>(random.between(0, 9))];
    return view_of(test_hulls()[which]);
}

struct Case {
    internal::ConvexView a, b;
    Pose pose_a, pose_b;
};

inline Case random_case(Random& random, const KindPair& kinds, int i) {
    Case c{.a = random_shape(random, kinds.a, i % 5 == 3),
           .b = random_shape(random, kinds.b, i % 5 == 4 || i % 25 == 3),
           .pose_a = {},
           .pose_b = {}};
    c.pose_a.rotation = random.rotation();
    c.pose_b.rotation = random.rotation();
    if (i % 4 == 1) {  // aligned, as resting bodies are
        c.pose_b.rotation = c.pose_a.rotation;
        if (i % 8 == 1) c.pose_a.rotation = c.pose_b.rotation = Eigen::Matrix3d::Identity();
    }
    const double far = internal::reach_of(c.a) + internal::reach_of(c.b);
    c.pose_a.translation = 3.0 * random.direction();
    c.pose_b.translation =
        c.pose_a.translation + random.between(0.0, 1.2) * far * random.direction();
    if (i % 50 == 7) c.pose_b.translation = c.pose_a.translation;
    if (i % 100 == 9) c.pose_b = c.pose_a;
    return c;
}

/// The pair in world axes relative to a's origin, as the library represents it.
struct PlacedCase {
    explicit PlacedCase(const Case& c)
        : a(internal::place(c.a, orthonormalized(c.pose_a.rotation), Eigen::Vector3d::Zero())),
          b(internal::place(c.b, orthonormalized(c.pose_b.rotation),
                            c.pose_b.translation - c.pose_a.translation)),
          gap(internal::find_gap(a, b)) {}
    internal::PlacedConvex a, b;
    internal::Gap gap;
};

// Casts of two shapes that move towards each other.

/// Exactly orthonormal start rotations, as bodies have them.
inline Motion motion_of(const Pose& pose, const Eigen::Vector3d& translation,
                        const Eigen::Vector3d& rotation_vector = Eigen::Vector3d::Zero()) {
    Motion motion{.start = {orthonormalized(pose.rotation), pose.translation},
                  .translation = translation,
                  .rotation_vector = rotation_vector};
    return motion;
}

struct Thrown {
    Motion a, b;
};

/// Motions of pair i: usually separated at the start, one aimed near the other, with or without rotation.
inline Thrown throw_together(Random& random, const Pose& pose_a, Pose pose_b, int i) {
    const double distance =
        std::array<double, 3>{3.0, 10.0, 100.0}[static_cast<std::size_t>(i % 3)];
    const double spin = std::array<double, 4>{0.0, 0.3, 3.0, 25.0}[static_cast<std::size_t>(i % 4)];
    const Eigen::Vector3d from = random.direction();
    pose_b.translation = pose_a.translation + random.between(0.3, 0.9) * distance * from;
    const Eigen::Vector3d both = 20.0 * random.direction();
    // Named variables fix the order of the draws on every compiler.
    const Eigen::Vector3d aside = 0.5 * random.direction();
    const Eigen::Vector3d spin_a = spin * random.direction();
    const Eigen::Vector3d spin_b = spin * random.direction();
    return {motion_of(pose_a, both + distance * from + aside, spin_a),
            motion_of(pose_b, both, spin_b)};
}

/// Before the reported time the shapes do not touch; at a hit their distance is within the tolerance.
///
/// @param distance_at distance at a fraction of the motions
/// @param slack accuracy of the distances, metres
template <class Answer, class DistanceAt>
void expect_stops_where_they_meet(const Answer& answer, DistanceAt&& distance_at, int steps,
                                  const CastSettings& settings, double slack) {
    EXPECT_FALSE(answer.started_in_contact);
    for (int k = 0; k <= steps; ++k) {
        EXPECT_GE(distance_at(answer.fraction * k / steps), -1e-12) << k;
    }
    if (!answer.hit) {
        EXPECT_EQ(answer.fraction, 1.0);
        EXPECT_EQ(answer.count, 0u);
        return;
    }
    const double there = distance_at(answer.fraction);
    EXPECT_LE(there, settings.tolerance + slack);
    ASSERT_GT(answer.count, 0u);
    EXPECT_NEAR(answer.contacts[0].depth, -there, 1e-9);
}

}  // namespace terrane::test
