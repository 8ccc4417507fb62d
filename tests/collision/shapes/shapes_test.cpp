// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "collision/shapes/point_clouds.h"
#include "shapes/query_shapes.h"
#include "shapes/quickhull.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shapes.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace terrane::rotation_test {

using namespace test;

TEST(MotionAt, AgreesWithTheCLibrary) {
    SeededRandom random(7);
    for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d axis = random.direction();
        const double angle = random.between(0.0, i % 2 == 0 ? 6.3 : 1000.0);
        Motion motion{.start = {}, .rotation_vector = angle * axis};
        const double t = random.between(0.0, 1.0);
        const Eigen::Matrix3d expected =
            Eigen::AngleAxisd(t * motion.rotation_vector.norm(), axis).toRotationMatrix();
        const double rounding = 2e-15 + 3e-16 * angle;
        EXPECT_LE((motion.at(t).rotation - expected).cwiseAbs().maxCoeff(), rounding) << angle;
    }
}

TEST(MotionAt, StaysOrthonormal) {
    SeededRandom random(8);
    for (int i = 0; i < 500; ++i) {
        Motion motion{.start = {.rotation = random.rotation()},
                      .rotation_vector = random.between(0.0, 30.0) * random.direction()};
        const Eigen::Matrix3d r = motion.at(0.7).rotation;
        EXPECT_LE((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-15);
        EXPECT_GT(r.determinant(), 0.0);
    }
}

// Equally accurate near and far from orthonormal matrices: the method changes at 1e-8.
TEST(Orthonormalized, KeepsTheFirstAxisAndThePlaneOfTheSecond) {
    SeededRandom random(11);
    for (const double off : {0.0, 1e-16, 1e-12, 1e-9, 4.9e-9, 5.1e-9, 1e-8, 1e-6, 0.1, 10.0}) {
        for (int i = 0; i < 200; ++i) {
            const Eigen::Matrix3d exact = random.rotation();
            Eigen::Matrix3d skewed = exact;
            for (int column = 0; column < 3; ++column) {
                skewed.col(column) *= 1.0 + random.between(0.0, off);
            }
            skewed.col(1) += random.between(-off, off) * exact.col(0);
            skewed.col(2) += off * random.direction();
            EXPECT_LE((orthonormalized(skewed) - exact).cwiseAbs().maxCoeff(), 2e-15 * (1.0 + off))
                << off;
        }
    }
}

TEST(RotationVectorBetween, IsUndoneByAMotion) {
    SeededRandom random(9);
    for (int i = 0; i < 2000; ++i) {
        const double angle = i % 3 == 0   ? 3.14159265358979
                             : i % 3 == 1 ? 1e-9
                                          : random.between(0.0, 3.14);
        Motion there{.start = {.rotation = random.rotation()},
                     .rotation_vector = angle * random.direction()};
        const Eigen::Matrix3d to = there.at(1.0).rotation;
        Motion again = there;
        again.rotation_vector = rotation_vector_between(there.start.rotation, to);
        EXPECT_LE(again.rotation_vector.norm(), 3.1415926535897936);
        EXPECT_LE((again.at(1.0).rotation - to).cwiseAbs().maxCoeff(), 5e-15);
    }
}

TEST(CheckShape, NamesTheFieldAndTheValue) {
    EXPECT_TRUE(Sphere{0.0}.validate());
    EXPECT_TRUE((Box{{0.0, 1e5, 0.0}}.validate()));
    const Result<void> sphere = Sphere{-1.5}.validate();
    ASSERT_FALSE(sphere);
    EXPECT_EQ(sphere.error().message, "sphere radius must be 0 to 1e5 m, got -1.5");
    EXPECT_FALSE((Capsule{0.5, std::nan("")}.validate()));
    EXPECT_FALSE((Box{{1.0, 1.0, 1e6}}.validate()));
}

TEST(SupportDistance, IsTheLargestOverTheShape) {
    const Eigen::Vector3d n = Eigen::Vector3d(1.0, 2.0, 2.0) / 3.0;
    EXPECT_DOUBLE_EQ(support_distance(Sphere{0.5}, n), 0.5);
    EXPECT_DOUBLE_EQ(support_distance(Capsule{0.5, 3.0}, n), 2.5);
    EXPECT_DOUBLE_EQ(support_distance(Box{{3.0, 1.5, 0.75}}, n), 2.5);
    EXPECT_DOUBLE_EQ(default_contact_tolerance(Sphere{0.05}), 0.005);
    EXPECT_DOUBLE_EQ(default_contact_tolerance(Box{{1.0, 2.0, 3.0}}), 0.01);
}

}  // namespace terrane::rotation_test

namespace terrane::compound_test {

using namespace test;

using Parts = std::vector<CompoundPart>;

Pose random_pose(Random& random) {
    Pose pose{random.rotation(), 3.0 * random.direction()};
    return pose;
}

ConvexShape random_shape(Random& random, int kind) {
    const double size = random.between(0.1, 2.0);
    if (kind == 0) return Sphere{size};
    if (kind == 1) return Capsule{size, random.between(0.0, 2.0)};
    if (kind == 2) return Box{{size, random.between(0.0, 2.0), random.between(0.0, 2.0)}};
    return ConvexHull::create(ball(random, 30)).value();
}

// Dense samples of a shape's surface for brute-force checks.
std::vector<Eigen::Vector3d> sample(const ConvexShape& shape, Random& random) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 20'000; ++i) {
        const Eigen::Vector3d n = random.direction();
        if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
            points.push_back(sphere->radius * n);
        } else if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
            points.emplace_back(capsule->radius * n);
            points.back().z() += n.z() < 0.0 ? -capsule->half_height : capsule->half_height;
        } else if (const Box* box = std::get_if<Box>(&shape)) {
            points.push_back(n.cwiseSign().cwiseProduct(box->half_extents));
        } else {
            const auto vertices = std::get<ConvexHull>(shape).vertices();
            points.push_back(vertices[static_cast<std::size_t>(i) % vertices.size()]);
        }
    }
    return points;
}

TEST(Compound, HasTheBoundsAndReachOfItsPoints) {
    SeededRandom random(21);
    for (int i = 0; i < 40; ++i) {
        Parts parts;
        for (int k = 0; k < 1 + i % 4; ++k) {
            parts.push_back({random_shape(random, (i + k) % 4), random_pose(random)});
        }
        const Compound compound = Compound::create(parts).value();
        ASSERT_EQ(compound.parts().size(), parts.size());
        double radius = 0.0;
        std::vector<Eigen::Vector3d> all;
        for (std::size_t k = 0; k < parts.size(); ++k) {
            Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9);
            Eigen::Vector3d high = -low;
            for (const Eigen::Vector3d& point : sample(parts[k].shape, random)) {
                all.push_back(parts[k].body_from_part * point);
                low = low.cwiseMin(all.back());
                high = high.cwiseMax(all.back());
                radius = std::max(radius, all.back().norm());
            }
            // Bounds contain all samples and exceed them by at most the sample spacing.
            const Aabb& bounds = compound.bounds()[k];
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_LE(bounds.low[axis], low[axis] + 1e-12);
                EXPECT_GE(bounds.low[axis], low[axis] - 2e-3);
                EXPECT_GE(bounds.high[axis], high[axis] - 1e-12);
                EXPECT_LE(bounds.high[axis], high[axis] + 2e-3);
            }
        }
        EXPECT_GE(bounding_radius(compound), radius - 1e-12);
        EXPECT_LE(bounding_radius(compound), radius + 2e-3);
        for (int k = 0; k < 20; ++k) {
            const Eigen::Vector3d direction = random.direction();
            double reach = -1e9;
            for (const Eigen::Vector3d& p : all) reach = std::max(reach, direction.dot(p));
            EXPECT_GE(support_distance(compound, direction), reach - 1e-12);
            EXPECT_LE(support_distance(compound, direction), reach + 2e-3);
        }
    }
}

TEST(Compound, IsAsThinAsItsThinnestPart) {
    const Compound compound =
        Compound::create(Parts{{Box{{1.0, 0.25, 2.0}}, Pose()}, {Sphere{0.5}, Pose()}}).value();
    EXPECT_EQ(smallest_half_extent(compound), 0.25);
    EXPECT_TRUE(compound.validate());
    Compound copy = compound;
    const Compound moved = std::move(copy);
    EXPECT_EQ(copy.parts().size(), moved.parts().size());  // NOLINT(bugprone-use-after-move)
}

std::string message_of(const Parts& parts) {
    const Result<Compound> compound = Compound::create(parts);
    return compound ? std::string() : compound.error().message;
}

TEST(Compound, RefusesPartsThatAreNone) {
    const double nan = std::nan("");
    EXPECT_EQ(message_of({}), "a compound needs 1 to 100000 parts, got 0");
    EXPECT_EQ(message_of({{Sphere{0.0}, Pose()}}), "");
    EXPECT_EQ(message_of({{Sphere{1.0}, Pose()}, {Sphere{-1.0}, Pose()}}),
              "compound part 1: sphere radius must be 0 to 1e5 m, got -1");
    Pose pose;
    pose.translation.y() = nan;
    EXPECT_EQ(message_of({{Sphere{1.0}, pose}}),
              "translation of compound part 0 must be -1e5 to 1e5 m, got y nan");
    pose.translation.y() = -1.0001e5;
    EXPECT_NE(message_of({{Sphere{1.0}, pose}}), "");
    pose = Pose();
    const std::string start =
        "rotation of compound part 0 must be orthonormal to 1e-6 with determinant 1, got ";
    pose.rotation(0, 0) = 1.0 + 1e-5;
    EXPECT_EQ(message_of({{Sphere{1.0}, pose}}), start + "one that is off by 2e-05");
    pose.rotation(0, 0) = 1.0 + 1e-7;
    EXPECT_EQ(message_of({{Sphere{1.0}, pose}}), "");
    pose.rotation(0, 0) = -1.0;
    EXPECT_EQ(message_of({{Sphere{1.0}, pose}}), start + "one that is off by inf");
    for (int entry = 0; entry < 9; ++entry) {
        pose.rotation = Eigen::Matrix3d::Identity();
        pose.rotation(entry / 3, entry % 3) = nan;
        EXPECT_NE(message_of({{Sphere{1.0}, pose}}), "") << entry;
    }
}

TEST(Compound, FromTrianglesIsTheirSurface) {
    SeededRandom random(22);
    const std::vector<Eigen::Vector3d> vertices = ball(random, 50);
    std::vector<std::array<std::uint32_t, 3>> triangles{{3, 3, 3},
                                                        {1, 2, 1}};  // and degenerate directions
    for (std::uint32_t i = 0; i + 2 < vertices.size(); ++i) triangles.push_back({i, i + 2, i + 1});
    const Compound compound = Compound::from_triangles(vertices, triangles).value();
    ASSERT_EQ(compound.parts().size(), triangles.size());
    EXPECT_EQ(smallest_half_extent(compound), 0.0);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const ConvexHull& hull = std::get<ConvexHull>(compound.parts()[i].shape);
        EXPECT_EQ(hull.vertices().size(), i == 0 ? 1u : i == 1 ? 2u : 3u);
        EXPECT_EQ(hull.face_count(), i < 2 ? 0u : 2u);
        for (const std::uint32_t vertex : triangles[i]) {
            EXPECT_TRUE((vertices[vertex] - compound.bounds()[i].low).minCoeff() >= 0.0);
            EXPECT_TRUE((compound.bounds()[i].high - vertices[vertex]).minCoeff() >= 0.0);
        }
    }
}

TEST(Compound, FromTrianglesNamesTheBadOne) {
    const double nan = std::nan("");
    const std::vector<Eigen::Vector3d> vertices{{0, 0, 0}, {1, 0, 0}, {0, nan, 0}};
    using Triangles = std::vector<std::array<std::uint32_t, 3>>;
    const auto message = [&](const Triangles& triangles) {
        const Result<Compound> compound = Compound::from_triangles(vertices, triangles);
        return compound ? std::string() : compound.error().message;
    };
    EXPECT_EQ(message({}), "a compound needs 1 to 100000 triangles, got 0");
    EXPECT_EQ(message({{0, 1, 1}, {0, 3, 1}}), "triangle 1 names vertex 3 of 3");
    EXPECT_EQ(message({{0, 1, 2}}),
              "triangle 0: coordinates of hull point 2 must be -1e5 to 1e5 m, got y nan");
}

}  // namespace terrane::compound_test

namespace terrane::extremes_test {

using namespace test;

// Difficult directions for a hull: orthogonal to faces and edges, exactly and nearly; along axes; degenerate.
std::vector<Eigen::Vector3d> make_directions(const internal::Polyhedron& hull, Random& random,
                                             int count) {
    const double nan = std::nan("");
    const double infinity = std::numeric_limits<double>::infinity();
    std::vector<Eigen::Vector3d> directions{
        {0, 0, 0},        {-0.0, 0, 0},        {1, 0, 0},     {0, -1, 0},
        {0, 0, 1e-320},   {1e-300, 1e-310, 0}, {1e200, 0, 0}, {1e308, 1e308, 0},
        {infinity, 0, 0}, {0, -infinity, 1},   {nan, 0, 0},   {1, nan, 1}};
    const auto draw = [&](std::size_t size) {
        return static_cast<std::size_t>(random.between(0.0, static_cast<double>(size)));
    };
    for (int i = 0; i < count; ++i) {
        Eigen::Vector3d direction = random.direction();
        const double off = std::pow(10.0, random.between(-20.0, 0.0));
        if (i % 4 == 1 && !hull.faces.empty()) {
            direction = hull.faces[draw(hull.faces.size())].normal + off * direction;
        } else if (i % 4 == 2 && !hull.edges.empty()) {
            const auto& edge = hull.edges[draw(hull.edges.size())];
            direction = (hull.vertices[edge.to] - hull.vertices[edge.from]).cross(direction) +
                        off * direction;
        } else if (i % 4 == 3) {
            direction = direction.array().round().matrix() + (i % 8 == 3 ? off : 0.0) * direction;
        }
        directions.push_back(i % 5 == 0 ? 1e3 * direction : direction);
    }
    return directions;
}

// For any number of vertices, including hulls that find_extreme() would scan.
void expect_same_vertex(const Points& points, const std::string& name, int count) {
    SCOPED_TRACE(testing::Message() << name << ", seed " << points.size());
    const Result<ConvexHull> made = ConvexHull::create(points);
    ASSERT_TRUE(made);
    const internal::Polyhedron& hull = internal::polyhedron(*made);
    ASSERT_NE(hull.climb, nullptr) << hull.vertices.size() << " vertices";
    Random random(points.size());
    for (const Eigen::Vector3d& direction : make_directions(hull, random, count)) {
        const std::uint32_t scanned = internal::find_extreme_by_scan(hull.vertices, direction);
        ASSERT_EQ(internal::find_extreme_by_climb(hull.vertices, *hull.climb, direction), scanned)
            << direction.transpose();
        ASSERT_EQ(internal::find_extreme(hull, direction), scanned);
    }
}

TEST(FindExtreme, ByClimbIsTheVertexThatAScanFinds) {
    SeededRandom random(11);
    for (int i = 0; i < 25; ++i) {
        const std::string name = std::to_string(i);
        const Eigen::Matrix3d turn = random.rotation();
        const Points round = sphere(random, 50 + 20 * i);
        const Points column = prism(100 + 30 * i, 2.0);
        const int count = 2000;
        expect_same_vertex(round, "sphere " + name, count);
        expect_same_vertex(transformed(round, 1e4, turn), "10 km " + name, count);
        expect_same_vertex(transformed(round, 1e-3, turn, 9e4 * random.direction()),
                           "1 mm far out " + name, count);
        expect_same_vertex(stretched(round, {1, 1e-5, 1e-9}), "needle " + name, count);
        expect_same_vertex(column, "prism " + name, count);
        expect_same_vertex(transformed(column, 1.0, turn, random.direction()),
                           "turned prism " + name, count);
        expect_same_vertex(polygon(50 + 40 * i), "polygon " + name, count);
        expect_same_vertex(transformed(polygon(50 + 40 * i), 1.0, turn), "turned polygon " + name,
                           count);
        Points rough = transformed(polygon(50 + 40 * i), 1.0, turn);  // nearly flat
        for (Eigen::Vector3d& p : rough) p += random.between(0.0, 2e-15) * random.direction();
        expect_same_vertex(rough, "rough polygon " + name, count);
        Points lens = sphere(random, 400);  // rounded to a grid: many coplanar faces
        for (Eigen::Vector3d& p : lens) p = (6.0 * p).array().round().matrix();
        expect_same_vertex(lens, "lens " + name, count);
        expect_same_vertex(transformed(lens, 0.1, turn), "turned lens " + name, count);
        Points cluster = sphere(random, 300);  // smooth to within rounding, with one distant point
        for (Eigen::Vector3d& p : cluster) p *= 1e-7;
        cluster.emplace_back(0.0, 0.3, -1.0);
        expect_same_vertex(transformed(cluster, 1.0, turn, random.direction()), "cluster " + name,
                           count);
    }
    expect_same_vertex(sphere(random, 10'000), "sphere 10000", 5000);
    expect_same_vertex(prism(10'000, 1.0), "prism 10000", 2000);
}

TEST(FindExtreme, TakesTheLowestIndexOfEqualVertices) {
    internal::BoxStorage storage;
    const internal::Polyhedron box = internal::box_polyhedron({1.0, 2.0, 3.0}, storage);
    EXPECT_EQ(internal::find_extreme(box, {1, 1, 1}), 7u);
    EXPECT_EQ(internal::find_extreme(box, {0, 1, 0}), 2u);
    EXPECT_EQ(internal::find_extreme(box, {0, 0, 0}), 0u);
    EXPECT_EQ(internal::find_extreme(box, {0, 0, std::nan("")}), 0u);
}

}  // namespace terrane::extremes_test

namespace terrane::aabb_tree_test {

using namespace test;

using internal::AabbNode;

std::vector<Aabb> random_bounds(Random& random, std::size_t count) {
    std::vector<Aabb> bounds;
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3d middle = 10.0 * random.direction();
        const Eigen::Vector3d half = random.between(0.0, 1.0) * random.direction().cwiseAbs();
        bounds.push_back({middle - half, middle + half});
        if (i % 3 == 2) bounds.back() = bounds[i / 2];  // ties
    }
    return bounds;
}

std::size_t depth_of(const std::vector<AabbNode>& tree, std::size_t node) {
    if (tree[node].item != AabbNode::kInner) return 1;
    return 1 + std::max(depth_of(tree, node + 1), depth_of(tree, tree[node + 1].end));
}

bool meets(const Aabb& a, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    return (a.low.array() <= high.array()).all() && (a.high.array() >= low.array()).all();
}

TEST(AabbTree, FindsTheBoxesThatBruteForceFinds) {
    SeededRandom random(31);
    for (const std::size_t count : {1u, 2u, 3u, 7u, 64u, 1000u}) {
        const std::vector<Aabb> bounds = random_bounds(random, count);
        const std::vector<AabbNode> tree = internal::make_aabb_tree(bounds);
        EXPECT_EQ(tree.size(), 2 * count - 1);
        EXPECT_EQ(tree[0].end, tree.size());
        for (int i = 0; i < 200; ++i) {
            const Eigen::Vector3d low = 10.0 * random.direction();
            const Eigen::Vector3d high = low + random.between(0.0, 5.0) * Eigen::Vector3d::Ones();
            std::multiset<std::size_t> found, expected;
            internal::visit_leaves(
                tree, [&](const Aabb& box) { return meets(box, low, high); },
                [&](std::uint32_t item) { found.insert(item); });
            for (std::size_t k = 0; k < count; ++k) {
                if (meets(bounds[k], low, high)) expected.insert(k);
            }
            EXPECT_EQ(found, expected) << count << " boxes, box " << i;
        }
    }
}

TEST(AabbTree, IsTheSameHoweverItIsBuilt) {
    SeededRandom random(32);
    for (const std::size_t count : {0u, 1u, 2u, 3u, 5u, 64u, 1000u, 20000u}) {
        std::vector<Aabb> bounds = random_bounds(random, count);
        for (std::size_t i = 0; i < count; ++i) {
            if (i % 7 == 3) bounds[i].low.x() = bounds[i].high.x() = i % 2 == 0 ? 0.0 : -0.0;
            if (i % 11 == 5) bounds[i] = internal::empty_box();
        }
        std::vector<std::uint32_t> order;
        std::vector<AabbNode> expected;
        internal::build_aabb_tree(bounds, order, expected);
        const std::vector<AabbNode> tree = internal::make_aabb_tree(bounds);
        ASSERT_EQ(tree.size(), expected.size());
        for (std::size_t i = 0; i < tree.size(); ++i) {
            ASSERT_EQ(tree[i].item, expected[i].item) << count << " boxes, node " << i;
            ASSERT_EQ(tree[i].end, expected[i].end);
            ASSERT_EQ(tree[i].bounds.low, expected[i].bounds.low);
            ASSERT_EQ(tree[i].bounds.high, expected[i].bounds.high);
        }
    }
}

TEST(AabbTree, HalvesTheCountAtEveryNode) {
    const std::vector<Aabb> same(100'000,
                                 {Eigen::Vector3d::Zero(), Eigen::Vector3d(1.0, 2.0, 3.0)});
    const std::vector<AabbNode> tree = internal::make_aabb_tree(same);
    EXPECT_EQ(depth_of(tree, 0), 18u);
    for (const AabbNode& node : tree) EXPECT_EQ(node.bounds.high.z(), 3.0);
}

}  // namespace terrane::aabb_tree_test

namespace terrane::lattice_test {

using namespace test;

using internal::LatticePoint;

std::int64_t draw(Random& random, double size) {
    return static_cast<std::int64_t>(random.between(-size, size));
}

// Points of all magnitudes that are coplanar to within double precision.
TEST(SideOfPlane, IsExact) {
    SeededRandom random(31);
    int beyond_doubles = 0;
    for (int i = 0; i < 20'000; ++i) {
        const double size = std::ldexp(1.0, 4 + i % 50);
        LatticePoint u{};
        LatticePoint v{};
        LatticePoint a{};
        for (std::size_t k = 0; k < 3; ++k) {
            a[k] = std::int64_t{1} << 59;
            u[k] = draw(random, size);
            v[k] = draw(random, size);
        }
        const std::int64_t s = draw(random, 16.0);
        const std::int64_t t = draw(random, 16.0);
        LatticePoint b = a;
        LatticePoint c = a;
        LatticePoint d = a;
        for (std::size_t k = 0; k < 3; ++k) {
            b[k] += u[k];
            c[k] += v[k];
            d[k] += s * u[k] + t * v[k];
        }
        ASSERT_EQ(internal::side_of_plane(a, b, c, d), 0) << i;
        const Eigen::Vector3d normal = internal::triangle_normal(a, b, c);
        for (std::size_t k = 0; k < 3; ++k) {
            for (const int step : {-1, 1}) {
                LatticePoint off = d;
                off[k] += step;
                const double along = step * normal[static_cast<int>(k)];
                const int expected = along > 0.0 ? 1 : along < 0.0 ? -1 : 0;
                ASSERT_EQ(internal::side_of_plane(a, b, c, off), expected) << i;
                ASSERT_EQ(internal::side_of_plane(a, c, b, off), -expected) << i;
                const double rounded = normal.dot(internal::difference(a, off));
                if ((rounded > 0.0) - (rounded < 0.0) != expected) ++beyond_doubles;
            }
        }
    }
    EXPECT_GT(beyond_doubles, 1000);
}

TEST(Turn, IsExact) {
    const std::int64_t m = std::int64_t{1} << 60;
    EXPECT_EQ(internal::turn({0, 0, 0}, {m, 1, 0}, {m, 1, 5}, 2), 0);
    EXPECT_EQ(internal::turn({0, 0, 0}, {m, m - 1, 0}, {m - 1, m - 2, 0}, 2), -1);
    EXPECT_EQ(internal::turn({0, 0, 0}, {0, m, m - 1}, {0, m - 1, m - 2}, 0), -1);
    EXPECT_EQ(internal::turn({0, 0, 0}, {m - 1, 0, m}, {m - 2, 0, m - 1}, 1), -1);
}

}  // namespace terrane::lattice_test
