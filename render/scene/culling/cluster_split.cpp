// SPDX-License-Identifier: MIT
//
// Halves a set of triangles at the median along the axis of the largest variance, in the space of their places and
// normals, until the halves are small enough.
//
// Source:    J. Bentley. Multidimensional binary search trees used for associative searching. CACM 18(9), 1975.
// Deviation: normals are three more coordinates, because clusters are culled by place and normal.
#include "culling/cluster_split.h"

#include <algorithm>
#include <array>

namespace terrane::internal {
namespace {

// Of the unit of normals over that of places, which is the largest side of the box around a mesh's centroids.
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
