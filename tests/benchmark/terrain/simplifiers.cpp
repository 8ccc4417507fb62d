// SPDX-License-Identifier: MIT
//
// Sources: J. Rossignac, P. Borrel. Multi-resolution 3D Approximations for Rendering Complex Scenes. Modeling in
// Computer Graphics, 1993: vertices of one cell of a grid become one. P. Lindstrom. Out-of-Core Simplification of Large
// Polygonal Models. SIGGRAPH 2000: that one is where the quadric of the cell's triangles is least.
// Deviations: the least place is sought within the cell; the number of cells is found by bisection. For comparison
// only.
#include "benchmark/terrain/simplifiers.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <queue>
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

// Source: W. Schroeder, J. Zarge, W. Lorensen. Decimation of Triangle Meshes. SIGGRAPH 1992: a vertex inside a surface
// goes where it is near the average plane of its neighbours, one of a border where it is near the line between its two
// neighbours there; the hole is split along planes orthogonal to the average plane.
// Deviations: the nearest vertex goes first, not all below a threshold, so that a count can be met; no feature edges.
// For comparison only.

namespace {

using test::ShapeMesh;
using Triangle = std::array<std::uint32_t, 3>;

// Least height of a new triangle's loop over its split line, the aspect of the paper.
constexpr double kLeastAspect = 1e-3;

class Decimator {
public:
    explicit Decimator(const ShapeMesh& mesh)
        : vertices_(mesh.vertices), triangles_(mesh.triangles), of_vertex_(mesh.vertices.size()) {
        for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
            for (const std::uint32_t v : triangles_[i]) of_vertex_[v].insert(i);
        }
        left_ = triangles_.size();
        for (std::uint32_t v = 0; v < vertices_.size(); ++v) queue(v);
    }

    ShapeMesh decimate_to(std::size_t count) {
        while (left_ > count && !queue_.empty()) {
            const Entry entry = queue_.top();
            queue_.pop();
            if (entry.version != versions_[entry.vertex]) continue;
            remove(entry.vertex);
        }
        ShapeMesh result;
        result.vertices = vertices_;
        for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
            if (of_vertex_[triangles_[i][0]].contains(i)) result.triangles.push_back(triangles_[i]);
        }
        return result;
    }

private:
    struct Entry {
        double distance = 0.0;
        std::uint32_t vertex = 0;
        std::uint32_t version = 0;
        bool operator<(const Entry& o) const {
            return distance != o.distance ? distance > o.distance : vertex > o.vertex;
        }
    };
    struct Loop {
        std::vector<std::uint32_t> corners;  // counter-clockwise around the vertex
        bool is_closed = false;
    };

    // The vertices around one in order; false where its triangles are not one disk or half disk.
    bool find_loop(std::uint32_t v, Loop& loop) const {
        std::map<std::uint32_t, std::uint32_t> next;
        std::set<std::uint32_t> ends;
        for (const std::uint32_t i : of_vertex_[v]) {
            const Triangle& t = triangles_[i];
            const std::size_t k =
                static_cast<std::size_t>(std::find(t.begin(), t.end(), v) - t.begin());
            if (!next.emplace(t[(k + 1) % 3], t[(k + 2) % 3]).second) return false;
            if (!ends.insert(t[(k + 2) % 3]).second) return false;
        }
        if (next.empty()) return false;
        std::uint32_t at = next.begin()->first;
        std::size_t starts = 0;
        for (const auto& [from, to] : next) {
            if (ends.contains(from)) continue;
            at = from;
            ++starts;
        }
        if (starts > 1) return false;
        loop.is_closed = starts == 0;
        loop.corners = {at};
        for (std::size_t i = 0; i < next.size(); ++i) {
            const auto found = next.find(loop.corners.back());
            if (found == next.end()) return false;
            loop.corners.push_back(found->second);
        }
        if (loop.is_closed && loop.corners.back() != loop.corners.front()) return false;
        if (loop.is_closed) loop.corners.pop_back();
        return loop.corners.size() >= 3;
    }

    Eigen::Vector3d average_normal(std::uint32_t v) const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const std::uint32_t i : of_vertex_[v]) {
            const Triangle& t = triangles_[i];
            sum += (vertices_[t[1]] - vertices_[t[0]]).cross(vertices_[t[2]] - vertices_[t[0]]);
        }
        return sum.stableNormalized();
    }

    void queue(std::uint32_t v) {
        if (versions_.size() < vertices_.size()) versions_.resize(vertices_.size(), 0);
        ++versions_[v];
        Loop loop;
        if (!find_loop(v, loop)) return;
        double distance = 0.0;
        if (loop.is_closed) {
            Eigen::Vector3d middle = Eigen::Vector3d::Zero();
            double weight = 0.0;
            for (const std::uint32_t i : of_vertex_[v]) {
                const Triangle& t = triangles_[i];
                const Eigen::Vector3d &a = vertices_[t[0]], &b = vertices_[t[1]],
                                      &c = vertices_[t[2]];
                const double area = (b - a).cross(c - a).norm();
                middle += area * (a + b + c) / 3.0;
                weight += area;
            }
            if (weight > 0.0)
                distance = std::abs(average_normal(v).dot(vertices_[v] - middle / weight));
        } else {
            const Eigen::Vector3d &a = vertices_[loop.corners.front()],
                                  &b = vertices_[loop.corners.back()];
            const Eigen::Vector3d line = (b - a).stableNormalized();
            distance = (vertices_[v] - a - line * line.dot(vertices_[v] - a)).norm();
        }
        queue_.push({distance, v, versions_[v]});
    }

    // Splits the loop where the line between two corners has all others of either half on its own side of the plane
    // through it, orthogonal to the average plane; the best aspect first.
    bool triangulate(const std::vector<std::uint32_t>& loop, const Eigen::Vector3d& normal,
                     std::vector<Triangle>& made) const {
        const std::size_t n = loop.size();
        if (n == 3) {
            const Eigen::Vector3d& a = vertices_[loop[0]];
            const Eigen::Vector3d area = (vertices_[loop[1]] - a).cross(vertices_[loop[2]] - a);
            if (!(area.dot(normal) > 0.0)) return false;
            made.push_back({loop[0], loop[1], loop[2]});
            return true;
        }
        double best = kLeastAspect;
        std::size_t first = 0, second = 0;
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = i + 2; j < n; ++j) {
                if (i == 0 && j + 1 == n) continue;
                if (has_edge(loop[i], loop[j])) continue;
                const double aspect = aspect_of(loop, i, j, normal);
                if (!(aspect > best)) continue;
                best = aspect;
                first = i;
                second = j;
            }
        }
        if (second == 0) return false;
        const auto at = [&](std::size_t i) {
            return loop.begin() + static_cast<std::ptrdiff_t>(i);
        };
        const std::vector<std::uint32_t> one(at(first), at(second + 1));
        std::vector<std::uint32_t> two(at(second), loop.end());
        two.insert(two.end(), loop.begin(), at(first + 1));
        return triangulate(one, normal, made) && triangulate(two, normal, made);
    }

    double aspect_of(const std::vector<std::uint32_t>& loop, std::size_t i, std::size_t j,
                     const Eigen::Vector3d& normal) const {
        const Eigen::Vector3d line = vertices_[loop[j]] - vertices_[loop[i]];
        const Eigen::Vector3d side = normal.cross(line).stableNormalized();
        double least = line.norm();
        for (std::size_t k = 0; k < loop.size(); ++k) {
            if (k == i || k == j) continue;
            // Counter-clockwise: corners between the two are to the right of the line.
            const double beside = side.dot(vertices_[loop[k]] - vertices_[loop[i]]);
            least = std::min(least, k > i && k < j ? -beside : beside);
        }
        return least / line.norm();
    }

    bool has_edge(std::uint32_t a, std::uint32_t b) const {
        return std::any_of(of_vertex_[a].begin(), of_vertex_[a].end(), [&](std::uint32_t i) {
            const Triangle& t = triangles_[i];
            return t[0] == b || t[1] == b || t[2] == b;
        });
    }

    void remove(std::uint32_t v) {
        Loop loop;
        if (!find_loop(v, loop)) return;
        if (has_edge(loop.corners.front(), loop.corners.back()) && !loop.is_closed) return;
        std::vector<Triangle> made;
        if (!triangulate(loop.corners, average_normal(v), made)) return;
        if (made.size() == 1 && loop.is_closed && has_triangle(made[0], v)) return;
        const std::vector<std::uint32_t> gone(of_vertex_[v].begin(), of_vertex_[v].end());
        for (const std::uint32_t i : gone) {
            for (const std::uint32_t corner : triangles_[i]) of_vertex_[corner].erase(i);
        }
        left_ -= gone.size() - made.size();
        for (std::size_t k = 0; k < made.size(); ++k) {
            triangles_[gone[k]] = made[k];
            for (const std::uint32_t corner : made[k]) of_vertex_[corner].insert(gone[k]);
        }
        ++versions_[v];
        for (const std::uint32_t corner : loop.corners) queue(corner);
    }

    bool has_triangle(const Triangle& t, std::uint32_t not_of) const {
        return std::any_of(of_vertex_[t[0]].begin(), of_vertex_[t[0]].end(), [&](std::uint32_t i) {
            const Triangle& o = triangles_[i];
            const auto has = [&](std::uint32_t v) { return o[0] == v || o[1] == v || o[2] == v; };
            return has(t[1]) && has(t[2]) && !has(not_of);
        });
    }

    std::vector<Eigen::Vector3d> vertices_;
    std::vector<Triangle> triangles_;
    std::vector<std::set<std::uint32_t>> of_vertex_;  // triangles that are left
    std::vector<std::uint32_t> versions_;
    std::priority_queue<Entry> queue_;
    std::size_t left_ = 0;
};

}  // namespace

Simplified run_vertex_decimation(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    Simplified result;
    result.ms = median_ms(runs, [&] { result.mesh = Decimator(mesh).decimate_to(triangles); });
    return result;
}

}  // namespace terrane::bench
