// SPDX-License-Identifier: MIT
#include "base/vector_math.h"

#include <terrane/base/text.h>
#include <terrane/scene/mesh_clusters.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// A triangle as input of split_to_clusters().
struct SplitPoint {
    Eigen::Vector3d place;   ///< its centroid
    Eigen::Vector3d normal;  ///< unit; zero: the triangle has none
    std::uint32_t index = 0;
};

/// Reorders triangles into consecutive clusters of at most `most` triangles that are close in position and normal.
/// Triangles without a normal form separate clusters at the end. Indices ascend within a cluster. Where triangles with
/// equal coordinates are split between clusters, those with lower indices come first.
/// @returns the number of triangles of each cluster
std::vector<std::uint32_t> split_to_clusters(std::span<SplitPoint> points, std::uint32_t most);

// Splits a set of triangles recursively at the median along the axis of largest variance, in the space of positions and
// normals, until the parts are small enough.
//
// Source:    J. Bentley. Multidimensional binary search trees used for associative searching. CACM 18(9), 1975.
// Deviation: normals are three additional coordinates, because clusters are culled by position and normal.

namespace {

// Weight of normals relative to positions; positions are divided by the longest side of the box around the centroids.
constexpr double kNormalWeight = 2.0;

using Coordinates = std::array<double, 6>;

Coordinates coordinates_of(const SplitPoint& point, double scale) {
    const Eigen::Vector3d place = scale * point.place;
    const Eigen::Vector3d normal = kNormalWeight * point.normal;
    return {place[0], place[1], place[2], normal[0], normal[1], normal[2]};
}

std::size_t widest_axis(std::span<const SplitPoint> points, double scale) {
    Coordinates mean{}, variance{};
    const auto count = static_cast<double>(points.size());
    for (const SplitPoint& point : points) {
        const Coordinates at = coordinates_of(point, scale);
        for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += at[i] / count;
    }
    for (const SplitPoint& point : points) {
        const Coordinates at = coordinates_of(point, scale);
        for (std::size_t i = 0; i < mean.size(); ++i)
            variance[i] += (at[i] - mean[i]) * (at[i] - mean[i]);
    }
    return static_cast<std::size_t>(std::max_element(variance.begin(), variance.end()) -
                                    variance.begin());
}

void split(std::span<SplitPoint> points, std::uint32_t most, double scale,
           std::vector<std::uint32_t>& counts_out) {
    if (points.empty()) return;
    if (points.size() <= most) {
        std::sort(points.begin(), points.end(),
                  [](const SplitPoint& a, const SplitPoint& b) { return a.index < b.index; });
        counts_out.push_back(static_cast<std::uint32_t>(points.size()));
        return;
    }
    const std::size_t axis = widest_axis(points, scale);
    std::sort(points.begin(), points.end(), [&](const SplitPoint& a, const SplitPoint& b) {
        const double of_a = coordinates_of(a, scale)[axis], of_b = coordinates_of(b, scale)[axis];
        return of_a != of_b ? of_a < of_b : a.index < b.index;
    });
    const std::size_t half = points.size() / 2;
    split(points.first(half), most, scale, counts_out);
    split(points.subspan(half), most, scale, counts_out);
}

}  // namespace

std::vector<std::uint32_t> split_to_clusters(std::span<SplitPoint> points, std::uint32_t most) {
    std::vector<std::uint32_t> counts;
    if (points.empty()) return counts;
    const auto thin = std::stable_partition(
        points.begin(), points.end(),
        [](const SplitPoint& point) { return point.normal != Eigen::Vector3d::Zero(); });
    Eigen::Vector3d low = points[0].place, high = low;
    for (const SplitPoint& point : points) {
        low = low.cwiseMin(point.place);
        high = high.cwiseMax(point.place);
    }
    const double extent = (high - low).maxCoeff();
    const double scale = extent > 1e-150 ? 1.0 / extent : 0.0;  // finite
    const auto certain = static_cast<std::size_t>(thin - points.begin());
    split(points.first(certain), most, scale, counts);
    split(points.subspan(certain), most, scale, counts);
    return counts;
}

}  // namespace terrane::internal

// Splits a mesh into clusters of triangles, and culls clusters that face away from the eye.
//
// Source:     L. Shirman, S. Abi-Ezzi. The Cone of Normals Technique for Fast Processing of Curved Patches. Computer
//             Graphics Forum 12(3), 1993 (a cone of normals, and a cone of eye positions that see only back faces).
// Deviations: the apex of the cone of eyes is as close to the triangles' planes as possible, on the axis through the
//             cluster's centre. Drawn vertices may be displaced within bounds.
//
// An eye E is behind a triangle with unit normal n and corner a by s = n (a - E). For a point q behind the planes of
// all triangles, s >= n (q - E). As n is within the cone's angle of the axis, s >= x cosine - y sine, where x > 0 and y
// are the components of q - E along the axis and perpendicular to it.
//
// The triple product of the corners relative to E equals s times twice the area A. If vertices are displaced by up to
// e, the product changes by at most e d (p + 3 e), where p is the perimeter, and d is e plus the largest distance of a
// corner from E: each term of the change is a product of three factors: e; an edge or e; a distance from E or e. The
// triple product keeps its sign if s > e d (p + 3 e) / 2A.

namespace terrane {
namespace {

using internal::cross;
using internal::dot;
using internal::length;
using internal::norm1;

// Error of a computed unit normal: 14 roundings of 2^-53 times the product of two sides. That product is at most 2^20
// times twice the area, because thinner triangles get no normal.
constexpr double kThinnest = 0x1p-20;
constexpr double kNormalError = 0x1p-28;
constexpr double kLeastArea = 1e-150;  // its square is a normal floating-point number
// Least cosine of a cone's half angle (87 degrees): a wider cone would hardly ever be culled.
constexpr double kLeastCosine = 0.05;
// Relative rounding of sums of a few products, with a margin.
constexpr double kSums = 0x1p-48;

struct Face {
    std::array<Eigen::Vector3d, 3> corners;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit; zero: unreliable
    double perimeter = 0.0;
    double area = 0.0;  // twice the area
};

Face make_face(std::span<const Eigen::Vector3d> positions, const TriangleMesh::Triangle& t) {
    Face face{.corners = {positions[t[0]], positions[t[1]], positions[t[2]]}};
    const Eigen::Vector3d ab = face.corners[1] - face.corners[0];
    const Eigen::Vector3d ac = face.corners[2] - face.corners[0];
    const Eigen::Vector3d normal = cross(ab, ac);
    face.perimeter = length(ab) + length(ac) + length(face.corners[2] - face.corners[1]);
    face.area = length(normal);
    if (face.area > std::max(kLeastArea, kThinnest * length(ab) * length(ac)))
        face.normal = normal / face.area;
    return face;
}

// Moves the axis towards the farthest normal by decreasing steps (M. Badoiu, K. Clarkson, Smaller core-sets for balls,
// SODA 2003).
Eigen::Vector3d cone_axis(std::span<const Face> faces) {
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    for (const Face& face : faces) axis += face.normal;
    for (int step = 0;; ++step) {
        const double size = length(axis);
        if (!(size > 1e-6)) return Eigen::Vector3d::UnitZ();
        axis /= size;
        if (step == 24) return axis;
        const Face* farthest = &faces[0];
        double least = 2.0;
        for (const Face& face : faces) {
            const double along = dot(face.normal, axis);
            if (along < least) {
                least = along;
                farthest = &face;
            }
        }
        axis += (farthest->normal - axis) / (step + 2.0);
    }
}

void bound_normals(std::span<const Face> faces, MeshCluster& cluster) {
    for (const Face& face : faces) {
        if (face.normal == Eigen::Vector3d::Zero()) return;
    }
    const Eigen::Vector3d axis = cone_axis(faces);
    double cosine = 1.0;
    for (const Face& face : faces) cosine = std::min(cosine, dot(face.normal, axis));
    cosine -= 2.0 * kNormalError;
    if (!(cosine >= kLeastCosine)) return;
    cluster.axis = axis;
    cluster.cosine = cosine;
    cluster.sine = std::sqrt((1.0 - cosine) * (1.0 + cosine)) * (1.0 + kSums);
    cluster.behind = cluster.ahead = -internal::kInfinity;
    const double error =
        4.0 * kNormalError * (cluster.bounds.radius + kSums * norm1(cluster.bounds.centre));
    for (const Face& face : faces) {
        const double along = dot(face.normal, axis);
        const double height = dot(face.normal, face.corners[0] - cluster.bounds.centre);
        // the quotient, rounded upward
        const auto over_along = [&](double number) {
            return number / (along + (number > 0.0 ? -1.0 : 1.0) * 4.0 * kNormalError);
        };
        cluster.behind = std::max(cluster.behind, over_along(error - height));
        cluster.ahead = std::max(cluster.ahead, over_along(error + height));
        cluster.perimeter_over_area = std::max(cluster.perimeter_over_area,
                                               face.perimeter / face.area * (1.0 + kNormalError));
        cluster.one_over_area =
            std::max(cluster.one_over_area, 1.0 / face.area * (1.0 + kNormalError));
    }
}

MeshCluster make_cluster(std::span<const Face> faces, TriangleRun triangles) {
    MeshCluster cluster;
    cluster.triangles = triangles;
    Eigen::Vector3d low = faces[0].corners[0], high = low;
    for (const Face& face : faces) {
        for (const Eigen::Vector3d& p : face.corners) {
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
        }
    }
    cluster.bounds.centre = 0.5 * (low + high);
    for (const Face& face : faces) {
        for (const Eigen::Vector3d& p : face.corners)
            cluster.bounds.radius =
                std::max(cluster.bounds.radius, length(p - cluster.bounds.centre));
    }
    cluster.bounds.radius *= 1.0 + kSums;
    bound_normals(faces, cluster);
    return cluster;
}

Result<void> check_mesh(std::span<const Eigen::Vector3d> positions,
                        std::span<const TriangleMesh::Triangle> triangles,
                        std::uint32_t cluster_size) {
    const auto refuse = [](const std::string& message) {
        return fail(ErrorCode::invalid_argument, message);
    };
    if (cluster_size < 1) return refuse("cluster_size must be at least 1, got 0");
    if (triangles.size() > std::size_t{1} << 31)
        return refuse("a mesh must have at most 2^31 triangles, got " +
                      number_text(triangles.size()));
    for (std::size_t i = 0; i < positions.size(); ++i) {
        for (const double coordinate : {positions[i][0], positions[i][1], positions[i][2]}) {
            if (!(std::abs(coordinate) <= kLargestMeshCoordinate))
                return refuse("coordinates must be within 1e+06 m, got " + number_text(coordinate) +
                              " at vertex " + number_text(i));
        }
    }
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto [a, b, c] = triangles[i];
        const std::uint32_t most = std::max({a, b, c});
        if (most >= positions.size())
            return refuse("triangle " + number_text(i) + " names vertex " + number_text(most) +
                          " of " + number_text(positions.size()));
    }
    return {};
}

}  // namespace

Result<MeshClusters> MeshClusters::create(std::span<const Eigen::Vector3d> positions,
                                          std::span<const TriangleMesh::Triangle> triangles,
                                          std::uint32_t cluster_size) {
    TERRANE_TRY(check_mesh(positions, triangles, cluster_size));
    std::vector<Face> faces;
    std::vector<internal::SplitPoint> points;
    faces.reserve(triangles.size());
    points.reserve(triangles.size());
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        const Face& face = faces.emplace_back(make_face(positions, triangles[i]));
        points.push_back({.place = (face.corners[0] + face.corners[1] + face.corners[2]) / 3.0,
                          .normal = face.normal,
                          .index = i});
    }
    MeshClusters made;
    std::vector<Face> of_cluster;
    for (const std::uint32_t count : internal::split_to_clusters(points, cluster_size)) {
        const auto first = static_cast<std::uint32_t>(made.order_.size());
        of_cluster.clear();
        for (std::uint32_t i = first; i < first + count; ++i) {
            made.order_.push_back(points[i].index);
            of_cluster.push_back(faces[points[i].index]);
        }
        made.clusters_.push_back(make_cluster(of_cluster, {first, count}));
    }
    return made;
}

bool can_face(const MeshCluster& cluster, const FacingView& view) {
    if (cluster.cosine == 0.0) return true;
    if (!(view.vertex_error >= 0.0 && view.angle_error >= 0.0)) return true;
    const Eigen::Vector3d& centre = cluster.bounds.centre;
    // The offset points from the eye to the apex. Mirroring swaps front and back: the axis, and with it the offset,
    // changes sign.
    const double along_axis = view.is_mirrored ? cluster.ahead : -cluster.behind;
    Eigen::Vector3d offset = centre + along_axis * cluster.axis - view.eye_mesh;
    if (view.is_mirrored) offset = -offset;
    const double x = dot(offset, cluster.axis);
    const double y = length(offset - x * cluster.axis);
    const double rounding = kSums * (norm1(centre) + std::abs(along_axis) + norm1(view.eye_mesh));
    const double behind = x * cluster.cosine - y * cluster.sine - rounding;
    const double farthest = length(centre - view.eye_mesh) + cluster.bounds.radius;
    const double error = view.vertex_error + view.angle_error * farthest;
    const double margin = error * (farthest + error) *
                          (cluster.perimeter_over_area + 3.0 * error * cluster.one_over_area);
    // false for NaN
    const bool is_behind_all = x > 0.0 && behind > margin * (1.0 + kNormalError);
    return !is_behind_all;
}

void MeshClusters::find_front_facing(const FacingView& view,
                                     std::vector<TriangleRun>& runs_out) const {
    runs_out.clear();
    for (const MeshCluster& cluster : clusters_) {
        if (!can_face(cluster, view)) continue;
        const auto& [first, count] = cluster.triangles;
        if (!runs_out.empty() && runs_out.back().first + runs_out.back().count == first) {
            runs_out.back().count += count;
        } else {
            runs_out.push_back(cluster.triangles);
        }
    }
}

}  // namespace terrane
