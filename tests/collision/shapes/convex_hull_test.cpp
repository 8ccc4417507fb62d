// SPDX-License-Identifier: MIT
#include "point_clouds.h"
#include "shapes/polyhedron.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/shapes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace terrane::test {

/// Describes what is wrong with a polyhedron; empty if nothing is. Loops, edges and neighbours must agree; the surface
/// must be closed and satisfy Euler's formula; faces must be flat and convex, and the polyhedron convex.
///
/// @param tolerance metres
std::string find_fault(const internal::Polyhedron& hull, double tolerance);

/// Describes what is wrong with a polyhedron as the hull of points; empty if nothing is. Vertices must be points, bit
/// for bit. No point may be in front of a face, or beyond the hull along any of 500 directions, by more than the
/// tolerance.
std::string find_fault_of_hull(const internal::Polyhedron& hull,
                               std::span<const Eigen::Vector3d> points, double tolerance);

namespace {

using internal::Polyhedron;
using Pair = std::pair<std::uint32_t, std::uint32_t>;

template <class... Parts>
std::string say(const Parts&... parts) {
    std::ostringstream text;
    text.precision(17);
    (text << ... << parts);
    return text.str();
}

std::string find_fault_of_face(const Polyhedron& hull, std::size_t index, double tolerance,
                               std::map<Pair, std::uint32_t>& sides) {
    const Polyhedron::Face& face = hull.faces[index];
    if (face.count < 3) return say("face ", index, " has ", face.count, " corners");
    if (!(std::abs(face.normal.norm() - 1.0) <= 1e-15)) return say("normal of face ", index);
    const auto corner = [&](std::uint32_t i) { return hull.loops[face.first + i % face.count]; };
    Eigen::Vector3d area = Eigen::Vector3d::Zero();
    const double size = (hull.vertices[corner(1)] - hull.vertices[corner(0)]).stableNorm();
    for (std::uint32_t i = 0; i < face.count; ++i) {
        const Eigen::Vector3d& a = hull.vertices[corner(i)];
        const Eigen::Vector3d& b = hull.vertices[corner(i + 1)];
        const Eigen::Vector3d& c = hull.vertices[corner(i + 2)];
        if (!sides.emplace(Pair(corner(i), corner(i + 1)), index).second) {
            return say("side ", corner(i), " ", corner(i + 1), " twice");
        }
        const double above = face.normal.dot(a) - face.offset;
        if (!(above <= 0.0 + 1e-15 * std::abs(face.offset)) || above < -tolerance) {
            return say("vertex ", corner(i), " of face ", index, " lies off it by ", above);
        }
        const double inward = face.normal.dot((c - a).cross(b - a));
        if (inward > tolerance * (c - a).norm()) {
            return say("face ", index, " is dented at vertex ", corner(i + 1), " by ",
                       inward / (c - a).norm());
        }
        const Eigen::Vector3d from_first = a - hull.vertices[corner(0)];
        area += (from_first / size).cross((b - a) / size);
    }
    if (hull.faces.size() > 2 && !(face.normal.dot(area) > 0.0)) {
        return say("face ", index, " is clockwise");
    }
    return {};
}

}  // namespace

std::string find_fault(const Polyhedron& hull, double tolerance) {
    std::map<Pair, std::uint32_t> sides;
    for (std::size_t i = 0; i < hull.faces.size(); ++i) {
        if (std::string fault = find_fault_of_face(hull, i, tolerance, sides); !fault.empty()) {
            return fault;
        }
    }
    const std::size_t count = hull.vertices.size();
    if (hull.faces.size() == 1 || hull.faces.size() == 3) return say(hull.faces.size(), " faces");
    if (hull.faces.size() == 2 && hull.faces[0].normal != -hull.faces[1].normal) return "normals";
    if (hull.faces.empty() && (count > 2 || hull.edges.size() != count - 1)) {
        return say("no face, but ", count, " vertices and ", hull.edges.size(), " edges");
    }
    if (!hull.faces.empty() && sides.size() != 2 * hull.edges.size()) {
        return say(sides.size(), " sides, but ", hull.edges.size(), " edges");
    }
    std::set<Pair> joined;
    Pair last;
    for (const Polyhedron::Edge& edge : hull.edges) {
        const Pair pair(edge.from, edge.to);
        if (edge.from >= edge.to || (!joined.empty() && pair <= last)) return "order of edges";
        last = pair;
        joined.insert(pair);
        joined.insert({edge.to, edge.from});
        if (hull.faces.empty()) continue;
        const auto left = sides.find(pair);
        const auto right = sides.find({edge.to, edge.from});
        if (left == sides.end() || right == sides.end() || left->second != edge.left ||
            right->second != edge.right) {
            return say("faces beside edge ", edge.from, " ", edge.to);
        }
    }
    const auto euler =
        static_cast<long>(count + hull.faces.size()) - static_cast<long>(hull.edges.size());
    if (!hull.faces.empty() && euler != 2) return say("V - E + F is ", euler);

    std::set<Pair> neighbours;
    if (hull.first_neighbour.size() != count + 1) return "size of first_neighbour";
    for (std::uint32_t i = 0; i < count; ++i) {
        for (std::uint32_t k = hull.first_neighbour[i]; k < hull.first_neighbour[i + 1]; ++k) {
            neighbours.insert({i, hull.neighbours[k]});
        }
    }
    if (neighbours != joined) return "neighbours differ from edges";
    return {};
}

std::string find_fault_of_hull(const Polyhedron& hull, std::span<const Eigen::Vector3d> points,
                               double tolerance) {
    for (const Eigen::Vector3d& v : hull.vertices) {
        if (std::find(points.begin(), points.end(), v) == points.end()) {
            return say("vertex ", v.transpose(), " is no point");
        }
    }
    for (std::size_t i = 0; i < hull.faces.size(); ++i) {
        for (const Eigen::Vector3d& p : points) {
            const double above = hull.faces[i].normal.dot(p) - hull.faces[i].offset;
            if (above > tolerance) {
                return say("point ", p.transpose(), " is ", above, " in front of face ", i);
            }
        }
    }
    Random random(17);
    for (int i = 0; i < 500; ++i) {
        Eigen::Vector3d direction = random.direction();
        if (i % 3 == 0 && !hull.faces.empty()) {
            const auto face = static_cast<std::size_t>(
                random.between(0.0, static_cast<double>(hull.faces.size())));
            direction = (hull.faces[face].normal + (i % 2) * 1e-6 * direction).normalized();
        }
        double of_points = -1e300;
        double of_vertices = -1e300;
        for (const Eigen::Vector3d& p : points) of_points = std::max(of_points, direction.dot(p));
        for (const Eigen::Vector3d& v : hull.vertices) {
            of_vertices = std::max(of_vertices, direction.dot(v));
        }
        if (of_points > of_vertices + tolerance) {
            return say("a point reaches ", of_points - of_vertices, " beyond the hull");
        }
    }
    return {};
}

}  // namespace terrane::test

namespace terrane::box_polyhedron_test {

using namespace test;

TEST(BoxPolyhedron, IsTheHullOfItsCorners) {
    internal::BoxStorage storage;
    const internal::Polyhedron box = internal::box_polyhedron({1.0, 0.25, 3.0}, storage);
    EXPECT_EQ(find_fault(box, 0.0), "");
    EXPECT_EQ(find_fault_of_hull(box, storage.vertices, 1e-15), "");
    const ConvexHull hull = ConvexHull::create(storage.vertices).value();
    const internal::Polyhedron& made = internal::polyhedron(hull);
    EXPECT_EQ(made.faces.size(), 6u);
    for (const auto& face : box.faces) {
        EXPECT_TRUE(std::any_of(made.faces.begin(), made.faces.end(), [&](const auto& other) {
            return other.normal == face.normal && other.offset == face.offset;
        }));
    }
}

TEST(BoxPolyhedron, KeepsItsTableWhenItIsFlat) {
    internal::BoxStorage storage;
    for (const Eigen::Vector3d& half : {Eigen::Vector3d(1.0, 0.0, 2.0),
                                        Eigen::Vector3d(0.0, 0.0, 1.0), Eigen::Vector3d(0, 0, 0)}) {
        const internal::Polyhedron box = internal::box_polyhedron(half, storage);
        EXPECT_EQ(box.vertices.size() + box.faces.size() - box.edges.size(), 2u);
        for (const auto& face : box.faces) {
            EXPECT_EQ(face.normal.norm(), 1.0);
            for (const Eigen::Vector3d& v : box.vertices) {
                EXPECT_LE(face.normal.dot(v), face.offset);
            }
            for (std::uint32_t i = 0; i < face.count; ++i) {
                EXPECT_EQ(face.normal.dot(box.vertices[box.loops[face.first + i]]), face.offset);
            }
        }
    }
}

}  // namespace terrane::box_polyhedron_test

namespace terrane::convex_hull_test {

using namespace test;

double extent_of(const Points& points) {
    Eigen::Vector3d low = points[0];
    Eigen::Vector3d high = points[0];
    for (const Eigen::Vector3d& p : points) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    return (high - low).maxCoeff();
}

ConvexHull hull_of(const Points& points) { return ConvexHull::create(points).value(); }

// Checks the contract in shapes.h for a set of points.
void expect_good(const Points& points, const std::string& name) {
    const ConvexHull hull = hull_of(points);
    const internal::Polyhedron& polyhedron = internal::polyhedron(hull);
    double largest = 0.0;
    for (const Eigen::Vector3d& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
    const double tolerance = 1e-9 * extent_of(points) + 2e-15 * largest;
    EXPECT_EQ(find_fault(polyhedron, tolerance), "") << name;
    EXPECT_EQ(find_fault_of_hull(polyhedron, points, tolerance), "") << name;
    for (std::size_t i = 0; i < hull.face_count(); ++i) {
        const internal::Polyhedron::Face& face = polyhedron.faces[i];
        const auto loop = polyhedron.loops.subspan(face.first, face.count);
        EXPECT_TRUE(std::ranges::equal(hull.face(i), loop)) << name;
    }
}

void expect_same_bits(const ConvexHull& first, const ConvexHull& second) {
    const internal::Polyhedron& a = internal::polyhedron(first);
    const internal::Polyhedron& b = internal::polyhedron(second);
    ASSERT_TRUE(std::ranges::equal(a.vertices, b.vertices));
    ASSERT_TRUE(std::ranges::equal(a.loops, b.loops));
    ASSERT_TRUE(std::ranges::equal(a.faces, b.faces, [](const auto& p, const auto& q) {
        return p.normal == q.normal && p.offset == q.offset;
    }));
    ASSERT_EQ(smallest_half_extent(first), smallest_half_extent(second));
}

TEST(ConvexHull, OfABoxHasSixFacesHoweverItIsTurned) {
    SeededRandom random(1);
    const Points corners = stretched(grid(2), {1.0, 2.0, 3.0});
    for (int i = 0; i < 300; ++i) {
        const double scale = i % 3 == 0 ? 1e-3 : i % 3 == 1 ? 1.0 : 1e4;
        const Points turned =
            transformed(corners, scale, random.rotation(), (i % 4) * scale * random.direction());
        const ConvexHull hull = hull_of(turned);
        EXPECT_EQ(hull.vertices().size(), 8u) << i;
        EXPECT_EQ(hull.face_count(), 6u) << i;
        EXPECT_NEAR(smallest_half_extent(hull), 0.5 * scale, 1e-12 * scale) << i;
    }
}

TEST(ConvexHull, OfATurnedGridIsItsBox) {
    SeededRandom random(2);
    for (int n = 2; n <= 10; ++n) {
        const Points points = transformed(grid(n), 0.1, random.rotation(), random.direction());
        const ConvexHull hull = hull_of(points);
        EXPECT_EQ(hull.vertices().size(), 8u) << n;
        EXPECT_EQ(hull.face_count(), 6u) << n;
        expect_good(points, "grid " + std::to_string(n));
    }
}

TEST(ConvexHull, OfOneTwoAndCollinearPoints) {
    SeededRandom random(3);
    for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d a = 10.0 * random.direction();
        const Eigen::Vector3d b = a + 3.0 * random.direction();
        EXPECT_EQ(hull_of({a}).vertices().size(), 1u);
        EXPECT_EQ(hull_of({a, a, a}).vertices().size(), 1u);
        Points line{a, b, b};
        for (int k = 0; k < 50; ++k) line.push_back(a + random.between(0.0, 1.0) * (b - a));
        const ConvexHull hull = hull_of(line);
        ASSERT_EQ(hull.vertices().size(), 2u);
        EXPECT_EQ(hull.face_count(), 0u);
        EXPECT_EQ(smallest_half_extent(hull), 0.0);
        expect_good({a}, "point");
        expect_good(line, "line");
    }
    // Along an axis, with the end points not first in any order.
    expect_good({{0, 0, 0}, {0, 1, 0}, {1e-17, -1, 0}, {-1e-17, 0.5, 0}}, "axis");
}

TEST(ConvexHull, OfCoplanarPointsHasTwoFacesBackToBack) {
    SeededRandom random(4);
    for (int i = 0; i < 200; ++i) {
        Points flat = i % 2 == 0 ? ball(random, 4 + i) : integers(random, 4 + i, 3);
        for (Eigen::Vector3d& p : flat) p.z() = 0.0;
        flat.emplace_back(0.0, 1.0, 0.0);  // never collinear
        flat.emplace_back(1.5, 0.0, 0.0);
        flat.emplace_back(0.0, -0.5, 0.0);
        flat = transformed(flat, 1.0, random.rotation(), random.direction());
        const ConvexHull hull = hull_of(flat);
        ASSERT_EQ(hull.face_count(), 2u);
        const internal::Polyhedron& polyhedron = internal::polyhedron(hull);
        EXPECT_EQ(polyhedron.faces[0].normal, -polyhedron.faces[1].normal);
        EXPECT_EQ(polyhedron.faces[0].count, hull.vertices().size());
        EXPECT_EQ(smallest_half_extent(hull), 0.0);
        expect_good(flat, "flat");
    }
    EXPECT_EQ(hull_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}).vertices().size(), 4u);
    expect_good(polygon(10'000), "polygon");
}

TEST(ConvexHull, KeepsItsPromisesForHardPoints) {
    SeededRandom random(5);
    for (int i = 0; i < 60; ++i) {
        const std::string name = std::to_string(i);
        const Eigen::Matrix3d turn = random.rotation();
        const Eigen::Vector3d far = 9e4 * random.direction();
        const Points cloud = ball(random, 10 + 5 * i);
        const Points round = sphere(random, 4 + 3 * i);
        expect_good(cloud, "ball " + name);
        expect_good(round, "sphere " + name);
        expect_good(transformed(round, 1e4, turn), "10 km " + name);
        expect_good(transformed(round, 1e-3, turn, far), "1 mm far out " + name);
        expect_good(transformed(grid(4), 1e-3, turn, far), "grid far out " + name);
        expect_good(transformed(stretched(cloud, {1, 1e-3, 1e-6}), 1e3, turn), "blade " + name);
        expect_good(transformed(stretched(cloud, {1, 1e-9, 1e-12}), 1.0, turn), "needle " + name);
        expect_good(stretched(cloud, {1, 1e-14, 1e-15}), "line, nearly " + name);
        expect_good(stretched(round, {1e-200, 1e-200, 1e-200}), "tiny " + name);
        expect_good(stretched(round, {1e-310, 1e-310, 1e-310}), "denormal " + name);
        expect_good(integers(random, 5 + i, 2 + i % 3), "integers " + name);
        expect_good(transformed(integers(random, 5 + 4 * i, 2 + i % 5), 0.1, turn),
                    "turned integers " + name);
        expect_good(transformed(prism(8 + 10 * i, 2.0), 1.0, turn), "prism " + name);
        Points twice = cloud;  // and near duplicates
        for (const Eigen::Vector3d& p : cloud) twice.push_back(p + 1e-16 * random.direction());
        for (const Eigen::Vector3d& p : round) twice.push_back(p + 1e-13 * random.direction());
        expect_good(twice, "twice " + name);
        Points cluster = round;  // smooth to within the tolerance, with one distant point
        for (Eigen::Vector3d& p : cluster) {
            p = Eigen::Vector3d(1e-6 * p.x(), 1e-6 * p.y(), 0.0);
            p.z() = -0.5 * (p.x() * p.x() + p.y() * p.y());
        }
        cluster.emplace_back(0.0, 0.3, -1.0);
        expect_good(transformed(cluster, 1.0, turn), "cluster " + name);
    }
}

// Coplanar and collinear to about the tolerance, where every predicate is ill-conditioned.
TEST(ConvexHull, KeepsItsPromisesForPointsThatAreOffByTheTolerance) {
    SeededRandom random(51);
    for (int i = 0; i < 3000; ++i) {
        const Eigen::Matrix3d turn = random.rotation();
        Points points = i % 5 == 0   ? integers(random, 5 + i % 40, 1 + i % 4)
                        : i % 5 == 1 ? prism(8 + i % 50, 0.5)
                        : i % 5 == 2 ? stretched(ball(random, 5 + i % 30), {1, 1, 1e-14})
                        : i % 5 == 3 ? stretched(ball(random, 30), {1, 1e-14, 3e-14})
                                     : stretched(grid(3), {1, 1e-7, 1e-7});
        points = transformed(points, 1.0, i % 2 == 0 ? turn : Eigen::Matrix3d::Identity());
        double largest = 0.0;
        for (const Eigen::Vector3d& p : points) {
            largest = std::max(largest, p.cwiseAbs().maxCoeff());
        }
        const double noise = std::pow(10.0, random.between(-1.5, 1.0)) * 0x1p-48 * largest;
        for (Eigen::Vector3d& p : points) p += random.between(0.0, noise) * random.direction();
        expect_good(points, "noise " + std::to_string(i));
    }
}

TEST(ConvexHull, KeepsWhatIsMoreThanRounding) {
    Points corners = grid(2);
    for (const double lift : {1e-13, 1e-10, 1e-6}) {
        corners[7] = Eigen::Vector3d::Constant(1.0 + lift);
        EXPECT_EQ(hull_of(corners).face_count(), 9u) << lift;
    }
    corners[7] = Eigen::Vector3d::Constant(1.0 + 1e-15);
    EXPECT_EQ(hull_of(corners).face_count(), 6u);
}

TEST(ConvexHull, KeepsItsPromisesForTenThousandPoints) {
    SeededRandom random(6);
    expect_good(sphere(random, 10'000), "sphere");
    expect_good(ball(random, 10'000), "ball");
    expect_good(transformed(prism(10'000, 1.0), 1.0, random.rotation()), "prism");
    expect_good(transformed(grid(22), 1.0, random.rotation()), "grid");
}

TEST(ConvexHull, HasTheFacesThatBruteForceFinds) {
    SeededRandom random(7);
    int solid = 0;
    for (int i = 0; i < 2000; ++i) {
        const Points points = integers(random, 4 + i % 9, 2 + i % 3);
        // All planes through three points with the other points on one side, in exact integers.
        std::vector<std::pair<Eigen::Vector3d, double>> planes;
        for (const Eigen::Vector3d& a : points) {
            for (const Eigen::Vector3d& b : points) {
                for (const Eigen::Vector3d& c : points) {
                    const Eigen::Vector3d n = (b - a).cross(c - a);
                    if (n.isZero()) continue;
                    const bool is_face = std::all_of(points.begin(), points.end(),
                                                     [&](auto& p) { return n.dot(p - a) <= 0.0; });
                    const bool is_new =
                        std::none_of(planes.begin(), planes.end(), [&](auto& plane) {
                            return plane.first.cross(n).isZero() && plane.first.dot(n) > 0.0;
                        });
                    if (is_face && is_new) planes.emplace_back(n, n.dot(a));
                }
            }
        }
        const ConvexHull hull = hull_of(points);
        ASSERT_EQ(hull.face_count(), planes.size()) << i;
        for (const auto& [normal, offset] : planes) {
            const auto& faces = internal::polyhedron(hull).faces;
            EXPECT_TRUE(std::any_of(faces.begin(), faces.end(),
                                    [&, &n = normal, &o = offset](const auto& face) {
                                        return (face.normal - n.normalized()).norm() < 1e-14 &&
                                               std::abs(face.offset - o / n.norm()) < 1e-14;
                                    }))
                << i;
        }
        if (planes.size() > 2) ++solid;
        expect_good(points, "integers " + std::to_string(i));
    }
    EXPECT_GT(solid, 1000);
}

TEST(ConvexHull, HasTheSameBitsForTheSamePointsInAnyOrder) {
    SeededRandom random(8);
    for (int i = 0; i < 40; ++i) {
        Points points = i % 2 == 0 ? ball(random, 300)
                                   : transformed(integers(random, 200, 4), 0.3, random.rotation(),
                                                 random.direction());
        const ConvexHull first = hull_of(points);
        for (std::size_t k = points.size(); k-- > 1;) {
            std::swap(points[k], points[static_cast<std::size_t>(random.below(int(k) + 1))]);
        }
        expect_same_bits(first, hull_of(points));
    }
}

TEST(ConvexHull, OfItsVerticesHasTheSameBits) {
    SeededRandom random(12);
    for (int i = 0; i < 20'000; ++i) {
        Points points = integers(random, 4 + random.below(40), 3);
        if (i % 10 == 0) points = ball(random, 50);
        const double scale = random.between(0.1, 3.0);
        const ConvexHull hull = hull_of(transformed(points, scale, random.rotation()));
        const Points vertices(hull.vertices().begin(), hull.vertices().end());
        SCOPED_TRACE(i);
        ASSERT_NO_FATAL_FAILURE(expect_same_bits(hull, hull_of(vertices)));
    }
}

TEST(ConvexHull, RefusesWhatIsNoSetOfPoints) {
    const double nan = std::nan("");
    const double infinity = std::numeric_limits<double>::infinity();
    const auto message = [](const Points& points) {
        const Result<ConvexHull> hull = ConvexHull::create(points);
        return hull ? std::string() : hull.error().message;
    };
    EXPECT_EQ(message({}), "a convex hull needs 1 to 100000 points, got 0");
    EXPECT_EQ(message(Points(100'001, Eigen::Vector3d::Zero())),
              "a convex hull needs 1 to 100000 points, got 100001");
    EXPECT_EQ(message({{0, 0, 0}, {0, nan, 0}}),
              "coordinates of hull point 1 must be -1e5 to 1e5 m, got y nan");
    EXPECT_EQ(message({{0, 0, -infinity}}),
              "coordinates of hull point 0 must be -1e5 to 1e5 m, got z -inf");
    EXPECT_EQ(message({{100'001.0, 0, 0}}),
              "coordinates of hull point 0 must be -1e5 to 1e5 m, got x 100001");
    EXPECT_EQ(message({{1e5, -1e5, 1e5}}), "");
}

TEST(ConvexHull, CopiesShareWhatWasMadeAndStayWhenMovedFrom) {
    ConvexHull hull = hull_of(grid(2));
    const ConvexHull moved = std::move(hull);
    EXPECT_EQ(hull.vertices().data(), moved.vertices().data());  // NOLINT(bugprone-use-after-move)
}

// Brute force: every face's plane against all vertices, and every pair of edges.
double brute_force_width(const internal::Polyhedron& hull) {
    double least = std::numeric_limits<double>::infinity();
    const auto take = [&](const Eigen::Vector3d& direction) {
        if (direction.norm() < 1e-12) return;
        double low = std::numeric_limits<double>::infinity();
        double high = -low;
        for (const Eigen::Vector3d& v : hull.vertices) {
            low = std::min(low, direction.normalized().dot(v));
            high = std::max(high, direction.normalized().dot(v));
        }
        least = std::min(least, high - low);
    };
    for (const auto& face : hull.faces) take(face.normal);
    for (const auto& a : hull.edges) {
        for (const auto& b : hull.edges) {
            take((hull.vertices[a.to] - hull.vertices[a.from])
                     .cross(hull.vertices[b.to] - hull.vertices[b.from]));
        }
    }
    return least;
}

TEST(SmallestHalfExtent, OfAHullIsThatOfBruteForce) {
    SeededRandom random(9);
    long compared = 0;
    for (int i = 0; i < 300; ++i) {
        Points points = i % 2 == 0 ? ball(random, 4 + i % 20) : integers(random, 4 + i % 20, 3);
        if (i % 3 == 0) points = stretched(points, {1.0, 0.1, 0.01});
        const ConvexHull hull = hull_of(points);
        if (hull.face_count() <= 2) continue;
        ++compared;
        const double expected = brute_force_width(internal::polyhedron(hull));
        EXPECT_NEAR(2.0 * smallest_half_extent(hull), expected, 1e-12) << i;
    }
    EXPECT_GT(compared, 50);
    // A regular tetrahedron is thinnest between two edges.
    const ConvexHull regular = hull_of({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}});
    EXPECT_NEAR(smallest_half_extent(regular), 1.0, 1e-15);
}

TEST(BoundingRadius, OfAHullIsAroundTheBodysOrigin) {
    const ConvexHull hull = hull_of(
        transformed(grid(2), 1.0, Eigen::Matrix3d::Identity(), Eigen::Vector3d(3.0, 4.0, -1.0)));
    EXPECT_DOUBLE_EQ(bounding_radius(hull), std::sqrt(16.0 + 25.0 + 1.0));
    EXPECT_DOUBLE_EQ(support_distance(hull, Eigen::Vector3d::UnitX()), 4.0);
    EXPECT_DOUBLE_EQ(support_distance(hull, -Eigen::Vector3d::UnitX()), -3.0);
    EXPECT_TRUE(hull.validate());
}

}  // namespace terrane::convex_hull_test
