// SPDX-License-Identifier: MIT
//
// Sources: J. Rossignac, P. Borrel. Multi-Resolution 3D Approximations for Rendering Complex Scenes. Modeling in
//          Computer Graphics, 1993 (the vertices in a cell of a grid become one; triangles with corners in fewer than
//          three cells vanish).
//          P. Lindstrom. Out-of-Core Simplification of Large Polygonal Models. SIGGRAPH 2000 (the vertex of a cell is
//          where the quadrics of its triangles are least).
// Deviations: triangles that vanish leave no edges or points. Borders have quadrics of their own, so that they stay in
//             place. Two vertices of a cell that no edges within the cell connect, as at a seam, keep attributes of
//             their own at the same position.
#include "base/vector_math.h"
#include "mesh/simplify_methods.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace terrane::internal {
namespace {

constexpr double kMostCells = 0x1p20;  // along the longest side of the bounding box
// The distance is usually above a quarter of the diagonal of a cell.
constexpr double kDiagonals = 4.0;
// Steps of the search for the number of cells between two powers of two.
constexpr int kSearchSteps = 12;
// Weight of the plane that keeps a border edge in place, as in contractor.cpp.
constexpr double kClusterBorderWeight = 4.0;

class VertexClusters {
public:
    explicit VertexClusters(const SimplifyTask& task) : task_(task) {
        const std::span<const Eigen::Vector3d> places = task.welded.places;
        low_ = high_ = places[task.welded.triangles[0][0]];
        for (const TriangleMesh::Triangle& t : task.welded.triangles) {
            for (const std::uint32_t v : t) {
                low_ = low_.cwiseMin(places[v]);
                high_ = high_.cwiseMax(places[v]);
            }
        }
        longest_ = (high_ - low_).maxCoeff();
    }

    /// Number of cells along the longest side for cells whose diagonal is a distance; at least 1, at most kMostCells.
    double cells_of(double diagonal) const {
        return std::clamp(longest_ * std::sqrt(3.0) / diagonal, 1.0, kMostCells);
    }

    /// Assigns places to cells. Returns the number of triangles between different cells, without duplicates.
    std::size_t set_cells(double cells) {
        side_ = std::max(longest_ / cells, std::numeric_limits<double>::min());
        const std::span<const Eigen::Vector3d> places = task_.welded.places;
        std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
        keys.reserve(places.size());
        for (std::uint32_t v = 0; v < places.size(); ++v) {
            std::uint64_t key = 0;
            for (Eigen::Index axis = 0; axis < 3; ++axis)
                key = key << 21 | static_cast<std::uint64_t>(cell_of(places[v], axis));
            // a locked place is a cluster of its own
            keys.emplace_back(task_.locked[v] != 0 ? std::uint64_t{1} << 63 | v : key, v);
        }
        std::sort(keys.begin(), keys.end());
        cluster_.resize(places.size());
        std::uint32_t count = 0;
        for (std::size_t i = 0; i < keys.size(); ++i) {
            if (i > 0 && keys[i].first != keys[i - 1].first) ++count;
            cluster_[keys[i].second] = count;
        }
        cluster_count_ = count + std::size_t{1};
        find_triangles();
        return left_.size();
    }

    /// Keeps one triangle where cells of any size have none. Returns 1.
    std::size_t keep_first() {
        cluster_count_ = cluster_.size();
        std::iota(cluster_.begin(), cluster_.end(), 0u);
        left_ = {0};
        return left_.size();
    }

    /// The mesh with one position for each cell.
    TriangleMesh mesh() const;

private:
    double cell_of(const Eigen::Vector3d& p, Eigen::Index axis) const {
        // unused places may be outside the box
        return std::clamp(std::floor((p[axis] - low_[axis]) / side_), 0.0, 2.0 * kMostCells - 1.0);
    }

    void find_triangles();
    std::vector<Eigen::Vector3d> best_positions() const;
    std::vector<std::uint32_t> joined_vertices() const;

    const SimplifyTask& task_;
    Eigen::Vector3d low_, high_;          // of the places in use
    double longest_ = 0.0;                // side of the bounding box
    double side_ = 0.0;                   // of a cell
    std::vector<std::uint32_t> cluster_;  // [places]
    std::size_t cluster_count_ = 0;
    std::vector<std::uint32_t> left_;  // triangles, by increasing index
};

// Of triangles between the same three clusters with the same winding, the first one stays.
void VertexClusters::find_triangles() {
    std::vector<std::pair<TriangleMesh::Triangle, std::uint32_t>> triangles;
    for (std::uint32_t i = 0; i < task_.welded.triangles.size(); ++i) {
        TriangleMesh::Triangle t = task_.welded.triangles[i];
        for (std::uint32_t& v : t) v = cluster_[v];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        triangles.emplace_back(t, i);
    }
    std::sort(triangles.begin(), triangles.end());
    left_.clear();
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (i == 0 || triangles[i].first != triangles[i - 1].first)
            left_.push_back(triangles[i].second);
    }
    std::sort(left_.begin(), left_.end());
}

// The minimum of the quadrics of a cluster's triangles and border edges, in the box of its cell.
std::vector<Eigen::Vector3d> VertexClusters::best_positions() const {
    const WeldedMesh& welded = task_.welded;
    std::vector<Quadric> quadrics(cluster_count_);
    std::vector<Eigen::Vector3d> sums(cluster_count_, Eigen::Vector3d::Zero());
    std::vector<std::uint32_t> counts(cluster_count_, 0), members(cluster_count_, 0);
    StarMesh stars(welded.places.size(), welded.triangles);
    std::vector<std::uint8_t> is_used(welded.places.size(), 0);
    for (const TriangleMesh::Triangle& t : welded.triangles) {
        const Corners c = {welded.places[t[0]] - low_, welded.places[t[1]] - low_,
                           welded.places[t[2]] - low_};
        for (const std::uint32_t v : t) is_used[v] = 1;
        const Eigen::Vector3d normal = cross(c[1] - c[0], c[2] - c[0]);
        const double doubled = length(normal);
        if (!(doubled > 0.0)) continue;
        for (const std::uint32_t v : t)
            quadrics[cluster_[v]].add_plane(normal / doubled, c[0], 0.5 * doubled);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t from = t[k], to = t[(k + 1) % 3];
            if (stars.triangle_at(to, from) != kNoTriangle) continue;
            const Eigen::Vector3d edge = c[(k + 1) % 3] - c[k], side = cross(edge, normal);
            const double of_side = length(side);
            for (const std::uint32_t v : {from, to})
                quadrics[cluster_[v]].add_plane(side / of_side, c[k],
                                                kClusterBorderWeight * dot(edge, edge));
        }
    }
    for (std::uint32_t v = 0; v < welded.places.size(); ++v) {
        if (is_used[v] == 0) continue;
        sums[cluster_[v]] += welded.places[v] - low_;
        ++counts[cluster_[v]];
        members[cluster_[v]] = v;
    }
    std::vector<Eigen::Vector3d> positions(cluster_count_, low_);
    for (std::size_t i = 0; i < cluster_count_; ++i) {
        if (counts[i] == 0) continue;
        const Eigen::Vector3d& member = welded.places[members[i]];
        if (counts[i] == 1) {
            positions[i] = member;
            continue;
        }
        Eigen::Vector3d best = quadrics[i].minimum(sums[i] / static_cast<double>(counts[i]));
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
            const double cell = cell_of(member, axis);
            best[axis] = std::clamp(best[axis], cell * side_, (cell + 1.0) * side_);
        }
        positions[i] = low_ + best;
    }
    return positions;
}

// [vertices] the first vertex of those that edges within the cluster connect.
std::vector<std::uint32_t> VertexClusters::joined_vertices() const {
    std::vector<std::uint32_t> parents(task_.mesh.positions.size());
    std::iota(parents.begin(), parents.end(), 0u);
    const auto root_of = [&](std::uint32_t v) {
        while (parents[v] != v) v = parents[v] = parents[parents[v]];
        return v;
    };
    const WeldedMesh& welded = task_.welded;
    for (const TriangleMesh::Triangle& corners : welded.corners) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = corners[k], b = corners[(k + 1) % 3];
            if (cluster_[welded.place_of_vertex[a]] != cluster_[welded.place_of_vertex[b]])
                continue;
            const std::uint32_t root_a = root_of(a), root_b = root_of(b);
            parents[std::max(root_a, root_b)] = std::min(root_a, root_b);
        }
    }
    for (std::uint32_t v = 0; v < parents.size(); ++v) parents[v] = root_of(v);
    return parents;
}

TriangleMesh VertexClusters::mesh() const {
    const std::vector<Eigen::Vector3d> positions = best_positions();
    const std::vector<std::uint32_t> joined = joined_vertices();
    AttributeQuadrics attributes(task_.mesh, task_.settings, task_.welded.corners);
    TriangleMesh mesh = task_.mesh;
    std::vector<std::uint32_t> sizes(joined.size(), 0);
    for (std::uint32_t v = 0; v < joined.size(); ++v) {
        ++sizes[joined[v]];
        if (joined[v] != v) attributes.add(v, joined[v]);
    }
    for (std::uint32_t v = 0; v < joined.size(); ++v) {
        const Eigen::Vector3d& position = positions[cluster_[task_.welded.place_of_vertex[v]]];
        mesh.positions[v] = position;
        if (joined[v] == v && sizes[v] > 1) attributes.move(v, position);
    }
    attributes.write(mesh, task_.settings);
    mesh.triangles.clear();
    for (const std::uint32_t i : left_) {
        const TriangleMesh::Triangle& t = task_.welded.corners[i];
        mesh.triangles.push_back({joined[t[0]], joined[t[1]], joined[t[2]]});
    }
    return without_unused_vertices(mesh);
}

}  // namespace

MethodResult cluster(const SimplifyTask& task, std::size_t triangles, double limit) {
    VertexClusters clusters(task);
    const double least_cells = clusters.cells_of(kDiagonals * limit);
    const auto meets_count = [&](double cells) { return clusters.set_cells(cells) <= triangles; };
    MethodResult made;
    // the most cells that meet the number of triangles, which nearly always grows with them
    double cells = 1.0, most = 2.0;
    while (most < kMostCells && meets_count(most)) {
        cells = most;
        most *= 2.0;
    }
    for (int i = 0; i < kSearchSteps; ++i) {
        const double middle = 0.5 * (cells + most);
        (meets_count(middle) ? cells : most) = middle;
    }
    if (cells < least_cells) {
        cells = least_cells;
        made.stop = SimplifyStop::error_limit;
    }
    std::size_t count = clusters.set_cells(cells);
    // in cells as large as these, all triangles vanish
    while (count == 0 && cells < kMostCells) {
        cells = std::min(1.25 * cells, kMostCells);
        count = clusters.set_cells(cells);
    }
    if (count == 0) count = clusters.keep_first();
    if (count > triangles && made.stop == SimplifyStop::triangle_count)
        made.stop = SimplifyStop::no_contraction;
    made.mesh = clusters.mesh();
    return made;
}

}  // namespace terrane::internal
