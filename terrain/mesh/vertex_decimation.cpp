// SPDX-License-Identifier: MIT
//
// Source: W. Schroeder, J. Zarge, W. Lorensen. Decimation of Triangle Meshes. SIGGRAPH 1992: the distance from the mean
//         plane of the neighbours, or from the line between two of them on a border or feature edge; the loop of
//         neighbours is split along the line with the best ratio of distance to length, and each half again.
// Deviations: vertices are removed in the order of their distances, not in passes below a growing limit. Seams of
//             attributes are feature edges. A vertex is deferred if points of the input that have been removed earlier
//             are farther from the new triangles than its own distance, so that errors do not add up unseen. Corners of
//             features are removed when nothing else is left, as if there were no features.
#include "base/vector_math.h"
#include "mesh/simplify_methods.h"

#include <algorithm>
#include <array>
#include <optional>

namespace terrane::internal {
namespace {

// An edge is a feature if the cosine of the angle between the normals of its triangles is below this: 45 degrees.
constexpr double kFeatureCosine = 0.7071;
// As in contractor.cpp: growth of the cost of a deferred vertex, and the share of length in the order on flat parts.
constexpr double kDecimationGrowth = 1.25;
constexpr double kDecimationLengthWeight = 1e-6;
// Least ratio of height to longest edge of a new triangle, unless one that it replaces is worse, and least cosine of
// the angle between its normal and the mean normal of the triangles that it replaces.
constexpr double kLeastDecimatedShape = 0.02;
constexpr double kLeastDecimatedShapeEver = 1e-5;
constexpr double kLeastMeanCosine = 0.2;

double shape_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const Eigen::Vector3d ab = b - a, bc = c - b, ca = a - c;
    return length(cross(ab, ca)) / std::max({dot(ab, ab), dot(bc, bc), dot(ca, ca)});
}

class VertexDecimator {
public:
    explicit VertexDecimator(const SimplifyTask& task)
        : task_(task),
          places_(task.welded.places),
          mesh_(task.welded.places.size(), task.welded.triangles),
          corners_(task.welded.corners),
          points_(task.welded.places, task.welded.triangles),
          queue_(task.welded.places.size()) {}

    SimplifyStop run(std::size_t triangles, double limit);
    TriangleMesh mesh() const;

private:
    enum class Attempt : std::uint8_t { done, refused, deferred };
    /// Part of the neighbours of a vertex, to be triangulated: from one index of the ring to another.
    struct Loop {
        std::size_t first = 0;
        std::size_t count = 0;  // of vertices
        // mean of the triangles between them, unit
        Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    };
    struct Removal {
        double square = 0.0;  // of the distance
        std::array<Loop, 2> loops;
        std::size_t loop_count = 0;
    };

    const Eigen::Vector3d& at(std::size_t i) const { return places_[ring_.vertices[wrapped(i)]]; }
    std::size_t wrapped(std::size_t i) const { return i < ring_.count ? i : i - ring_.count; }

    bool is_sharp(std::uint32_t u, std::size_t spoke) const;
    std::optional<Removal> classify(std::uint32_t u);
    void queue(std::uint32_t u);
    Attempt try_removal(std::uint32_t u, double cost, double limit);
    bool split(const Loop& loop, std::span<const std::size_t> corners);
    bool has_edge(std::uint32_t a, std::uint32_t b) {
        return mesh_.triangle_at(a, b) != kNoTriangle || mesh_.triangle_at(b, a) != kNoTriangle;
    }
    std::uint32_t corner_at(const Loop& loop, std::size_t i) const;

    const SimplifyTask& task_;
    std::span<const Eigen::Vector3d> places_;
    StarMesh mesh_;
    std::vector<TriangleMesh::Triangle> corners_;  // [triangles] vertices
    TrackedPoints points_;
    VertexQueue queue_;
    bool has_features_ = true;
    bool is_any_over_limit_ = false;

    // of one vertex
    Ring ring_;
    double least_shape_ = 0.0;
    std::vector<StarMesh::Triangle> made_places_;
    std::vector<TriangleMesh::Triangle> made_corners_;
    std::vector<TrackedPoints::Target> targets_;
};

// Whether the triangles before and after a spoke have different attributes or directions.
bool VertexDecimator::is_sharp(std::uint32_t u, std::size_t spoke) const {
    const std::size_t before = spoke == 0 ? ring_.count - 1 : spoke - 1;
    const TriangleMesh::Triangle &a = corners_[ring_.triangles[before]],
                                 &b = corners_[ring_.triangles[spoke]];
    const std::size_t of_a = ring_.corners[before], of_b = ring_.corners[spoke];
    if (a[of_a] != b[of_b] || a[(of_a + 2) % 3] != b[(of_b + 1) % 3]) return true;
    if (!has_features_) return false;
    const Eigen::Vector3d &p = places_[u], &q = at(spoke);
    const Eigen::Vector3d first = cross(at(before) - p, q - p),
                          second = cross(q - p, at(spoke + 1) - p);
    return dot(first, second) < kFeatureCosine * length(first) * length(second);
}

// The loops to triangulate if u is removed, and its distance from its neighbours; none if it must stay.
std::optional<VertexDecimator::Removal> VertexDecimator::classify(std::uint32_t u) {
    if (task_.locked[u] != 0 || !mesh_.find_ring(u, ring_) || ring_.count < 3) return std::nullopt;
    const std::size_t triangle_count = ring_.is_closed ? ring_.count : ring_.count - 1;
    std::array<std::size_t, 2> sharp{};
    std::size_t sharp_count = 0;
    for (std::size_t i = ring_.is_closed ? 0 : 1; i < triangle_count; ++i) {
        if (!is_sharp(u, i)) continue;
        if (sharp_count == 2) return std::nullopt;
        sharp[sharp_count++] = i;
    }
    Removal candidate;
    if (ring_.is_closed && sharp_count == 2) {
        const std::size_t across = sharp[1] - sharp[0];
        if (across < 2 || ring_.count - across < 2) return std::nullopt;  // a loop without area
        candidate.loops[0].first = sharp[0];
        candidate.loops[0].count = across + 1;
        candidate.loops[1].first = sharp[1];
        candidate.loops[1].count = ring_.count - across + 1;
        candidate.loop_count = 2;
    } else if (sharp_count == 0) {
        candidate.loops[0].count = ring_.count;
        candidate.loop_count = 1;
    } else {
        return std::nullopt;
    }
    const Eigen::Vector3d& p = places_[u];
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    double area = 0.0, longest = 0.0;
    least_shape_ = kLeastDecimatedShape;
    for (std::size_t k = 0; k < candidate.loop_count; ++k) {
        Loop& loop = candidate.loops[k];
        const bool is_whole = candidate.loop_count == 1 && ring_.is_closed;
        loop.normal = Eigen::Vector3d::Zero();
        for (std::size_t i = 0; i < (is_whole ? loop.count : loop.count - 1); ++i) {
            const Eigen::Vector3d &a = at(wrapped(loop.first + i)),
                                  &b = at(wrapped(loop.first + i) + 1);
            const Eigen::Vector3d normal = cross(a - p, b - p);
            loop.normal += normal;
            area += length(normal);
            middle += length(normal) * (a + b - 2.0 * p) / 3.0;
            longest = std::max(longest, dot(a - p, a - p));
            least_shape_ = std::min(least_shape_, shape_of(p, a, b));
        }
        const double of_normal = length(loop.normal);
        if (!(of_normal > 0.0)) return std::nullopt;
        loop.normal /= of_normal;
    }
    least_shape_ = std::max(least_shape_, kLeastDecimatedShapeEver);
    if (ring_.is_closed && candidate.loop_count == 1) {
        const double distance = dot(candidate.loops[0].normal, middle / area);
        candidate.square = distance * distance;
    } else {
        const std::size_t from = candidate.loops[0].first,
                          to = wrapped(from + candidate.loops[0].count - 1);
        const Eigen::Vector3d along = at(to) - at(from), of_p = p - at(from);
        const double square = dot(along, along);
        if (!(square > 0.0)) return std::nullopt;
        const double t = std::clamp(dot(of_p, along) / square, 0.0, 1.0);
        const Eigen::Vector3d off = of_p - t * along;
        candidate.square = dot(off, off);
    }
    candidate.square += kDecimationLengthWeight * longest;
    return candidate;
}

void VertexDecimator::queue(std::uint32_t u) {
    const std::optional<Removal> candidate = classify(u);
    if (candidate) {
        queue_.set({candidate->square, u, 0});
    } else {
        queue_.erase(u);
    }
}

// The vertex of a loop's corner, in the triangles of the loop's side.
std::uint32_t VertexDecimator::corner_at(const Loop& loop, std::size_t i) const {
    const bool is_last = i + 1 == loop.count;
    const std::size_t triangle = wrapped(loop.first + (is_last ? i - 1 : i));
    // the triangle is (u, vertices[triangle], vertices[triangle + 1])
    return corners_[ring_.triangles[triangle]][(ring_.corners[triangle] + (is_last ? 2u : 1u)) % 3];
}

// Triangulates corners of a loop, indices within it. Returns false if no line splits them.
bool VertexDecimator::split(const Loop& loop, std::span<const std::size_t> corners) {
    const auto place = [&](std::size_t i) -> const Eigen::Vector3d& {
        return at(wrapped(loop.first + corners[i]));
    };
    const std::size_t count = corners.size();
    if (count == 3) {
        const Eigen::Vector3d &a = place(0), &b = place(1), &c = place(2);
        const Eigen::Vector3d normal = cross(b - a, c - a);
        if (!(shape_of(a, b, c) >= least_shape_)) return false;
        if (!(dot(normal, loop.normal) >= kLeastMeanCosine * length(normal))) return false;
        StarMesh::Triangle places;
        TriangleMesh::Triangle vertices;
        for (std::size_t k = 0; k < 3; ++k) {
            places[k] = ring_.vertices[wrapped(loop.first + corners[k])];
            vertices[k] = corner_at(loop, corners[k]);
        }
        targets_.push_back(
            {static_cast<std::uint32_t>(mesh_.triangle_count() + targets_.size()), {a, b, c}});
        made_places_.push_back(places);
        made_corners_.push_back(vertices);
        return true;
    }
    double best = 0.0;
    std::size_t from = 0, to = 0;
    for (std::size_t i = 0; i + 2 < count; ++i) {
        for (std::size_t k = i + 2; k < count && !(i == 0 && k + 1 == count); ++k) {
            const Eigen::Vector3d along = place(k) - place(i), side = cross(loop.normal, along);
            // the corners between i and k are to the right of the line, the others to the left
            double least = kInfinity;
            for (std::size_t j = 0; j < count; ++j) {
                if (j == i || j == k) continue;
                const double left = dot(side, place(j) - place(i));
                least = std::min(least, j > i && j < k ? -left : left);
            }
            // distance over length: `side` is about as long as the line
            const double ratio = least / dot(along, along);
            if (!(ratio > best)) continue;
            if (has_edge(ring_.vertices[wrapped(loop.first + corners[i])],
                         ring_.vertices[wrapped(loop.first + corners[k])]))
                continue;
            best = ratio;
            from = i;
            to = k;
        }
    }
    if (!(best > 0.0)) return false;
    std::vector<std::size_t> right(corners.begin() + static_cast<std::ptrdiff_t>(from),
                                   corners.begin() + static_cast<std::ptrdiff_t>(to) + 1);
    std::vector<std::size_t> left(corners.begin() + static_cast<std::ptrdiff_t>(to), corners.end());
    left.insert(left.end(), corners.begin(),
                corners.begin() + static_cast<std::ptrdiff_t>(from) + 1);
    return split(loop, right) && split(loop, left);
}

VertexDecimator::Attempt VertexDecimator::try_removal(std::uint32_t u, double cost, double limit) {
    const std::optional<Removal> candidate = classify(u);
    if (!candidate) return Attempt::refused;
    made_places_.clear();
    made_corners_.clear();
    targets_.clear();
    if (!ring_.is_closed || candidate->loop_count == 2) {
        const Loop& loop = candidate->loops[0];
        if (has_edge(ring_.vertices[loop.first],
                     ring_.vertices[wrapped(loop.first + loop.count - 1)]))
            return Attempt::refused;
    } else if (ring_.count == 3 &&
               mesh_.has_triangle(ring_.vertices[0], ring_.vertices[1], ring_.vertices[2], u)) {
        return Attempt::refused;
    }
    std::vector<std::size_t> corners;
    for (std::size_t k = 0; k < candidate->loop_count; ++k) {
        corners.clear();
        for (std::size_t i = 0; i < candidate->loops[k].count; ++i) corners.push_back(i);
        if (!split(candidate->loops[k], corners)) return Attempt::refused;
    }
    const std::size_t triangle_count = ring_.is_closed ? ring_.count : ring_.count - 1;
    const std::span<const std::uint32_t> old = std::span(ring_.triangles).first(triangle_count);
    const double error = points_.measure(old, targets_, limit);
    if (error > limit) {
        is_any_over_limit_ = true;
        return Attempt::refused;
    }
    if (error * error > kDecimationGrowth * cost) {
        queue_.set({error * error, u, 0});
        return Attempt::deferred;
    }
    points_.commit();
    queue_.erase(u);
    for (const std::uint32_t triangle : old) mesh_.remove(triangle);
    for (std::size_t i = 0; i < made_places_.size(); ++i) {
        mesh_.add(made_places_[i]);
        corners_.push_back(made_corners_[i]);
    }
    const Ring around = ring_;
    for (std::size_t i = 0; i < around.count; ++i) queue(around.vertices[i]);
    return Attempt::done;
}

SimplifyStop VertexDecimator::run(std::size_t triangles, double limit) {
    for (const bool has_features : {true, false}) {
        has_features_ = has_features;
        for (std::uint32_t u = 0; u < places_.size(); ++u) queue(u);
        while (!queue_.is_empty() && mesh_.alive_count() > triangles) {
            const Candidate next = queue_.first();
            if (try_removal(next.vertex, next.cost, limit) == Attempt::refused)
                queue_.erase(next.vertex);
        }
        if (mesh_.alive_count() <= triangles) return SimplifyStop::triangle_count;
    }
    return is_any_over_limit_ ? SimplifyStop::error_limit : SimplifyStop::no_contraction;
}

TriangleMesh VertexDecimator::mesh() const {
    TriangleMesh mesh = task_.mesh;
    mesh.triangles.clear();
    for (std::size_t i = 0; i < corners_.size(); ++i) {
        if (mesh_.is_alive(i)) mesh.triangles.push_back(corners_[i]);
    }
    return without_unused_vertices(mesh);
}

}  // namespace

MethodResult decimate(const SimplifyTask& task, std::size_t triangles, double limit) {
    VertexDecimator decimator(task);
    const SimplifyStop stop = decimator.run(triangles, limit);
    return {decimator.mesh(), stop};
}

}  // namespace terrane::internal
