// SPDX-License-Identifier: MIT
#include "support/meshes/shapes.h"

#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

namespace terrane::test {

ShapeMesh make_sphere(double radius, int depth) {
    const double g = std::numbers::phi;
    ShapeMesh mesh;
    mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
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
        for (Eigen::Vector3d& v : mesh.vertices) v.normalize();
    }
    for (Eigen::Vector3d& v : mesh.vertices) v *= radius / v.norm();
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
    struct Uses {
        int forward = 0, backward = 0;
    };
    std::map<std::pair<std::uint32_t, std::uint32_t>, Uses> edges;
    std::set<std::uint32_t> vertices;
    for (const auto& t : triangles) {
        vertices.insert(t.begin(), t.end());
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t a = t[i], b = t[(i + 1) % 3];
            if (a < b) {
                ++edges[{a, b}].forward;
            } else {
                ++edges[{b, a}].backward;
            }
        }
    }
    EdgeCounts counts;
    counts.vertices = vertices.size();
    for (const auto& [edge, uses] : edges) {
        if (uses.forward == 1 && uses.backward == 1) {
            ++counts.inner;
        } else if (uses.forward + uses.backward == 1) {
            ++counts.border;
        } else {
            ++counts.other;
        }
    }
    return counts;
}

}  // namespace terrane::test
