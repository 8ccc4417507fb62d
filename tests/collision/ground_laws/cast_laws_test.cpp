// SPDX-License-Identifier: MIT
// Casts against brute-force lifts along the motion: they never pass through the ground and never hit too early.
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cstdio>

namespace terrane::cast_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260306;

const LawShape& random_shape(Random& random) {
    const int count = static_cast<int>(law_shapes().size());
    return law_shapes()[static_cast<std::size_t>(random.below(count))];
}

// Starts separated, 0.01 to 8 m up; steep, level or grazing translations of up to 200 m, half of them with rotation.
Motion random_motion(Random& random, const LawScene& scene, const LawShape& shape) {
    Motion motion;
    const double up = std::pow(10.0, random.between(-2.0, 0.9));
    motion.start = random_pose(random, scene, shape, -up);
    Eigen::Vector3d direction = random.direction();
    if (random.below(2) == 0) direction.z() = -0.05 * random.between(0.0, 1.0);
    motion.translation =
        std::pow(10.0, random.between(-1.0, std::log10(200.0))) * direction.normalized();
    constexpr std::array<double, 4> kSpins{0.0, 0.0, 1.0, 20.0};
    motion.rotation_vector = kSpins[static_cast<std::size_t>(random.below(4))] *
                             random.between(0.0, 1.0) * random.direction();
    return motion;
}

std::string describe(const LawScene& scene, const LawShape& shape, const Motion& motion) {
    std::string text =
        test::describe(scene, shape, motion.start) + ", translation and rotation vector";
    char number[32];
    for (const Eigen::Vector3d& v : {motion.translation, motion.rotation_vector}) {
        for (int i = 0; i < 3; ++i) {
            std::snprintf(number, sizeof number, " %a", v[i]);
            text += number;
        }
    }
    return text;
}

// The first sampled fraction with a lift above 1e-8; -1 if there is none.
double find_overlap(const LawScene& scene, const LawShape& shape, const Motion& motion,
                    double fraction, int steps) {
    for (int k = 0; k <= steps; ++k) {
        const double t = fraction * k / steps;
        if (is_deeper<double>(scene.soup, shape.oracle, motion.at(t), Eigen::Vector3d::Zero(),
                              1e-8)) {
            return t;
        }
    }
    return -1.0;
}

struct CastScore {
    long casts = 0, hits = 0, through = 0, late = 0;
};

void judge(const LawScene& scene, const LawShape& shape, const Motion& motion, CastScore& score) {
    const CastSettings settings;
    const CastAnswer answer = cast(shape.shape, motion, scene.ground, settings);
    ++score.casts;
    score.hits += answer.hit;
    if (answer.status != QueryStatus::ok || answer.started_in_contact ||
        (!answer.hit && answer.fraction != 1.0)) {
        ADD_FAILURE() << "status or start: " << describe(scene, shape, motion);
        return;
    }
    // Samples at most 0.5 m and 0.2 rad apart; no scene is wider than 400 m.
    const double distance_moved = std::min(1e3, answer.fraction * motion.translation.norm());
    const double turn = answer.fraction * motion.rotation_vector.norm();
    const int steps = 16 + static_cast<int>(std::max(2.0 * distance_moved, 5.0 * turn));
    const double inside = find_overlap(scene, shape, motion, answer.fraction, steps);
    if (inside >= 0.0) {
        ++score.through;
        ADD_FAILURE() << "in the ground at " << inside << " before " << answer.fraction << ", "
                      << (answer.hit ? "hit" : "no hit") << ": " << describe(scene, shape, motion);
    }
    if (!answer.hit) return;
    // Touches within the tolerance. signed_distance() ignores the sides of the ground; there the shape must overlap
    // twice the tolerance further on.
    const Pose there = motion.at(answer.fraction);
    const double distance = signed_distance(shape.shape, there, scene.ground, 1.0).distance;
    const Eigen::Vector3d& n = answer.contact.normal;
    const bool is_at_side = n.z() == 0.0 && is_deeper<double>(scene.soup, shape.oracle, there,
                                                              -2.0 * settings.tolerance * n, 1e-9);
    if (!(distance <= settings.tolerance + 1e-9) && !is_at_side) {
        ++score.late;
        ADD_FAILURE() << "hit " << distance << " m too early at " << answer.fraction << ": "
                      << describe(scene, shape, motion);
    }
}

TEST(LawsOfCasts, NeverThroughTheGroundAndNeverLate) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(5'000, 10'000'000);
    CastScore score;
    constexpr long kMany = 20;  // failures after which the test stops
    for (long i = 0; i < count && score.through + score.late < kMany; ++i) {
        const LawScene& scene = scene_of(random.below(static_cast<int>(law_scenes().size())));
        const LawShape& shape = random_shape(random);
        judge(scene, shape, random_motion(random, scene, shape), score);
        if ((i + 1) % 100'000 == 0 || i + 1 == count) {
            std::printf("%ld of %ld casts, %ld hits, %ld through, %ld too early\n", i + 1, count,
                        score.hits, score.through, score.late);
            std::fflush(stdout);
        }
    }
    EXPECT_GT(score.hits, score.casts / 4);
    EXPECT_LT(score.hits, score.casts);
}

// Regressions from long runs. Hits that were too early: an escape direction that rounding tilted downwards, and, on a
// high cliff, the rounding of a direction. A miss: the corner of the rod passes below the rim.
TEST(LawsOfCasts, HitNoEarlierThanTheyTouchAndAtTheSideOfTheGround) {
    struct Case {
        const char *scene, *shape;
        Eigen::Vector3d position;
        std::array<double, 9> rotation_by_rows;
        Eigen::Vector3d translation, rotation_vector;
        bool must_hit;
    };
    const Case cases[] = {
        {"rough",
         "flat hull",
         {0x1.e0eba6f3ea73p+5, 0x1.1991f3e6f8b23p+6, 0x1.0361ffc1dff21p+0},
         {0x1.bd7f383926a5p-5, -0x1.e87463e05c395p-1, 0x1.2dddbb8c3a2edp-2, 0x1.f17d933aeb669p-1,
          0x1.e5ae55942b608p-4, 0x1.a2c9b28e65d6ep-3, -0x1.d71dc651a04c9p-3, 0x1.19eca3182394p-2,
          0x1.dde9f93a35cf7p-1},
         {0x1.16363c537a635p+3, 0x1.ed63786c8a328p+1, -0x1.f669a821001e2p-4},
         {0x1.5923d037c2919p-4, 0x1.5372dd07ce636p-3, -0x1.fe8880dfc08e9p-4},
         false},
        {"contact terrain",
         "hull",
         {0x1.f465998cb0315p+4, 0x1.56ada26164561p+7, 0x1.3920b7003a1d2p+4},
         {-0x1.20a0851be7386p-1, -0x1.a180cc5cefb85p-1, -0x1.0d356e0c547d6p-3, 0x1.447598da2f85cp-1,
          -0x1.0ee22f8f33ec6p-1, 0x1.20f341abecb28p-1, -0x1.0f3a55ca42412p-1, 0x1.e0f40b98a24b7p-3,
          0x1.a1478dc198c4cp-1},
         {-0x1.e0ba62e2ef402p+3, 0x1.0249c856c2c6dp+0, -0x1.99afa20be9652p-2},
         {0x1.67b7841705038p-2, 0x1.ea74b4eb737bfp-3, 0x1.b8cfffae54c1ep-6},
         false},
        {"cliffs",
         "flat hull",
         {0x1.fff9338a7630ap+2, 0x1.d7d12e4718011p+2, 0x1.e848fb49029f9p+16},
         {-0x1.a34d037bcec98p-2, -0x1.a74eef054bb57p-5, 0x1.d25be92d7ae3bp-1, -0x1.976210aaf7e5p-1,
          0x1.0474af0e1cecep-1, -0x1.50b96c55edc35p-2, -0x1.c91397b73afep-2, -0x1.b801fbb74a696p-1,
          -0x1.fecd69e126eb8p-3},
         {-0x1.d9d7f145c7b2ep+0, -0x1.660551872a1ecp-5, -0x1.cc368334e138p-5},
         {0x0p+0, -0x0p+0, 0x0p+0},
         false},
        {"cliffs",
         "hull",
         {0x1.76cf4481945eap+3, 0x1.002c1b337129fp+3, 0x1.e848aea0f2adcp+16},
         {-0x1.3f2d7fe14ad44p-2, 0x1.a3b3349645d06p-6, -0x1.e650ed9d51261p-1, -0x1.e635aea859abcp-1,
          0x1.a536df76cbb6p-6, 0x1.3fd16022fb0d3p-2, 0x1.0995474437d2dp-5, 0x1.ffa9a69dcf506p-1,
          0x1.0b448cc2aec6p-6},
         {-0x1.5b8c2c12e9512p-1, 0x1.e559c33d23684p-3, -0x1.23ef9afcb900ap-1},
         {0x0p+0, -0x0p+0, 0x0p+0},
         false},
        {"sloped plane",
         "rod",
         {0x1.f2707b368c392p+6, 0x1.f0383824d7153p+5, 0x1.01174a7367657p+3},
         {0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0},
         {0x1.70f20cd11f394p+2, -0x1.128772f53d0c1p+4, -0x1.61212016bcd73p-3},
         {0x1.b1bfa4492e34ap+2, 0x1.852c55b3b7423p+2, 0x1.ba892b5d1aadep+1},
         true},
        {"cliffs",
         "flat hull",
         {0x1.e8d388098efbcp+2, 0x1.8527b92787c34p+2, 0x1.e84884954c5ccp+16},
         {-0x1.129003a1de7ecp-2, 0x1.ad4acb4368918p-1, 0x1.e5d2c8e7f681p-2, 0x1.53bbf6a40c8e1p-2,
          -0x1.8725d2741e3acp-2, 0x1.b9a223d028654p-1, 0x1.cf1475bb98228p-1, 0x1.8e02b32b7df85p-2,
          -0x1.67f3fb5bff108p-3},
         {-0x1.b98964b8ff412p+4, 0x1.1b5f0772eecc5p+2, -0x1.36dce9c1017ebp-2},
         {-0x1.ff7b882ffa09fp+0, -0x1.fac0f47527385p+0, 0x1.5df995995f898p+1},
         true},
    };
    CastScore score;
    for (const Case& each : cases) {
        const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(
            each.rotation_by_rows.data());
        const Motion motion{.start = {rotation, each.position},
                            .translation = each.translation,
                            .rotation_vector = each.rotation_vector};
        const long hits = score.hits;
        judge(scene_named(each.scene), shape_named(each.shape), motion, score);
        EXPECT_TRUE(!each.must_hit || score.hits > hits) << each.scene << ", " << each.shape;
    }
    EXPECT_EQ(score.late, 0);
    EXPECT_GE(score.hits, 5);
}

TEST(LawsOfCasts, OfNoLengthAndOfAThousandKilometresAnswer) {
    SeededRandom random(kSeed + 2);
    for (const LawScene& scene : law_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            Motion motion{.start = random_pose(random, scene, shape, -0.5)};
            EXPECT_FALSE(cast(shape.shape, motion, scene.ground).hit);
            motion.rotation_vector = {0.0, 0.0, 1e-3};
            EXPECT_FALSE(cast(shape.shape, motion, scene.ground).hit);
            motion.rotation_vector.setZero();
            motion.translation = {0.0, 0.0, -1e6};
            const CastAnswer down = cast(shape.shape, motion, scene.ground);
            EXPECT_TRUE(down.hit) << describe(scene, shape, motion);
            const Pose at = motion.at(down.fraction);
            EXPECT_LE(true_lift(scene, shape, at), 1e-9) << describe(scene, shape, motion);
            EXPECT_LE(signed_distance(shape.shape, at, scene.ground, 1.0).distance, 1e-4 + 1e-9);
            motion.translation = {0.0, 0.0, 1e6};
            EXPECT_FALSE(cast(shape.shape, motion, scene.ground).hit);
            // level, beyond the border of the ground: the same hit as for a motion of a thousandth of the length
            motion.translation = 1e6 * Eigen::Vector3d(0.6, 0.8, 0.0);
            const CastAnswer far = cast(shape.shape, motion, scene.ground);
            motion.translation *= 1e-3;
            CastScore score;
            judge(scene, shape, motion, score);
            const CastAnswer near = cast(shape.shape, motion, scene.ground);
            EXPECT_EQ(far.hit, near.hit);
            if (near.hit) {
                EXPECT_NEAR(1e6 * far.fraction, 1e3 * near.fraction, 1e-3);
            }
        }
    }
}

TEST(LawsOfCasts, StartingInContactOrAKilometreBelowHitAtFractionZero) {
    SeededRandom random(kSeed + 3);
    for (const LawScene& scene : law_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            for (const double lift : {0.0, 1e-6, 0.01, 0.5, 1000.0}) {
                Motion motion{.start = random_pose(random, scene, shape, lift),
                              .translation = 3.0 * random.direction()};
                SCOPED_TRACE(describe(scene, shape, motion));
                const CastAnswer answer = cast(shape.shape, motion, scene.ground);
                EXPECT_EQ(answer.status, QueryStatus::ok);
                EXPECT_TRUE(answer.started_in_contact);
                EXPECT_TRUE(answer.hit);
                EXPECT_EQ(answer.fraction, 0.0);
                if (lift > 1e-6) {
                    EXPECT_GT(answer.contact.depth, 0.0);
                }
                if (scene.name == "level plane") {
                    EXPECT_NEAR(answer.contact.depth, lift, 1e-9);
                }
            }
        }
    }
}

TEST(LawsOfCasts, SkippedContactsAreIgnoredUpwardsAndHitDownwards) {
    SeededRandom random(kSeed + 4);
    CastSettings settings{.skip_separating = true};
    for (const LawScene& scene : law_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            for (const double lift : {0.0, 1e-7, 1e-3}) {
                Motion motion{.start = random_pose(random, scene, shape, lift),
                              .translation = {0.0, 0.0, 2.0}};
                SCOPED_TRACE(describe(scene, shape, motion));
                EXPECT_FALSE(cast(shape.shape, motion, scene.ground, settings).hit);
                motion.translation = {0.0, 0.0, -2.0};
                const CastAnswer down = cast(shape.shape, motion, scene.ground, settings);
                EXPECT_TRUE(down.hit);
                EXPECT_EQ(down.fraction, 0.0);
            }
        }
    }
}

TEST(LawsOfCasts, AgreeWithDistanceAlongTheMotion) {
    SeededRandom random(kSeed + 5);
    const long count = count_of_cases(200, 40'000);
    for (long i = 0; i < count; ++i) {
        const LawScene& scene = scene_of(i);
        const LawShape& shape = random_shape(random);
        Motion motion = random_motion(random, scene, shape);
        motion.translation *= std::min(1.0, 5.0 / motion.translation.norm());
        SCOPED_TRACE(describe(scene, shape, motion));
        const CastAnswer answer = cast(shape.shape, motion, scene.ground);
        for (int k = 0; k <= 20; ++k) {
            const DistanceAnswer distance = signed_distance(
                shape.shape, motion.at(answer.fraction * k / 20), scene.ground, 1.0);
            ASSERT_GE(distance.distance, -1e-9) << k;
            if (k == 20 && answer.hit) {
                ASSERT_LE(distance.distance, 1e-4 + 1e-9);
            }
        }
    }
}

// Whether a shape overlaps by more than a touch: its lift is positive after small horizontal offsets too.
bool is_inside(const Shape& shape, const Pose& pose, const Ground& ground) {
    for (const auto& [x, y] :
         {std::pair(0.0, 0.0), std::pair(1e-6, 1.1e-6), std::pair(-1e-6, 1.1e-6),
          std::pair(1e-6, -1.1e-6), std::pair(-1e-6, -1.1e-6)}) {
        if (!(compute_lift(shape, moved(pose, {x, y, 0.0}), ground).lift > 1e-6)) return false;
    }
    return true;
}

// Through the border from outside, below the surface, on lattice lines and cell diagonals, where a shape without
// thickness only touches columns.
TEST(LawsOfCasts, ShapesWithoutThicknessThatMoveAlongSeamsAreStoppedAtTheBorder) {
    SeededRandom random(kSeed + 7);
    const LawScene slope = make_scene(
        "slope", [](double x, double y) { return 0.25 * x - 0.5 * y; }, TableGroundSettings{});
    const auto half = [&](double low, double high) {
        return 0.5 * std::round(2.0 * random.between(low, high));
    };
    const long count = count_of_cases(120, 20'000);
    for (const auto& [name, shape] : std::initializer_list<std::pair<const char*, Shape>>{
             {"point", Sphere{0.0}},
             {"segment", Capsule{0.0, 1.0}},
             {"box without size", Box{{0.0, 0.0, 0.0}}},
             {"plate", Box{{0.0, 1.0, 1.0}}},
             {"hull of a point", make_hull({{0, 0, 0}})},
             {"hull of a triangle", make_hull({{0, 0, 0}, {1, 1, 0}, {0, 0, 1}})}}) {
        long hits = 0;
        for (long i = 0; i < count; ++i) {
            Motion motion{
                .start = {.translation = {half(-6.0, 6.0), half(-6.0, 6.0), half(-20.0, 10.0)}}};
            const double x = half(-10.0, 10.0);
            const int direction = random.below(4);
            const double y = direction == 0 ? x : direction == 1 ? -x : half(-10.0, 10.0);
            motion.translation = {direction == 2 ? 0.0 : x, direction == 3 ? 0.0 : y,
                                  random.below(2) == 0 ? 0.0 : half(-30.0, 10.0)};
            if (random.below(2) == 0) motion.rotation_vector.z() = half(-3.0, 3.0);
            const CastAnswer answer = cast(shape, motion, slope.ground);
            if (answer.started_in_contact) continue;
            hits += answer.hit ? 1 : 0;
            const double end = answer.hit ? answer.fraction : 1.0;
            for (int k = 0; k <= 20; ++k) {
                ASSERT_FALSE(is_inside(shape, motion.at(end * k / 20), slope.ground))
                    << name << describe(slope, {name, shape, {}}, motion);
            }
        }
        EXPECT_GT(hits, count / 20) << name;
    }
}

}  // namespace terrane::cast_laws_test
