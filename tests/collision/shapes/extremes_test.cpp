// SPDX-License-Identifier: MIT
#include "point_clouds.h"
#include "shapes/query_shapes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace extremes_test {

using test::Points;

// Directions that are hard for a hull: orthogonal to faces and edges, nearly so, along axes, degenerate.
std::vector<Eigen::Vector3d> make_directions(const internal::Polyhedron& hull, test::Random& random,
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

// For any number of vertices, also where find_extreme() would scan.
void expect_same_vertex(const Points& points, const std::string& name, int count) {
    SCOPED_TRACE(testing::Message() << name << ", seed " << points.size());
    const Result<ConvexHull> made = ConvexHull::create(points);
    ASSERT_TRUE(made);
    const internal::Polyhedron& hull = internal::polyhedron(*made);
    ASSERT_NE(hull.climb, nullptr) << hull.vertices.size() << " vertices";
    test::Random random(points.size());
    for (const Eigen::Vector3d& direction : make_directions(hull, random, count)) {
        const std::uint32_t scanned = internal::find_extreme_by_scan(hull.vertices, direction);
        ASSERT_EQ(internal::find_extreme_by_climb(hull.vertices, *hull.climb, direction), scanned)
            << direction.transpose();
        ASSERT_EQ(internal::find_extreme(hull, direction), scanned);
    }
}

TEST(FindExtreme, ByClimbIsTheVertexThatAScanFinds) {
    SCOPED_TRACE("seed 11");
    test::Random random(11);
    for (int i = 0; i < 25; ++i) {
        const std::string name = std::to_string(i);
        const Eigen::Matrix3d turn = random.rotation();
        const Points round = test::sphere(random, 50 + 20 * i);
        const Points prism = test::prism(100 + 30 * i, 2.0);
        const int count = 2000;
        expect_same_vertex(round, "sphere " + name, count);
        expect_same_vertex(test::transformed(round, 1e4, turn), "10 km " + name, count);
        expect_same_vertex(test::transformed(round, 1e-3, turn, 9e4 * random.direction()),
                           "1 mm far out " + name, count);
        expect_same_vertex(test::stretched(round, {1, 1e-5, 1e-9}), "needle " + name, count);
        expect_same_vertex(prism, "prism " + name, count);
        expect_same_vertex(test::transformed(prism, 1.0, turn, random.direction()),
                           "turned prism " + name, count);
        expect_same_vertex(test::polygon(50 + 40 * i), "polygon " + name, count);
        expect_same_vertex(test::transformed(test::polygon(50 + 40 * i), 1.0, turn),
                           "turned polygon " + name, count);
        Points rough = test::transformed(test::polygon(50 + 40 * i), 1.0, turn);  // but flat
        for (Eigen::Vector3d& p : rough) p += random.between(0.0, 2e-15) * random.direction();
        expect_same_vertex(rough, "rough polygon " + name, count);
        Points lens = test::sphere(random, 400);  // many coplanar faces: a grid on a ball
        for (Eigen::Vector3d& p : lens) p = (6.0 * p).array().round().matrix();
        expect_same_vertex(lens, "lens " + name, count);
        expect_same_vertex(test::transformed(lens, 0.1, turn), "turned lens " + name, count);
        Points cluster =
            test::sphere(random, 300);  // smooth within rounding, with one distant point
        for (Eigen::Vector3d& p : cluster) p *= 1e-7;
        cluster.emplace_back(0.0, 0.3, -1.0);
        expect_same_vertex(test::transformed(cluster, 1.0, turn, random.direction()),
                           "cluster " + name, count);
    }
    expect_same_vertex(test::sphere(random, 10'000), "sphere 10000", 5000);
    expect_same_vertex(test::prism(10'000, 1.0), "prism 10000", 2000);
}

TEST(FindExtreme, TakesTheLowestIndexOfEqualVertices) {
    internal::BoxStorage storage;
    const internal::Polyhedron box = internal::box_polyhedron({1.0, 2.0, 3.0}, storage);
    EXPECT_EQ(internal::find_extreme(box, {1, 1, 1}), 7u);
    EXPECT_EQ(internal::find_extreme(box, {0, 1, 0}), 2u);
    EXPECT_EQ(internal::find_extreme(box, {0, 0, 0}), 0u);
    EXPECT_EQ(internal::find_extreme(box, {0, 0, std::nan("")}), 0u);
}

}  // namespace extremes_test
}  // namespace terrane
