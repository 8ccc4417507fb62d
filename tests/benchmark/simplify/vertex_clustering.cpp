// SPDX-License-Identifier: MIT
//
// Sources: J. Rossignac, P. Borrel. Multi-resolution 3D Approximations for Rendering Complex Scenes. Modeling in
// Computer Graphics, 1993: vertices of one cell of a grid become one. P. Lindstrom. Out-of-Core Simplification of Large
// Polygonal Models. SIGGRAPH 2000: that one is where the quadric of the cell's triangles is least.
// Deviations: the least place is sought within the cell; the number of cells is found by bisection. For comparison
// only.
#include "simplifiers.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

namespace terrane::bench {
namespace {

using test::ShapeMesh;
using Cell = std::array<int, 3>;
using Triangle = std::array<std::uint32_t, 3>;

// How many times the grid is refined by bisection.
constexpr int kBisections = 24;
// Share of the trace that is added to the quadric's matrix: planes alone leave directions open.
constexpr double kRegularization = 1e-3;

struct Cluster {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0.0;
    std::uint32_t number = 0;
};

struct Grid {
    Eigen::Vector3d low = Eigen::Vector3d::Zero();
    double side = 1.0;

    Cell cell_of(const Eigen::Vector3d& p) const {
        const Eigen::Vector3d at = (p - low) / side;
        return {static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y())),
                static_cast<int>(std::floor(at.z()))};
    }
};

// Triangles of clusters: three different ones, each set of them once.
std::vector<Triangle> clustered(const ShapeMesh& mesh, const Grid& grid,
                                std::map<Cell, Cluster>& clusters_out) {
    std::vector<std::uint32_t> of_vertex;
    for (const Eigen::Vector3d& p : mesh.vertices) {
        const auto number = static_cast<std::uint32_t>(clusters_out.size());
        Cluster& cluster = clusters_out.try_emplace(grid.cell_of(p)).first->second;
        if (cluster.count == 0.0) cluster.number = number;
        cluster.sum += p;
        cluster.count += 1.0;
        of_vertex.push_back(cluster.number);
    }
    std::set<Triangle> seen;
    std::vector<Triangle> triangles;
    for (const Triangle& t : mesh.triangles) {
        Triangle made = {of_vertex[t[0]], of_vertex[t[1]], of_vertex[t[2]]};
        if (made[0] == made[1] || made[1] == made[2] || made[2] == made[0]) continue;
        std::rotate(made.begin(), std::min_element(made.begin(), made.end()), made.end());
        if (seen.insert(made).second) triangles.push_back(made);
    }
    return triangles;
}

void add_quadrics(const ShapeMesh& mesh, const Grid& grid, std::map<Cell, Cluster>& clusters) {
    for (const Triangle& t : mesh.triangles) {
        const Eigen::Vector3d& p = mesh.vertices[t[0]];
        const Eigen::Vector3d normal = (mesh.vertices[t[1]] - p).cross(mesh.vertices[t[2]] - p);
        for (const std::uint32_t v : t) {
            Cluster& cluster = clusters.at(grid.cell_of(mesh.vertices[v]));
            cluster.a += normal * normal.transpose();
            cluster.b += normal * normal.dot(p);
        }
    }
}

ShapeMesh cluster_to(const ShapeMesh& mesh, std::size_t triangles) {
    Grid grid;
    Eigen::Vector3d high = mesh.vertices[0];
    grid.low = high;
    for (const Eigen::Vector3d& p : mesh.vertices) {
        grid.low = grid.low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    const double size = (high - grid.low).maxCoeff();
    double fine = size / std::sqrt(8.0 * static_cast<double>(mesh.triangles.size()) + 64.0);
    double coarse = 2.0 * size;
    for (int i = 0; i < kBisections; ++i) {
        grid.side = std::sqrt(fine * coarse);
        std::map<Cell, Cluster> clusters;
        (clustered(mesh, grid, clusters).size() > triangles ? fine : coarse) = grid.side;
    }
    grid.side = coarse;
    std::map<Cell, Cluster> clusters;
    ShapeMesh result;
    result.triangles = clustered(mesh, grid, clusters);
    add_quadrics(mesh, grid, clusters);
    result.vertices.resize(clusters.size());
    for (auto& [cell, cluster] : clusters) {
        const Eigen::Vector3d mean = cluster.sum / cluster.count;
        const double more = kRegularization * cluster.a.trace();
        const Eigen::Matrix3d a = cluster.a + more * Eigen::Matrix3d::Identity();
        Eigen::Vector3d place = a.ldlt().solve(cluster.b + more * mean);
        if (!place.allFinite() || grid.cell_of(place) != cell) place = mean;
        result.vertices[cluster.number] = place;
    }
    return result;
}

}  // namespace

Simplified run_vertex_clustering(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    Simplified result;
    result.ms = median_ms(runs, [&] { result.mesh = cluster_to(mesh, triangles); });
    return result;
}

}  // namespace terrane::bench
