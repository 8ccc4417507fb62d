// SPDX-License-Identifier: MIT
#pragma once

#include "collision/ground/ground_oracle.h"
#include "test_hull.h"

#include <array>
#include <ostream>
#include <string>

// Random pairs of shapes: about half of them overlap.
namespace terrane::test {

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

/// Hulls of every kind: regular, random, flat, a segment, a point.
inline const std::vector<TestHull>& test_hulls() {
    static const std::vector<TestHull> hulls = [] {
        using V = Eigen::Vector3d;
        std::vector<TestHull> made;
        made.emplace_back(std::vector<V>{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}});
        made.emplace_back(
            std::vector<V>{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}});
        std::vector<V> prism;
        std::vector<V> flat;
        for (int i = 0; i < 7; ++i) {
            const double x = std::cos(0.9 * i), y = std::sin(0.9 * i);
            prism.push_back({x, y, 0.3});
            prism.push_back({x, y, -0.3});
            flat.push_back({x, y, 0.0});
        }
        made.emplace_back(prism);
        made.emplace_back(flat);
        made.emplace_back(
            std::vector<V>{{0, 0, 0}, {1, 0.2, 0}, {0.1, 1, 0}, {-0.3, 0.4, 0}});  // off its origin
        made.emplace_back(std::vector<V>{{0.5, 0.2, 0.1}, {-0.5, 0.1, 0.3}});
        made.emplace_back(std::vector<V>{{0.1, 0.2, 0.3}});
        Random random(7);
        for (const int count : {5, 8, 14, 24, 48}) {
            std::vector<V> ball;
            for (int i = 0; i < count; ++i) ball.push_back(random.direction());
            made.emplace_back(ball);
        }
        // Needle.
        made.emplace_back(
            std::vector<V>{{2, 0, 0}, {-1, 0.05, 0}, {-1, -0.05, 0.05}, {-1, -0.03, -0.05}});
        return made;
    }();
    return hulls;
}

/// @param is_degenerate some of its sizes may be 0
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
    return test_hulls()[which].view();
}

struct Case {
    internal::ConvexView a, b;
    Pose pose_a, pose_b;
};

inline Case random_case(Random& random, const KindPair& kinds, int i) {
    Case c;
    c.a = random_shape(random, kinds.a, i % 5 == 3);
    c.b = random_shape(random, kinds.b, i % 5 == 4 || i % 25 == 3);
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

/// The pair in world axes relative to a's origin, as the library places it.
struct PlacedCase {
    explicit PlacedCase(const Case& c)
        : a(internal::place(c.a, orthonormalized(c.pose_a.rotation), Eigen::Vector3d::Zero())),
          b(internal::place(c.b, orthonormalized(c.pose_b.rotation),
                            c.pose_b.translation - c.pose_a.translation)),
          gap(internal::find_gap(a, b)) {}
    internal::PlacedConvex a, b;
    internal::Gap gap;
};

}  // namespace terrane::test
