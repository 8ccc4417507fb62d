// SPDX-License-Identifier: MIT
//
// Source: P. Cignoni, C. Rocchini, R. Scopigno. Metro: Measuring Error on Simplified Surfaces. Computer Graphics Forum
// 17(2), 1998: samples of either surface and their nearest points on the other.
#include "surface_measure.h"

#include "base/aabb_tree.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <vector>

namespace terrane::bench {
namespace {

using test::ShapeMesh;
using Triangle = std::array<std::uint32_t, 3>;

// Distances that differ by less than this share are the same: of those triangles the best normal counts.
constexpr double kTie = 1e-6;
constexpr double kFoldedCosine = 1.0 - 5e-9;  // a ten-thousandth of a radian
constexpr double kLeastHeight = 1e-6;         // over the longest edge

struct Nearest {
    double distance = 0.0;
    double cosine = 1.0;  // of the normals
};

Eigen::Vector3d area_vector(const ShapeMesh& mesh, const Triangle& t) {
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

double distance_to_box(const Eigen::Vector3d& p, const Aabb& box) {
    return (box.low - p).cwiseMax(p - box.high).cwiseMax(0.0).norm();
}

// Nearest points of a mesh, found in a tree of boxes.
class SurfaceIndex {
public:
    explicit SurfaceIndex(const ShapeMesh& mesh) : mesh_(mesh) {
        std::vector<Aabb> boxes;
        for (const Triangle& t : mesh.triangles) {
            Aabb box{mesh.vertices[t[0]], mesh.vertices[t[0]]};
            for (const std::uint32_t v : t) {
                box.low = box.low.cwiseMin(mesh.vertices[v]);
                box.high = box.high.cwiseMax(mesh.vertices[v]);
            }
            boxes.push_back(box);
            normals_.push_back(area_vector(mesh, t).stableNormalized());
            size_ = size_.cwiseMax(box.high.cwiseAbs()).cwiseMax(box.low.cwiseAbs());
        }
        tree_ = internal::make_aabb_tree(boxes);
    }

    Nearest nearest(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const {
        const auto bound = [&](const Aabb& box) { return distance_to_box(p, box); };
        double best = std::numeric_limits<double>::infinity();
        internal::visit_leaves_up_to(tree_, best, bound, [&](std::uint32_t i) {
            return best = std::min(best, distance(p, i));
        });
        Nearest result{.distance = best, .cosine = -1.0};
        result.cosine = largest_cosine(p, normal, best * (1.0 + kTie) + 1e-12 * size_.norm());
        return result;
    }

    /// Of the normals of all triangles within a distance; -1 where there is none.
    double largest_cosine(const Eigen::Vector3d& p, const Eigen::Vector3d& normal,
                          double limit) const {
        const auto bound = [&](const Aabb& box) { return distance_to_box(p, box); };
        double largest = -1.0;
        internal::visit_leaves_up_to(tree_, limit, bound, [&](std::uint32_t i) {
            if (distance(p, i) <= limit) largest = std::max(largest, normals_[i].dot(normal));
            return limit;
        });
        return largest;
    }

    const Eigen::Vector3d& normal(std::size_t triangle) const { return normals_[triangle]; }

private:
    double distance(const Eigen::Vector3d& p, std::uint32_t i) const {
        const Triangle& t = mesh_.triangles[i];
        return test::distance_to_triangle(p, mesh_.vertices[t[0]], mesh_.vertices[t[1]],
                                          mesh_.vertices[t[2]]);
    }

    const ShapeMesh& mesh_;
    std::vector<Eigen::Vector3d> normals_;
    std::vector<internal::AabbNode> tree_;
    Eigen::Vector3d size_ = Eigen::Vector3d::Zero();
};

struct Sums {
    double area = 0.0, distance = 0.0, angle = 0.0;
};

// Places of a triangle with equal areas around: the corners of parts x parts of it, moved inside.
void add_samples(const ShapeMesh& from, const SurfaceIndex& index_from, const SurfaceIndex& to,
                 std::size_t samples, SurfaceMeasure& measure, Sums& sums) {
    double whole = 0.0;
    for (const Triangle& t : from.triangles) whole += area_vector(from, t).norm();
    for (std::size_t i = 0; i < from.triangles.size(); ++i) {
        const Triangle& t = from.triangles[i];
        const Eigen::Vector3d &a = from.vertices[t[0]], &b = from.vertices[t[1]],
                              &c = from.vertices[t[2]];
        const double area = area_vector(from, t).norm();
        for (const Eigen::Vector3d& corner : {a, b, c}) {
            const Nearest nearest = to.nearest(corner, index_from.normal(i));
            measure.hausdorff = std::max(measure.hausdorff, nearest.distance);
        }
        const double wanted = area / whole * static_cast<double>(samples);
        const int parts = std::max(1, static_cast<int>(std::sqrt(wanted)));
        const double share = area / (static_cast<double>(parts) * parts);
        const auto add = [&](double u, double v) {
            const Eigen::Vector3d p = a + u * (b - a) + v * (c - a);
            const Nearest nearest = to.nearest(p, index_from.normal(i));
            const double angle =
                std::acos(std::clamp(nearest.cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
            measure.hausdorff = std::max(measure.hausdorff, nearest.distance);
            sums.distance += share * nearest.distance;
            sums.area += share;
            if (!(area > 0.0)) return;
            sums.angle += share * angle;
            measure.max_normal_deg = std::max(measure.max_normal_deg, angle);
        };
        for (int row = 0; row < parts; ++row) {
            for (int column = 0; row + column < parts; ++column) {
                add((column + 1.0 / 3.0) / parts, (row + 1.0 / 3.0) / parts);
                if (row + column + 1 < parts)
                    add((column + 2.0 / 3.0) / parts, (row + 2.0 / 3.0) / parts);
            }
        }
    }
}

std::size_t count_folded(const ShapeMesh& mesh, const SurfaceIndex& index) {
    using Place = std::array<double, 3>;
    const auto place = [&](std::uint32_t v) -> Place {
        return {mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z()};
    };
    std::map<std::pair<Place, Place>, std::vector<std::size_t>> edges;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Place a = place(mesh.triangles[i][k]), b = place(mesh.triangles[i][(k + 1) % 3]);
            edges[std::minmax(a, b)].push_back(i);
        }
    }
    std::size_t count = 0;
    for (const auto& [edge, triangles] : edges) {
        if (triangles.size() != 2) continue;
        count += static_cast<std::size_t>(
            index.normal(triangles[0]).dot(index.normal(triangles[1])) < -kFoldedCosine);
    }
    return count;
}

}  // namespace

SurfaceMeasure measure_surfaces(const ShapeMesh& input, const ShapeMesh& result,
                                std::size_t samples) {
    SurfaceMeasure measure;
    if (input.triangles.empty() || result.triangles.empty()) {
        const bool is_same = input.triangles.size() == result.triangles.size();
        measure.hausdorff = is_same ? 0.0 : std::numeric_limits<double>::infinity();
        return measure;
    }
    const SurfaceIndex of_input(input), of_result(result);
    Sums sums;
    add_samples(input, of_input, of_result, samples, measure, sums);
    add_samples(result, of_result, of_input, samples, measure, sums);
    if (sums.area > 0.0) {
        measure.mean_distance = sums.distance / sums.area;
        measure.mean_normal_deg = sums.angle / sums.area;
    }
    for (std::size_t i = 0; i < result.triangles.size(); ++i) {
        const Triangle& t = result.triangles[i];
        double longest = 0.0;
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
            longest =
                std::max(longest, (result.vertices[t[k]] - result.vertices[t[(k + 1) % 3]]).norm());
            middle += result.vertices[t[k]] / 3.0;
        }
        const double height =
            longest > 0.0 ? 2.0 * area_vector(result, t).norm() / (longest * longest) : 0.0;
        if (!(height >= kLeastHeight)) {
            ++measure.degenerate;
        } else if (of_input.largest_cosine(middle, of_result.normal(i), measure.hausdorff) < 0.0) {
            ++measure.flipped;
        }
    }
    measure.folded = count_folded(result, of_result);
    return measure;
}

}  // namespace terrane::bench
