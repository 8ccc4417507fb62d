// SPDX-License-Identifier: MIT
#include "query/query_ground.h"

#include "query/answers.h"
#include "query/object_picker.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace terrane::tools {
namespace path_clip_test {

TEST(CutPath, CoversTheSegmentInsideTheExtentWithShortPieces) {
    test::Random random(11);
    const WorldRect extent{-100.0, -50.0, 300.0, 80.0};
    const double reach = 3.0;
    int inside = 0;
    for (int round = 0; round < 2000; ++round) {
        const WorldPos from(random.between(-500.0, 500.0), random.between(-500.0, 500.0), 0.0);
        const WorldPos to(random.below(4) == 0 ? from.x() : random.between(-500.0, 500.0),
                          random.below(4) == 0 ? from.y() : random.between(-500.0, 500.0), 0.0);
        const std::vector<WorldRect> pieces = cut_path(from, to, reach, 40.0, extent);
        for (const WorldRect& piece : pieces) {
            EXPECT_LE(piece.east - piece.west, 40.0 + 2.0 * reach + 1e-9);
            EXPECT_LE(piece.north - piece.south, 40.0 + 2.0 * reach + 1e-9);
        }
        for (int i = 0; i <= 50; ++i) {
            const WorldPos p = from + (to - from) * (i / 50.0);
            if (!extent.contains(p.x(), p.y())) continue;
            ++inside;
            const bool covered =
                std::any_of(pieces.begin(), pieces.end(),
                            [&](const WorldRect& piece) { return piece.contains(p.x(), p.y()); });
            EXPECT_TRUE(covered) << "seed 11, round " << round;
        }
    }
    EXPECT_GT(inside, 2000);
}

TEST(CutPath, IsShortForASegmentFromFarAway) {
    const WorldRect extent{0.0, 0.0, 100.0, 100.0};
    const std::vector<WorldRect> pieces =
        cut_path(WorldPos(-1e9, 50.0, 0.0), WorldPos(1e9, 50.0, 0.0), 1.0, 10.0, extent);
    EXPECT_LE(pieces.size(), 12u);
    EXPECT_TRUE(
        cut_path(WorldPos(-1e9, 200.0, 0.0), WorldPos(1e9, 200.0, 0.0), 1.0, 10.0, extent).empty());
}

TEST(DistanceBeside, IsZeroInsideAndEuclideanOutside) {
    const WorldRect rect{0.0, 0.0, 10.0, 10.0};
    EXPECT_EQ(distance_beside(WorldPos(5.0, 5.0, 99.0), rect), 0.0);
    EXPECT_EQ(distance_beside(WorldPos(13.0, 14.0, 0.0), rect), 5.0);
    EXPECT_EQ(distance_beside(WorldPos(-2.0, 5.0, 0.0), rect), 2.0);
}

}  // namespace path_clip_test

namespace long_ray_test {

std::shared_ptr<const HeightSource> endless() {
    static const auto source = FractalHeights::create({.seed = 4, .root_size_log2 = 31}).value();
    return source;
}

/// Room for a path of chunks from a root and some around its end.
QueryGround make_ground(std::size_t chunks = 200) {
    return QueryGround::create(endless(), {.memory_bytes = chunks * Chunk::max_bytes()}).value();
}

/// The first fraction at which the true surface is above a segment, marched; 1 where there is none.
double marched(const WorldPos& from, const WorldPos& to, double step) {
    const double count = std::ceil((to - from).norm() / step);
    for (double i = 0.0; i <= count; i += 1.0) {
        const WorldPos p = from + (i / count) * (to - from);
        if (endless()->height(p.x(), p.y()) >= p.z()) return i / count;
    }
    return 1.0;
}

TEST(NearPieces, LeaveOutNothingThatIsNearTheSurface) {
    constexpr std::uint64_t kSeed = 41;
    test::Random random(kSeed);
    int pieces_found = 0, near_points = 0;
    for (int i = 0; i < 100; ++i) {
        const WorldPos from(random.between(-1e6, 1e6), random.between(-1e6, 1e6),
                            random.between(-2000.0, 3000.0));
        const WorldPos to = from + WorldPos(random.between(-1e5, 1e5), random.between(-1e5, 1e5),
                                            random.between(-4000.0, 4000.0));
        NearPieces search(from, to, *endless(), 500.0, 5.0);
        std::vector<RayPiece> pieces;
        while (const auto piece = search.next()) {
            EXPECT_LE((piece->end - piece->begin) * (to - from).head<2>().norm(), 500.0);
            if (!pieces.empty()) {
                EXPECT_GE(piece->begin, pieces.back().end);
            }
            pieces.push_back(*piece);
        }
        pieces_found += static_cast<int>(pieces.size());
        for (int k = 0; k <= 500; ++k) {
            const double t = k / 500.0;
            const WorldPos p = from + t * (to - from);
            if (std::abs(p.z() - endless()->height(p.x(), p.y())) > 5.0) continue;
            ++near_points;
            EXPECT_TRUE(std::ranges::any_of(
                pieces, [t](const RayPiece& piece) { return piece.begin <= t && piece.end >= t; }))
                << "seed " << kSeed << ", segment " << i << ", " << t;
        }
    }
    EXPECT_GT(near_points, 20);
    EXPECT_LT(pieces_found, 100 * 200) << "most is left out";
}

TEST(NearPieces, OfASegmentAboveTheGroundOrBesideTheWorldAreNone) {
    const auto first = [](const WorldPos& from, const WorldPos& to) {
        return NearPieces(from, to, *endless(), 100.0, 1.0).next();
    };
    EXPECT_FALSE(first({-2e9, 0, 5000}, {2e9, 0, 5000}));
    EXPECT_FALSE(first({2.2e9, 0, 0}, {2.2e9, 1e9, 0}));
    EXPECT_TRUE(first({-2e9, 0, 0}, {2e9, 0, 0}));
}

TEST(LongRay, MeetsTheGroundWhereTheMarchedOneDoes) {
    constexpr std::uint64_t kSeed = 42;
    test::Random random(kSeed);
    QueryGround ground = make_ground();
    for (int i = 0; i < 12; ++i) {
        // ends under the ground, where it comes down steeply enough to pass hills in a short march
        const WorldPos to(random.between(-1.9e9, 1.9e9), random.between(-1.9e9, 1.9e9), -3000.0);
        const WorldPos from =
            to + WorldPos(random.between(3e5, 1e6), 1e5, random.between(1e5, 1e6));
        const RayAnswer answer = long_ray(ground, from, to);
        ground.release();
        ASSERT_EQ(answer.status, QueryStatus::ok) << "seed " << kSeed << ", ray " << i;
        const WorldPos& hit = answer.point_world;
        EXPECT_LE(std::abs(hit.z() - endless()->height(hit.x(), hit.y())), answer.error_m + 1e-5);
        const double length = (to - from).norm();
        const double above = 6000.0 / (from.z() - to.z());  // of the way: below all hilltops
        const double begin = 1.0 - above;
        const double oracle = begin + (1.0 - begin) * marched(from + begin * (to - from), to, 1.0);
        // marching may step over a crest
        EXPECT_LE(answer.fraction * length, oracle * length + 2.0 + answer.error_m) << i;
        EXPECT_NEAR(answer.fraction * length, oracle * length, 200.0) << i;
    }
}

TEST(LongRay, LoadsNothingAboveTheGround) {
    QueryGround ground = make_ground(60);
    const auto ask = [&](const std::string& from, const std::string& to) {
        const auto line = R"({"op":"ray","from":)" + from + R"(,"to":)" + to + "}";
        return answer_query(parse_query(line), ground)["status"];
    };
    EXPECT_EQ(ask("[-2e9,-2e9,1e5]", "[2e9,2e9,1e5]"), "miss");
    EXPECT_EQ(ask("[-2e9,-2e9,1700]", "[2e9,2e9,1650]"), "miss");
    EXPECT_EQ(ask("[0,0,1e6]", "[1e8,1e8,-3000]"), "ok");
}

}  // namespace long_ray_test

namespace object_picker_test {

constexpr double kNever = std::numeric_limits<double>::infinity();

std::shared_ptr<const HeightSource> hills() { return FractalHeights::create({.seed = 4}).value(); }

// A rock of about 2 m, placed three times and scattered: about 30 in a square of 100 m.
SceneObjects make_objects() {
    SceneObjects objects;
    objects.meshes = {test::make_rock(1, 5), test::make_tree(5)};
    objects.files = objects.names = {"rock.obj", "tree.obj"};
    const double ground = hills()->height(20.0, 30.0);
    for (std::size_t i = 0; i < 3; ++i) {
        SceneObject object;
        object.entry = i;
        object.mesh = i % 2;
        object.world_from_object.translation = {20.0 + 9.0 * static_cast<double>(i), 30.0, ground};
        object.scale = 1.0 + 2.0 * static_cast<double>(i);
        objects.objects.push_back(object);
    }
    for (std::size_t i = 0; i < 2; ++i) {
        SceneScatter scatter;
        scatter.entry = 3 + i;
        scatter.mesh = i;
        scatter.settings.per_km2 = 3000.0;
        scatter.settings.max_scale = 4.0;
        scatter.settings.seed = i;
        objects.scatters.push_back(scatter);
    }
    return objects;
}

// Triangles of all objects around the origin.
struct Placed {
    std::size_t entry = 0;
    WorldPos origin = WorldPos::Zero();
    double radius = 0.0;
    std::vector<std::array<Eigen::Vector3d, 3>> triangles;
};

Placed place(const TriangleMesh& mesh, std::size_t entry, const WorldPos& origin, double angle,
             double scale) {
    Placed placed = {.entry = entry, .origin = origin, .triangles = {}};
    const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitZ());
    std::vector<Eigen::Vector3d> corners;
    for (const Eigen::Vector3d& p : mesh.positions) {
        corners.push_back(origin + turn * Eigen::Vector3d(scale * p));
        placed.radius = std::max(placed.radius, scale * p.norm() + 1e-6);
    }
    for (const auto& [a, b, c] : mesh.triangles)
        placed.triangles.push_back({corners[a], corners[b], corners[c]});
    return placed;
}

std::vector<Placed> place_all(const SceneObjects& objects, double reach) {
    std::vector<Placed> all;
    for (const SceneObject& object : objects.objects) {
        all.push_back(place(objects.meshes[object.mesh], object.entry,
                            object.world_from_object.translation, 0.0, object.scale));
    }
    for (const SceneScatter& wanted : objects.scatters) {
        const Scatter scatter = Scatter::create(hills(), wanted.settings).value();
        const ScatterRange range = scatter.squares_within(WorldPos::Zero(), reach).value();
        for (std::int32_t y = range.low.y; y <= range.high.y; ++y) {
            for (std::int32_t x = range.low.x; x <= range.high.x; ++x) {
                const std::vector<ScatterPoint> points = scatter.objects_in({x, y}).value();
                for (const ScatterPoint& point : points) {
                    const double angle =
                        2.0 * std::atan2(point.half_turn_sine, point.half_turn_cosine);
                    all.push_back(place(objects.meshes[wanted.mesh], wanted.entry,
                                        point.position_world, angle, point.scale));
                }
            }
        }
    }
    return all;
}

struct Nearest {
    double fraction = kNever;
    std::size_t entry = 0;
    WorldPos origin = WorldPos::Zero();
    bool is_clear = true;  // not near an edge, where rounding decides
};

// All triangles of all objects one by one (T. Moller, B. Trumbore, 1997).
Nearest find_nearest(const std::vector<Placed>& all, const WorldPos& from, const WorldPos& to) {
    constexpr double kNear = 1e-6;
    Nearest nearest;
    const Eigen::Vector3d along = to - from;
    for (const Placed& each : all) {
        const double share =
            std::clamp((each.origin - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
        if ((from + share * along - each.origin).norm() > each.radius) continue;
        for (const auto& [a, b, c] : each.triangles) {
            const Eigen::Vector3d p = along.cross(c - a);
            const double determinant = (b - a).dot(p);
            if (determinant == 0.0) continue;
            const double u = (from - a).dot(p) / determinant;
            const Eigen::Vector3d q = (from - a).cross(b - a);
            const double v = along.dot(q) / determinant;
            const double t = (c - a).dot(q) / determinant;
            const double inside = std::min({u, v, 1.0 - u - v});
            if (t < -kNear || t > 1.0 + kNear || inside < -kNear) continue;
            if (inside < kNear || std::min(std::abs(t), std::abs(t - 1.0)) < kNear)
                nearest.is_clear = false;
            if (t < nearest.fraction) nearest = {t, each.entry, each.origin, nearest.is_clear};
        }
    }
    return nearest;
}

TEST(ObjectPicker, AgreesWithAllTrianglesOfAllObjects) {
    const SceneObjects objects = make_objects();
    const std::vector<Placed> all = place_all(objects, 1500.0);
    ASSERT_GT(all.size(), 5000u);
    ObjectPicker picker = ObjectPicker::create(hills(), objects).value();
    test::Random random(31);
    std::array<int, 5> hits{};
    int misses = 0;
    const double ground = hills()->height(0.0, 0.0);
    for (int i = 0; i < 1500; ++i) {
        const WorldPos from(random.between(-300.0, 300.0), random.between(-300.0, 300.0),
                            ground + random.between(-100.0, 300.0));
        WorldPos to(random.between(-900.0, 900.0), random.between(-900.0, 900.0),
                    ground + random.between(-100.0, 100.0));
        if (i % 5 == 0) {
            const Placed& aim =
                all[i % 2 == 0
                        ? static_cast<std::size_t>(random.below(3))
                        : static_cast<std::size_t>(random.below(static_cast<int>(all.size())))];
            if (aim.origin.head<2>().norm() > 900.0) continue;
            to = from + 1.3 * (aim.origin + Eigen::Vector3d(0.0, 0.0, 0.3) - from);
        }
        const Nearest nearest = find_nearest(all, from, to);
        if (!nearest.is_clear) continue;
        const auto found = picker.ray(from, to, 1.0);
        ASSERT_TRUE(found);
        ASSERT_EQ(found->has_value(), nearest.fraction <= 1.0) << "seed 31, ray " << i;
        ++(*found ? hits[nearest.entry] : misses);
        if (!*found) continue;
        EXPECT_NEAR((*found)->fraction, nearest.fraction, 1e-9);
        EXPECT_EQ((*found)->entry, nearest.entry);
        EXPECT_LE(((*found)->position_world - nearest.origin).norm(), 1e-9);
        EXPECT_EQ((*found)->square.has_value(), nearest.entry >= 3);
        // a limit below the fraction hides it
        const auto before = picker.ray(from, to, 0.999 * nearest.fraction);
        ASSERT_TRUE(before);
        EXPECT_FALSE(before->has_value());
    }
    for (const int of_entry : hits) EXPECT_GT(of_entry, 10);
    EXPECT_GT(misses, 100);
}

TEST(NearGround, LeavesOutNothingThatIsNearTheSurface) {
    const std::shared_ptr<const HeightSource> source = hills();
    test::Random random(32);
    int parts = 0, none = 0, near_points = 0;
    for (int i = 0; i < 300; ++i) {
        const WorldPos from(random.between(-80e3, 80e3), random.between(-80e3, 80e3),
                            random.between(-2000.0, 3000.0));
        const WorldPos to = from + random.between(10.0, 1e5) * random.direction();
        const auto part = near_ground(from, to, *source, 5.0);
        ++(part ? parts : none);
        for (int k = 0; k <= 200; ++k) {
            const double t = k / 200.0;
            const WorldPos p = from + t * (to - from);
            if (!source->extent().contains(p.x(), p.y())) continue;
            if (std::abs(p.z() - source->height(p.x(), p.y())) > 5.0) continue;
            ++near_points;
            ASSERT_TRUE(part) << "seed 32, " << i;
            EXPECT_LE(part->begin, t);
            EXPECT_GE(part->end, t);
        }
    }
    EXPECT_GT(parts, 50);
    EXPECT_GT(none, 50);
    EXPECT_GT(near_points, 20);
    EXPECT_FALSE(near_ground({0, 0, 2000}, {0, 0, 1e5}, *source, 5.0));
    EXPECT_FALSE(near_ground({9e5, 0, 0}, {9e5, 0, -10}, *source, 5.0));
    const auto down = near_ground({0, 0, 2000}, {0, 0, -98'000}, *source, 5.0);
    ASSERT_TRUE(down);
    EXPECT_LE(down->end, 0.05);
}

}  // namespace object_picker_test
}  // namespace terrane::tools
