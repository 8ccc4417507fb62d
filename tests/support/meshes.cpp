// SPDX-License-Identifier: MIT
//
// Source: C. Ericson. Real-Time Collision Detection. 2005, 5.1.5, as the minimum over plane and edges.
#include "support/meshes.h"

#include "support/random.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>

namespace terrane::test {
namespace {

// Golden tests hash these meshes, and the order of Eigen's sums depends on the processor's vector width.
double dot(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}

double length(const Eigen::Vector3d& v) { return std::sqrt(dot(v, v)); }

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b) {
    const Eigen::Vector3d along = b - a;
    const double square = along.squaredNorm();
    const double t = square > 0.0 ? std::clamp((p - a).dot(along) / square, 0.0, 1.0) : 0.0;
    return (p - a - t * along).norm();
}

double farthest(std::span<const Eigen::Vector3d> vertices, const MeshTriangles& from,
                const MeshTriangles& to, int per_edge) {
    // Maximum of minima: the search over triangles ends as soon as the distance is not above the maximum so far.
    double largest = 0.0;
    for (const auto& t : from) {
        std::size_t last = 0;
        for (int i = 0; i <= per_edge; ++i) {
            for (int j = 0; i + j <= per_edge; ++j) {
                const double u = static_cast<double>(i) / per_edge,
                             v = static_cast<double>(j) / per_edge;
                const Eigen::Vector3d p = vertices[t[0]] + u * (vertices[t[1]] - vertices[t[0]]) +
                                          v * (vertices[t[2]] - vertices[t[0]]);
                double smallest = std::numeric_limits<double>::infinity();
                for (std::size_t k = 0; k < to.size() && smallest > largest; ++k) {
                    // Starts with the triangle that ended the search of the previous sample.
                    const std::size_t index = (last + k) % to.size();
                    const auto& o = to[index];
                    const double distance =
                        distance_to_triangle(p, vertices[o[0]], vertices[o[1]], vertices[o[2]]);
                    if (distance >= smallest) continue;
                    smallest = distance;
                    if (smallest <= largest) last = index;
                }
                largest = std::max(largest, smallest);
            }
        }
    }
    return largest;
}

}  // namespace

double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const double edges = std::min(
        {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double doubled = normal.norm();
    // the normal of a needle triangle is dominated by rounding
    const double longest =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    if (!(doubled > 1e-9 * longest)) return edges;
    const bool is_over = normal.dot((b - a).cross(p - a)) >= 0.0 &&
                         normal.dot((c - b).cross(p - b)) >= 0.0 &&
                         normal.dot((a - c).cross(p - c)) >= 0.0;
    return is_over ? std::abs(normal.dot(p - a)) / doubled : edges;
}

double measured_distance(std::span<const Eigen::Vector3d> vertices, const MeshTriangles& a,
                         const MeshTriangles& b, int per_edge) {
    return std::max(farthest(vertices, a, b, per_edge), farthest(vertices, b, a, per_edge));
}

ShapeMesh make_sphere(double radius, int depth) {
    const double g = std::numbers::phi;
    ShapeMesh mesh{.vertices = {{-1, g, 0},
                                {1, g, 0},
                                {-1, -g, 0},
                                {1, -g, 0},
                                {0, -1, g},
                                {0, 1, g},
                                {0, -1, -g},
                                {0, 1, -g},
                                {g, 0, -1},
                                {g, 0, 1},
                                {-g, 0, -1},
                                {-g, 0, 1}},
                   .triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                 {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                 {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                 {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}}};
    for (; depth > 0; --depth) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto key = std::minmax(a, b);
            const auto [it, is_new] = middles.try_emplace(
                {key.first, key.second}, static_cast<std::uint32_t>(mesh.vertices.size()));
            if (is_new) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2.0);
            return it->second;
        };
        MeshTriangles finer;
        for (const auto& t : mesh.triangles) {
            const std::uint32_t a = middle(t[0], t[1]), b = middle(t[1], t[2]),
                                c = middle(t[2], t[0]);
            finer.insert(finer.end(), {{t[0], a, c}, {t[1], b, a}, {t[2], c, b}, {a, b, c}});
        }
        mesh.triangles = std::move(finer);
        for (Eigen::Vector3d& v : mesh.vertices) v /= length(v);
    }
    for (Eigen::Vector3d& v : mesh.vertices) v *= radius / length(v);
    return mesh;
}

ShapeMesh make_grid(int columns, int rows, const std::function<Eigen::Vector3d(int, int)>& place) {
    ShapeMesh mesh;
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column <= columns; ++column)
            mesh.vertices.push_back(place(column, row));
    }
    const auto at = [&](int column, int row) {
        return static_cast<std::uint32_t>(row * (columns + 1) + column);
    };
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const std::uint32_t a = at(column, row), b = at(column + 1, row),
                                c = at(column + 1, row + 1), d = at(column, row + 1);
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
        }
    }
    return mesh;
}

ShapeMesh make_torus(double radius, double tube_radius, int around, int across) {
    ShapeMesh mesh;
    const auto at = [&](int i, int j) {
        return static_cast<std::uint32_t>((i % around) * across + j % across);
    };
    for (int i = 0; i < around; ++i) {
        for (int j = 0; j < across; ++j) {
            const double a = 2.0 * std::numbers::pi * i / around;
            const double b = 2.0 * std::numbers::pi * j / across;
            const double r = radius + tube_radius * std::cos(b);
            mesh.vertices.emplace_back(r * std::cos(a), r * std::sin(a), tube_radius * std::sin(b));
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return mesh;
}

double mean_edge(const ShapeMesh& mesh) {
    double sum = 0.0;
    for (const auto& t : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i)
            sum += (mesh.vertices[t[i]] - mesh.vertices[t[(i + 1) % 3]]).norm();
    }
    return sum / (3.0 * static_cast<double>(mesh.triangles.size()));
}

EdgeCounts count_edges(const MeshTriangles& triangles) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::array<int, 2>> edges;  // by direction
    std::set<std::uint32_t> vertices;
    for (const auto& t : triangles) {
        vertices.insert(t.begin(), t.end());
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t a = t[i], b = t[(i + 1) % 3];
            ++edges[{std::min(a, b), std::max(a, b)}][a < b ? 0 : 1];
        }
    }
    EdgeCounts counts{.vertices = vertices.size()};
    for (const auto& [edge, uses] : edges) {
        const auto [forward, backward] = uses;
        if (forward == 1 && backward == 1) {
            ++counts.inner;
        } else if (forward + backward == 1) {
            ++counts.border;
        } else {
            ++counts.other;
        }
    }
    return counts;
}

namespace {

// A cone or frustum about the z axis, closed at the bottom.
void add_cone(double low, double high, double low_radius, double high_radius, int sides,
              const std::array<std::uint8_t, 4>& colour, TriangleMesh& mesh) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const auto count = static_cast<std::uint32_t>(sides);
    for (std::uint32_t i = 0; i < count; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / count;
        const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0.0);
        mesh.positions.push_back(out * low_radius + Eigen::Vector3d(0, 0, low));
        mesh.positions.push_back(out * high_radius + Eigen::Vector3d(0, 0, high));
    }
    mesh.positions.push_back({0.0, 0.0, low});
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t a = first + 2 * i, b = first + 2 * ((i + 1) % count);
        mesh.triangles.push_back({a, b, b + 1});
        if (high_radius > 0.0) mesh.triangles.push_back({a, b + 1, a + 1});
        mesh.triangles.push_back({first + 2 * count, b, a});
    }
    mesh.colours.resize(mesh.positions.size(), colour);
}

}  // namespace

TriangleMesh make_tree(int sides) {
    TriangleMesh mesh;
    add_cone(0.0, 1.6, 0.22, 0.18, sides, {96, 72, 52, 255}, mesh);
    add_cone(1.2, 4.2, 1.9, 0.0, sides, {52, 84, 40, 255}, mesh);
    add_cone(3.0, 6.2, 1.5, 0.0, sides, {58, 94, 44, 255}, mesh);
    add_cone(4.8, 8.0, 1.0, 0.0, sides, {66, 104, 50, 255}, mesh);
    return mesh;
}

TriangleMesh make_rock(int depth, std::uint64_t seed) {
    const ShapeMesh sphere = make_sphere(0.8, depth);
    TriangleMesh mesh;
    Random random(seed);
    std::vector<Eigen::Vector3d> dents;
    for (int i = 0; i < 12; ++i) dents.push_back(random.direction());
    for (const Eigen::Vector3d& p : sphere.vertices) {
        const Eigen::Vector3d up = p / length(p);
        double radius = 1.0;
        for (const Eigen::Vector3d& dent : dents)
            radius = std::min(radius, 0.82 / std::max(dot(up, dent), 0.5));
        mesh.positions.push_back(radius * p.cwiseProduct(Eigen::Vector3d(1.1, 0.9, 0.75)));
    }
    mesh.triangles.assign(sphere.triangles.begin(), sphere.triangles.end());
    mesh.colours.assign(mesh.positions.size(), {138, 132, 124, 255});
    return mesh;
}

}  // namespace terrane::test
