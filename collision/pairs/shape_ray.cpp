// SPDX-License-Identifier: MIT
//
// Sources: C. Ericson. Real-time collision detection. 2005, section 5.3 (rays against spheres and capsules).
//          M. Cyrus, J. Beck. Generalized two- and three-dimensional clipping. 1978 (a ray clipped by half-spaces).
#include "base/vector_math.h"
#include "pairs/compound_pairs.h"
#include "pairs/convex_core.h"
#include "pairs/convex_pairs.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// The interval of a segment inside half-spaces (Cyrus-Beck clipping).
struct Clip {
    double first = 0.0;
    double last = 1.0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of the entry plane; 0: starts inside

    /// Clips by the half-space below a plane. False if nothing is left.
    /// @param height of the start above the plane
    /// @param rate   change of the height over the segment
    bool cut(const Eigen::Vector3d& n, double height, double rate) {
        if (rate == 0.0) return height <= 0.0;
        const double t = -height / rate;
        if (rate > 0.0) {
            last = std::min(last, t);
        } else if (t > first || (t == first && dot(normal, normal) == 0.0 && height >= 0.0)) {
            first = std::max(first, t);
            normal = n;
        }
        return first <= last;
    }
};

// Unit vector against the ray; z for a ray without length.
Eigen::Vector3d against(const Eigen::Vector3d& displacement) {
    const double size = length(displacement);
    return size > 0.0 ? Eigen::Vector3d(-displacement / size)
                      : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

ConvexRay enter(const Clip& clip, const Eigen::Vector3d& displacement) {
    const bool is_within = dot(clip.normal, clip.normal) == 0.0;
    return {true, clip.first, is_within ? against(displacement) : clip.normal};
}

// First point of a segment inside or on a ball.
ConvexRay enter_sphere(const Eigen::Vector3d& centre, double radius, const Eigen::Vector3d& from,
                       const Eigen::Vector3d& displacement) {
    const Eigen::Vector3d d = from - centre;
    const double square = dot(displacement, displacement);
    if (dot(d, d) <= radius * radius) return {true, 0.0, against(displacement)};
    if (square == 0.0) return {};
    // Measures from the foot of the perpendicular, so that distant starts cause no cancellation.
    const double foot = -dot(d, displacement) / square;
    const Eigen::Vector3d nearest = d + foot * displacement;
    const double square_half_chord = radius * radius - dot(nearest, nearest);
    if (square_half_chord < -1e-15 * radius * radius || (square_half_chord < 0.0 && radius == 0.0))
        return {};
    const double t = foot - std::sqrt(std::max(0.0, square_half_chord) / square);
    if (t < 0.0 || t > 1.0) return {};
    const Eigen::Vector3d n = d + t * displacement;
    const double size = length(n);
    return {true, t, size > 0.0 ? Eigen::Vector3d(n / size) : against(displacement)};
}

ConvexRay cast_at(const PlacedSphere& sphere, const Eigen::Vector3d& from,
                  const Eigen::Vector3d& displacement) {
    return enter_sphere(sphere.centre, sphere.radius, from, displacement);
}

void keep_nearer(const ConvexRay& ray, ConvexRay& best) {
    if (ray.hit && (!best.hit || ray.fraction < best.fraction)) best = ray;
}

ConvexRay cast_at(const PlacedCapsule& capsule, const Eigen::Vector3d& from,
                  const Eigen::Vector3d& displacement) {
    const Eigen::Vector3d low = capsule.centre - capsule.half_axis;
    const Eigen::Vector3d high = capsule.centre + capsule.half_axis;
    ConvexRay best = enter_sphere(low, capsule.radius, from, displacement);
    keep_nearer(enter_sphere(high, capsule.radius, from, displacement), best);
    const double half = length(capsule.half_axis);
    if (half == 0.0) return best;
    // Cylinder: a ray against a disc in the plane orthogonal to the axis.
    const Eigen::Vector3d axis = capsule.half_axis / half;
    const Eigen::Vector3d d = from - capsule.centre;
    const double along = dot(d, axis);
    const double rate = dot(displacement, axis);
    const auto is_beside = [&](double t) { return std::abs(along + t * rate) <= half; };
    ConvexRay side = enter_sphere(Eigen::Vector3d::Zero(), capsule.radius, d - along * axis,
                                  displacement - rate * axis);
    if (side.hit && is_beside(side.fraction)) {
        if (side.fraction == 0.0) side.normal = against(displacement);
        keep_nearer(side, best);
    }
    return best;
}

ConvexRay cast_at(const PlacedBox& box, const Eigen::Vector3d& from,
                  const Eigen::Vector3d& displacement) {
    const Eigen::Vector3d p = rotated_back(box.rotation, from - box.centre);
    const Eigen::Vector3d v = rotated_back(box.rotation, displacement);
    Clip clip;
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d n = box.rotation.col(i);
        if (!clip.cut(-n, -p[i] - box.half[i], -v[i])) return {};
        if (!clip.cut(n, p[i] - box.half[i], v[i])) return {};
    }
    return enter(clip, displacement);
}

ConvexRay cast_at(const PlacedHull& hull, const Eigen::Vector3d& from,
                  const Eigen::Vector3d& displacement) {
    const Polyhedron& shape = hull.shape;
    const Eigen::Vector3d p = rotated_back(hull.rotation, from - hull.centre);
    const Eigen::Vector3d v = rotated_back(hull.rotation, displacement);
    if (shape.faces.empty()) {
        // A point or segment is hit only if the ray passes through it.
        const Eigen::Vector3d& low = shape.vertices.front();
        const Eigen::Vector3d edge = shape.vertices.back() - low;
        const SegmentPair pair = find_closest_on_segments(p, v, low, edge);
        const Eigen::Vector3d d = (p + pair.s * v) - (low + pair.t * edge);
        if (length(d) > kTouchShare * hull.reach) return {};
        return {true, pair.s, against(displacement)};
    }
    Clip clip;
    const auto cut = [&](const Eigen::Vector3d& n, double offset) {
        return clip.cut(n, dot(n, p) - offset, dot(n, v));
    };
    for (const Polyhedron::Face& face : shape.faces) {
        if (!cut(face.normal, face.offset)) return {};
    }
    if (shape.faces.size() == 2) {
        // A flat hull has no side faces: clips by planes through its edges instead.
        const Polyhedron::Face& face = shape.faces[0];
        for (std::uint32_t k = 0; k < face.count; ++k) {
            const Eigen::Vector3d& low = shape.vertices[shape.loops[face.first + k]];
            const Eigen::Vector3d& high =
                shape.vertices[shape.loops[face.first + (k + 1) % face.count]];
            const Eigen::Vector3d out = cross(high - low, face.normal);
            const Eigen::Vector3d side = out / length(out);
            if (!cut(side, dot(side, low))) return {};
        }
    }
    ConvexRay answer = enter(clip, displacement);
    if (dot(clip.normal, clip.normal) > 0.0) answer.normal = rotated(hull.rotation, clip.normal);
    return answer;
}

}  // namespace

ConvexRay cast_ray(const PlacedConvex& shape, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& displacement) {
    return std::visit([&](const auto& placed) { return cast_at(placed, from, displacement); },
                      shape);
}

PartRay cast_ray(const PlacedView& shape, const Eigen::Vector3d& from,
                 const Eigen::Vector3d& displacement) {
    PartRay best;
    if (shape.view->is_single()) {
        static_cast<ConvexRay&>(best) = cast_ray(shape.part(0), from, displacement);
        return best;
    }
    const Eigen::Vector3d start = rotated_back(shape.rotation, from - shape.centre);
    const Eigen::Vector3d displacement_body = rotated_back(shape.rotation, displacement);
    // Rounding plus the touching distance.
    const double slack = 2.0 * kTouchShare * shape.view->reach() +
                         1e-15 * (length(start) + length(displacement_body));
    visit_leaves_up_to(
        shape.view->tree(), 1.0,
        [&](const Aabb& box) { return segment_entry(start, displacement_body, box, slack); },
        [&](std::uint32_t part) {
            const ConvexRay ray = cast_ray(shape.part(part), from, displacement);
            const bool is_tie = best.hit && ray.fraction == best.fraction && part < best.part;
            if (ray.hit && (!best.hit || ray.fraction < best.fraction || is_tie)) {
                static_cast<ConvexRay&>(best) = ray;
                best.part = part;
            }
            return best.hit ? best.fraction : 1.0;
        });
    return best;
}

}  // namespace terrane::internal
