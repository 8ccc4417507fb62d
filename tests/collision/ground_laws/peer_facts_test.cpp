// SPDX-License-Identifier: MIT
// Facts that Jolt, coal and parry test about themselves.
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cstdio>

namespace terrane::peer_facts_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260311;
using Real = long double;
using V = Vec<Real>;

TEST(PeerFacts, ASquareHolePassesSmallerSpheresAndStopsLargerOnes) {
    TableGroundSettings settings{
        .is_outside = [](double x, double y) { return x == 60.5 && y == 60.5; }};
    const Ground ground = make_test_ground([](double, double) { return 2.0; }, settings);
    Motion motion{.start = {.translation = {60.5, 60.5, 12.0}}, .translation = {0.0, 0.0, -20.0}};
    const CastAnswer small = cast(Sphere{0.48}, motion, ground);
    EXPECT_EQ(small.status, QueryStatus::ok);
    EXPECT_FALSE(small.hit);
    const CastAnswer large = cast(Sphere{0.51}, motion, ground);
    EXPECT_TRUE(large.hit);
    // on the rim of the hole, where the sphere rests
    EXPECT_NEAR(motion.at(large.fraction).translation.z(), 2.0 + std::sqrt(0.51 * 0.51 - 0.5 * 0.5),
                1e-3);
    Pose pose{.translation = {60.5, 60.5, 2.0}};
    EXPECT_FALSE(test_contact(Sphere{0.48}, pose, ground).is_touching);
    EXPECT_TRUE(test_contact(Sphere{0.51}, pose, ground).is_touching);
}

// Time of impact of a moving sphere with the faces, edges and corners of all triangles; infinity if it misses all.
Real time_of_impact(const Soup& soup, const Eigen::Vector3d& from,
                    const Eigen::Vector3d& translation, double radius_of) {
    const Real radius(radius_of);
    const V d = translation.cast<Real>();
    Real first = std::numeric_limits<Real>::infinity();
    const auto take_roots = [&](Real a, Real b, Real c, const auto& is_good) {
        const Real square = b * b - a * c;
        if (!(a > 0) || square < 0) return;
        const Real t = (-b - std::sqrt(square)) / a;
        if (t >= 0 && t <= 1 && t < first && is_good(t)) first = t;
    };
    const V low = V::Zero().cwiseMin(d) - V::Constant(radius);
    const V high = V::Zero().cwiseMax(d) + V::Constant(radius);
    soup.visit<Real>(from, low, high, low.z(), [&](const SoupTriangle<Real>& t) {
        const V n = (t.v[1] - t.v[0]).cross(t.v[2] - t.v[0]).normalized();
        const Real over = -n.dot(t.v[0]), speed = n.dot(d);
        if (speed < 0) {
            const Real at = (radius - over) / speed;
            const V p = at * d - radius * n;
            bool is_inside = at >= 0 && at <= 1;
            for (std::size_t k = 0; k < 3; ++k) {
                is_inside = is_inside && n.dot((t.v[(k + 1) % 3] - t.v[k]).cross(p - t.v[k])) >= 0;
            }
            if (is_inside) first = std::min(first, at);
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const V from_corner = -t.v[k];
            take_roots(d.squaredNorm(), d.dot(from_corner),
                       from_corner.squaredNorm() - radius * radius, [](Real) { return true; });
            const V edge = t.v[(k + 1) % 3] - t.v[k];
            const V u = edge.normalized();
            const V across = from_corner - u.dot(from_corner) * u, rate = d - u.dot(d) * u;
            take_roots(rate.squaredNorm(), rate.dot(across), across.squaredNorm() - radius * radius,
                       [&](Real at) {
                           const Real s = u.dot(from_corner + at * d);
                           return s >= 0 && s <= edge.norm();
                       });
        }
    });
    return first;
}

TEST(PeerFacts, RandomSphereCastsAgreeWithBruteForce) {
    SeededRandom random(kSeed);
    CastSettings settings{.tolerance = 1e-6};
    const long count = count_of_cases(8'000, 20'000);
    long hits = 0, within_tolerance = 0;
    for (long i = 0; i < count; ++i) {
        const LawScene& scene = scene_of(i);
        const double radius = i % 5 == 0 ? 0.0 : random.between(0.0, 1.0);
        const LawShape sphere{"sphere", Sphere{radius}, make_oracle(Sphere{radius})};
        Motion motion{.start = random_pose(random, scene, sphere, -random.between(1e-3, 5.0)),
                      .translation = random.between(1.0, 30.0) * random.direction()};
        SCOPED_TRACE(describe(scene, sphere, motion.start));
        const CastAnswer answer = cast(sphere.shape, motion, scene.ground, settings);
        const Real expected =
            time_of_impact(scene.soup, motion.start.translation, motion.translation, radius);
        const bool is_hit = expected <= 1;
        if (!answer.hit) {
            ASSERT_FALSE(is_hit) << static_cast<double>(expected) << " of a translation by "
                                 << motion.translation.transpose() << ", radius " << radius;
            continue;
        }
        ++hits;
        // Not later than the first touch, and earlier by at most the tolerance.
        if (is_hit) {
            ASSERT_LE(answer.fraction, static_cast<double>(expected) + 1e-12);
        }
        const Real gap =
            brute_gap<Real>(scene.soup, sphere.oracle, motion.at(answer.fraction), 1.0L);
        ASSERT_LE(static_cast<double>(gap), settings.tolerance + 1e-9);
        within_tolerance += !is_hit;
    }
    std::printf("%ld of %ld hit, %ld of them by passing within the tolerance\n", hits, count,
                within_tolerance);
    EXPECT_GT(hits, count / 4);
    EXPECT_LT(within_tolerance, 20);
}

}  // namespace terrane::peer_facts_test
