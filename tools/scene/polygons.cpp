// SPDX-License-Identifier: MIT
//
// Polygons of mesh files as triangles: ear clipping in the plane of two coordinate axes.
//
// Source:    G. Meisters. Polygons have ears. American Mathematical Monthly 82(6), 1975; C. Ericson. Real-time
//            collision detection. 2005, section 12.5.1.
// Certainty: clipping corners one by one splits the boundary of a polygon into the boundaries of its triangles.
//            Therefore as many triangles cover a point as the polygon winds around it, if no triangle is clockwise.
//            A polygon that does not cross itself, although it may touch itself, winds around its inside once, so that
//            any split without a clockwise triangle is right. The search for ears only has to avoid a dead end.
#include "scene/mesh_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

using FlatPoint = std::array<double, 2>;

// Ear clipping takes a time of O(n^2), and more for some polygons.
constexpr std::size_t kMostEarCorners = 8192;

/// Twice the area of the triangle a, b, c: positive if it is counter-clockwise.
double turn(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Normal of the plane of a polygon: the vector of its area (Newell). If the areas on both sides cancel out, as of a
/// bow tie, the normal of the largest triangle of the fan.
Eigen::Vector3d normal_of(std::span<const Eigen::Vector3d> points) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), largest = sum;
    double all = 0.0;
    for (std::size_t i = 2; i < points.size(); ++i) {
        const Eigen::Vector3d area = (points[i - 1] - points[0]).cross(points[i] - points[0]);
        sum += area;
        all += area.norm();
        if (area.squaredNorm() > largest.squaredNorm()) largest = area;
    }
    return sum.norm() > 1e-9 * all ? sum : largest;
}

/// The points without the coordinate along which the normal is largest; counter-clockwise seen against the normal.
std::vector<FlatPoint> to_plane(std::span<const Eigen::Vector3d> points) {
    const Eigen::Vector3d normal = normal_of(points);
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0.0) std::swap(u, v);
    std::vector<FlatPoint> flat;
    flat.reserve(points.size());
    for (const Eigen::Vector3d& p : points) flat.push_back({p[u], p[v]});
    return flat;
}

/// Whether the fan around corner 0 is a triangulation: seen from there, the corners are in order of their direction,
/// over at most half a turn.
bool is_fan(std::span<const FlatPoint> points) {
    for (std::size_t i = 2; i < points.size(); ++i) {
        if (!(turn(points[0], points[i - 1], points[i]) > 0.0)) return false;
        if (!(turn(points[0], points[1], points[i]) >= 0.0)) return false;
    }
    return true;
}

class EarClipper {
public:
    explicit EarClipper(std::vector<FlatPoint> points)
        : points_(std::move(points)), next_(points_.size()), previous_(points_.size()) {
        const auto count = static_cast<std::uint32_t>(points_.size());
        for (std::uint32_t i = 0; i < count; ++i) {
            next_[i] = (i + 1) % count;
            previous_[i] = (i + count - 1) % count;
        }
    }

    /// Whether two sides pass through each other.
    bool crosses() const {
        const auto passes = [&](std::size_t i, std::size_t j) {
            const FlatPoint &a = points_[i], &b = points_[next_[i]];
            return turn(a, b, points_[j]) * turn(a, b, points_[next_[j]]) < 0.0;
        };
        for (std::size_t i = 0; i < points_.size(); ++i) {
            for (std::size_t j = 0; j < i; ++j) {
                if (passes(i, j) && passes(j, i)) return true;
            }
        }
        return false;
    }

    /// Adds the triangles. False if one of them had to be clockwise.
    bool clip(std::vector<TriangleMesh::Triangle>& triangles) {
        std::uint32_t at = 0;
        bool is_good = true;
        for (std::size_t left = points_.size(); left > 2; --left) {
            at = find_corner(at, left, is_good);
            triangles.push_back({previous_[at], at, next_[at]});
            next_[previous_[at]] = next_[at];
            previous_[next_[at]] = previous_[at];
            // the corner after the next one keeps triangles from becoming a fan of slivers
            at = next_[next_[at]];
        }
        return is_good;
    }

private:
    double turn_at(std::uint32_t i) const {
        return turn(points_[previous_[i]], points_[i], points_[next_[i]]);
    }

    /// Whether the sides at a corner lie on each other, or one has no length: it encloses nothing.
    bool is_spike(std::uint32_t i) const {
        const FlatPoint &a = points_[previous_[i]], &b = points_[i], &c = points_[next_[i]];
        return turn_at(i) == 0.0 &&
               (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]) >= 0.0;
    }

    /// The next corner to be clipped: a spike; else an ear; else one between two sides on a line, which would leave its
    /// point on another triangle's side; else one that is not clockwise.
    std::uint32_t find_corner(std::uint32_t from, std::size_t left, bool& is_good) const {
        const auto find = [&](const auto& wanted) {
            std::uint32_t at = from;
            for (std::size_t i = 0; i < left; ++i, at = next_[at]) {
                if (wanted(at)) return std::optional(at);
            }
            return std::optional<std::uint32_t>();
        };
        auto found = find([&](std::uint32_t i) { return is_spike(i); });
        if (!found) found = find([&](std::uint32_t i) { return turn_at(i) > 0.0 && is_ear(i); });
        if (!found) found = find([&](std::uint32_t i) { return turn_at(i) == 0.0; });
        if (!found) found = find([&](std::uint32_t i) { return turn_at(i) > 0.0; });
        is_good = is_good && found;
        return found.value_or(from);
    }

    bool is_ear(std::uint32_t i) const {
        const std::array<std::uint32_t, 3> ear = {previous_[i], i, next_[i]};
        for (std::uint32_t other = next_[ear[2]]; other != ear[0]; other = next_[other]) {
            const auto same = std::ranges::find_if(
                ear, [&](std::uint32_t corner) { return points_[corner] == points_[other]; });
            if (same == ear.end()) {
                if (is_inside(ear, points_[other])) return false;
                continue;
            }
            // the polygon touches itself at a corner of the ear: its sides there must stay outside
            for (const std::uint32_t end : {previous_[other], next_[other]}) {
                const auto k = static_cast<std::size_t>(same - ear.begin());
                const FlatPoint &a = points_[ear[k]], &b = points_[ear[(k + 1) % 3]],
                                &c = points_[ear[(k + 2) % 3]];
                if (turn(a, b, points_[end]) > 0.0 && turn(c, a, points_[end]) > 0.0) return false;
            }
        }
        return true;
    }

    bool is_inside(const std::array<std::uint32_t, 3>& ear, const FlatPoint& p) const {
        const FlatPoint &a = points_[ear[0]], &b = points_[ear[1]], &c = points_[ear[2]];
        return turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    }

    std::vector<FlatPoint> points_;
    std::vector<std::uint32_t> next_, previous_;
};

}  // namespace

Result<void> split_polygon(std::span<const std::int64_t> corners, FileMesh& mesh,
                           std::vector<TriangleMesh::Triangle>& triangles_out) {
    triangles_out.clear();
    if (corners.size() < 3) {
        return fail(ErrorCode::bad_data,
                    fmt::format("a face has {} corners, fewer than 3", corners.size()));
    }
    const auto point_count = static_cast<std::int64_t>(mesh.positions.size());
    for (const std::int64_t corner : corners) {
        if (corner >= 0 && corner < point_count) continue;
        return fail(ErrorCode::bad_data,
                    fmt::format("a face names point {} of {}", corner, point_count));
    }
    if (corners.size() - 2 > kMostMeshParts - mesh.triangles.size()) {
        return fail(ErrorCode::bad_data,
                    fmt::format("it has more than {} triangles", kMostMeshParts));
    }
    if (corners.size() == 3) {
        triangles_out.push_back({0, 1, 2});
        return {};
    }
    std::vector<Eigen::Vector3d> points;
    points.reserve(corners.size());
    for (const std::int64_t corner : corners)
        points.push_back(mesh.positions[static_cast<std::size_t>(corner)]);
    std::vector<FlatPoint> flat = to_plane(points);
    if (is_fan(flat)) {
        for (std::uint32_t i = 2; i < corners.size(); ++i) triangles_out.push_back({0, i - 1, i});
        return {};
    }
    if (corners.size() > kMostEarCorners) {
        return fail(ErrorCode::bad_data,
                    fmt::format("a face that is not convex has {} corners, more than {}",
                                corners.size(), kMostEarCorners));
    }
    EarClipper clipper(std::move(flat));
    const bool crosses = clipper.crosses();
    if (!clipper.clip(triangles_out) || crosses) ++mesh.left_out.crossing_faces;
    return {};
}

}  // namespace terrane::tools
