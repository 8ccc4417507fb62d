// SPDX-License-Identifier: MIT
#include "pairs/convex_core.h"
#include "pairs/convex_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {

namespace {

// Nearest points of the cores of two spheres or capsules.
struct CorePoints {
    Eigen::Vector3d a, b;

    Eigen::Vector3d offset() const { return a - b; }
};

CorePoints find_core_points(const PlacedSphere& a, const PlacedSphere& b) {
    return {a.centre, b.centre};
}

// Position along the capsule's core of the point nearest to the sphere, -1 to 1 in units of the half axis.
double find_share(const PlacedSphere& a, const PlacedCapsule& b) {
    const double square = dot(b.half_axis, b.half_axis);
    if (square == 0.0) return 0.0;
    return std::clamp(dot(a.centre - b.centre, b.half_axis) / square, -1.0, 1.0);
}

CorePoints find_core_points(const PlacedSphere& a, const PlacedCapsule& b) {
    return {a.centre, b.centre + find_share(a, b) * b.half_axis};
}

CorePoints find_core_points(const PlacedCapsule& a, const PlacedCapsule& b) {
    const Eigen::Vector3d u = 2.0 * a.half_axis;
    const Eigen::Vector3d v = 2.0 * b.half_axis;
    const Eigen::Vector3d p = a.centre - a.half_axis;
    const Eigen::Vector3d q = b.centre - b.half_axis;
    const SegmentPair pair = find_closest_on_segments(p, u, q, v);
    return {p + pair.s * u, q + pair.t * v};
}

// Normal and distance of the cores. Takes one root, unless the cores touch or cross.
Axis find_core_axis(const PlacedSphere&, const PlacedSphere&, const CorePoints& points) {
    const Eigen::Vector3d d = points.offset();
    Axis axis;
    axis.gap = length(d);
    if (axis.gap > 0.0) axis.normal = d / axis.gap;
    return axis;
}

Axis find_core_axis(const PlacedSphere&, const PlacedCapsule& b, const CorePoints& points) {
    const Eigen::Vector3d d = points.offset();
    Axis axis;
    axis.gap = length(d);
    if (axis.gap > 0.0) {
        axis.normal = d / axis.gap;
    } else if (const double size = length(b.half_axis); size > 0.0) {
        axis.normal = any_tangent(b.half_axis / size);
    }
    return axis;
}

Axis find_core_axis(const PlacedCapsule& a, const PlacedCapsule& b, const CorePoints& points) {
    const Eigen::Vector3d u = 2.0 * a.half_axis;
    const Eigen::Vector3d v = 2.0 * b.half_axis;
    const Eigen::Vector3d d = points.offset();
    Axis axis;
    axis.gap = length(d);
    // The 1-norm is at least the length: it saves the roots of two lengths.
    if (axis.gap > 1.01e-14 * (norm1(u) + norm1(v)) || axis.gap > 1e-14 * (length(u) + length(v))) {
        axis.normal = d / axis.gap;
        return axis;
    }
    // Crossing cores: any common perpendicular separates them.
    Eigen::Vector3d square = cross(u, v);
    const double sine = length(square);
    if (sine > 1e-10 * length(u) * length(v)) {
        square /= sine;
        axis.normal = dot(square, a.centre - b.centre) < 0.0 ? Eigen::Vector3d(-square) : square;
    } else if (length(u) + length(v) > 0.0) {
        const Eigen::Vector3d& longer = length(u) < length(v) ? v : u;
        axis.normal = any_tangent(longer / length(longer));
    }
    return axis;
}

Gap find_swept_gap(const auto& a, const auto& b) {
    const CorePoints points = find_core_points(a, b);
    const Axis axis = find_core_axis(a, b, points);
    return {axis.gap - (a.radius + b.radius), axis.normal, points.a, points.b};
}

Axis find_swept_pseudodistance(const auto& a, const auto& b) {
    const Axis axis = find_core_axis(a, b, find_core_points(a, b));
    return {axis.normal, swept_pseudodistance(axis.gap, a.radius + b.radius)};
}

// Compares squares, so that it takes no root.
bool is_swept_touching(const auto& a, const auto& b, double size) {
    const Eigen::Vector3d d = find_core_points(a, b).offset();
    const double most = a.radius + b.radius + kTouchShare * size;
    return dot(d, d) <= most * most;
}

}  // namespace

Gap find_gap(const PlacedSphere& a, const PlacedSphere& b) { return find_swept_gap(a, b); }

void find_contacts(const PlacedSphere& a, const PlacedSphere&, const Gap& gap, Manifold& manifold) {
    manifold.add(a.centre - a.radius * gap.normal, -gap.distance, {0, 0}, {0, 0});
}

bool is_touching(const PlacedSphere& a, const PlacedSphere& b) {
    return is_swept_touching(a, b, a.radius + b.radius);
}

Axis find_pseudodistance(const PlacedSphere& a, const PlacedSphere& b) {
    return find_swept_pseudodistance(a, b);
}

Gap find_gap(const PlacedSphere& a, const PlacedCapsule& b) { return find_swept_gap(a, b); }

void find_contacts(const PlacedSphere& a, const PlacedCapsule& b, const Gap& gap,
                   Manifold& manifold) {
    const double share = find_share(a, b);
    const ShapeFeature feature = share <= -1.0  ? ShapeFeature{0, 0}
                                 : share >= 1.0 ? ShapeFeature{1, 1}
                                                : ShapeFeature{0, 1};
    manifold.add(a.centre - a.radius * gap.normal, -gap.distance, {0, 0}, feature);
}

bool is_touching(const PlacedSphere& a, const PlacedCapsule& b) {
    return is_swept_touching(a, b, a.radius + b.radius + b.half_length);
}

Axis find_pseudodistance(const PlacedSphere& a, const PlacedCapsule& b) {
    return find_swept_pseudodistance(a, b);
}

Gap find_gap(const PlacedSphere& a, const PlacedBox& b) {
    // In the box's frame.
    const Eigen::Vector3d centre = rotated_back(b.rotation, a.centre - b.centre);
    Eigen::Vector3d nearest = centre;
    for (int i = 0; i < 3; ++i) nearest[i] = std::clamp(centre[i], -b.half[i], b.half[i]);
    const Eigen::Vector3d d = centre - nearest;
    const double distance = length(d);
    Gap gap;
    gap.core_a = a.centre;
    gap.core_b = b.centre + rotated(b.rotation, nearest);
    if (distance > 0.0) {
        gap.distance = distance - a.radius;
        gap.normal = rotated(b.rotation, d / distance);
        return gap;
    }
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
        if (b.half[i] - std::abs(centre[i]) < b.half[axis] - std::abs(centre[axis])) axis = i;
    }
    const double sign = centre[axis] < 0.0 ? -1.0 : 1.0;
    const double depth = b.half[axis] - std::abs(centre[axis]);
    gap.distance = -depth - a.radius;
    gap.normal = sign * b.rotation.col(axis);
    gap.core_b = a.centre + depth * gap.normal;
    return gap;
}

void find_contacts(const PlacedSphere& a, const PlacedBox& b, const Gap& gap, Manifold& manifold) {
    // Nearest feature of the box: the coordinates that are at their limits identify a face, edge or vertex.
    const Eigen::Vector3d on_b = rotated_back(b.rotation, gap.core_b - b.centre);
    const double slack = kTouchShare * (length(b.half) + a.radius);
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    std::uint32_t face = 0;
    int ends = 0;
    for (int i = 0; i < 3; ++i) {
        const bool is_high = on_b[i] >= b.half[i] - slack && on_b[i] >= 0.0;
        const bool is_low = on_b[i] <= -b.half[i] + slack && on_b[i] <= 0.0;
        const auto bit = std::uint32_t{1} << i;
        if (is_high) {
            low |= bit;
            high |= bit;
        } else if (!is_low) {
            high |= bit;
        }
        if (is_high || is_low) {
            ++ends;
            face = static_cast<std::uint32_t>(2 * i + (is_high ? 1 : 0));
        }
    }
    const ShapeFeature feature =
        ends <= 1 ? ShapeFeature{face, ShapeFeature::kFace} : ShapeFeature{low, high};
    manifold.add(a.centre - a.radius * gap.normal, -gap.distance, {0, 0}, feature);
}

bool is_touching(const PlacedSphere& a, const PlacedBox& b) {
    return find_gap(a, b).distance <= kTouchShare * (length(b.half) + a.radius);
}

Axis find_pseudodistance(const PlacedSphere& a, const PlacedBox& b) {
    const Gap gap = find_gap(a, b);
    return {gap.normal, gap.distance};
}

namespace {

ShapeFeature feature_at(double share) {
    if (share <= 0.0) return {0, 0};
    if (share >= 1.0) return {1, 1};
    return {0, 1};
}

}  // namespace

Gap find_gap(const PlacedCapsule& a, const PlacedCapsule& b) { return find_swept_gap(a, b); }

void find_contacts(const PlacedCapsule& a, const PlacedCapsule& b, const Gap& gap,
                   Manifold& manifold) {
    const Eigen::Vector3d u = 2.0 * a.half_axis;
    const Eigen::Vector3d v = 2.0 * b.half_axis;
    const Eigen::Vector3d p = a.centre - a.half_axis;
    const Eigen::Vector3d q = b.centre - b.half_axis;
    const double radii = a.radius + b.radius;
    const double slack = kTouchShare * (radii + length(u) + length(v));
    // Adds a contact of an end of one core with the other capsule, whose surface is lower the farther the end is from
    // the other core sideways.
    const auto add_end = [&](double s, double t, bool is_of_a) {
        const Eigen::Vector3d core_a = p + s * u;
        const Eigen::Vector3d d = core_a - (q + t * v);
        const double along = dot(gap.normal, d);
        const Eigen::Vector3d beside = d - along * gap.normal;
        const double other = is_of_a ? b.radius : a.radius;
        const double square = other * other - dot(beside, beside);
        if (square < -slack * slack) return;
        const double height = std::sqrt(std::max(0.0, square));
        const double reach_a = is_of_a ? a.radius : height;
        const double reach_b = is_of_a ? height : b.radius;
        Eigen::Vector3d on_a = core_a - reach_a * gap.normal;
        if (!is_of_a) on_a -= beside;
        manifold.add(on_a, reach_a + reach_b - along, feature_at(s), feature_at(t));
    };
    const double uu = dot(u, u);
    const double vv = dot(v, v);
    const SegmentPair pair = find_closest_on_segments(p, u, q, v);
    // Nearly parallel cores: contacts at the ends of their common interval, projected along the normal.
    const Eigen::Vector3d square = cross(u, v);
    constexpr double kParallel = 0.02;  // sine; ends that are too far apart fail the depth margin
    if (uu > 0.0 && vv > 0.0 && dot(square, square) < kParallel * kParallel * uu * vv) {
        for (const double end : {0.0, 1.0}) {
            if (const double t = dot(v, p + end * u - q) / vv; t >= 0.0 && t <= 1.0) {
                add_end(end, t, true);
            }
            if (const double s = dot(u, q + end * v - p) / uu; s >= 0.0 && s <= 1.0) {
                add_end(s, end, false);
            }
        }
    }
    if (!manifold.has_depth(-gap.distance - slack)) {
        manifold.add(p + pair.s * u - a.radius * gap.normal, -gap.distance, feature_at(pair.s),
                     feature_at(pair.t));
    }
}

bool is_touching(const PlacedCapsule& a, const PlacedCapsule& b) {
    return is_swept_touching(a, b, a.radius + b.radius + a.half_length + b.half_length);
}

Axis find_pseudodistance(const PlacedCapsule& a, const PlacedCapsule& b) {
    return find_swept_pseudodistance(a, b);
}

// Sources: S. Gottschalk, M. Lin, D. Manocha. OBBTree. 1996 (the separating axis test with 15 axes).

namespace {

// The axis with the largest gap among the face normals of both boxes and all cross products of their edges, each a
// facet normal of the Minkowski difference. Works in a's frame.
Axis find_box_separating_axis(const Core& a, const Core& b, double enough) {
    const Eigen::Vector3d half_a = a.shape.vertices.back();  // zero for a point
    const Eigen::Vector3d half_b = b.shape.vertices.back();
    const Eigen::Vector3d t = a.to_body(a.centre - b.centre);
    std::array<Eigen::Vector3d, 3> axes;  // of b
    for (std::size_t j = 0; j < 3; ++j) {
        axes[j] = a.to_body(b.rotation.col(static_cast<Eigen::Index>(j)));
    }
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    double best = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
        const double gap = std::abs(t[i]) - half_a[i] -
                           (half_b[0] * std::abs(axes[0][i]) + half_b[1] * std::abs(axes[1][i]) +
                            half_b[2] * std::abs(axes[2][i]));
        if (gap > best) {
            best = gap;
            normal = Eigen::Vector3d::Unit(i);
        }
    }
    for (std::size_t j = 0; j < 3; ++j) {
        const Eigen::Vector3d& n = axes[j];
        const double gap =
            std::abs(dot(t, n)) - half_b[static_cast<Eigen::Index>(j)] -
            (half_a[0] * std::abs(n[0]) + half_a[1] * std::abs(n[1]) + half_a[2] * std::abs(n[2]));
        if (gap > best) {
            best = gap;
            normal = n;
        }
    }
    const double preference = kTouchShare * (a.reach + b.reach);
    for (int i = 0; i < 3 && !(best > enough); ++i) {
        if (half_a[i] == 0.0) continue;  // no edge
        const int i1 = (i + 1) % 3;
        const int i2 = (i + 2) % 3;
        for (std::size_t j = 0; j < 3; ++j) {
            if (half_b[static_cast<Eigen::Index>(j)] == 0.0) continue;
            // a's axis i crossed with b's axis j: exactly orthogonal to a's axis.
            const double m1 = -axes[j][i2];
            const double m2 = axes[j][i1];
            const double square = m1 * m1 + m2 * m2;
            if (square < 1e-20) continue;  // nearly parallel: the face normals suffice
            const std::size_t j1 = (j + 1) % 3;
            const std::size_t j2 = (j + 2) % 3;
            const double apart = std::abs(t[i1] * m1 + t[i2] * m2) -
                                 (half_a[i1] * std::abs(m1) + half_a[i2] * std::abs(m2)) -
                                 half_b[static_cast<Eigen::Index>(j1)] *
                                     std::abs(axes[j1][i1] * m1 + axes[j1][i2] * m2) -
                                 half_b[static_cast<Eigen::Index>(j2)] *
                                     std::abs(axes[j2][i1] * m1 + axes[j2][i2] * m2);
            const double size = std::sqrt(square);
            if (!(apart > (best + preference) * size)) continue;
            best = apart / size;
            normal = Eigen::Vector3d::Zero();
            normal[i1] = m1 / size;
            normal[i2] = m2 / size;
        }
    }
    if (dot(normal, t) < 0.0) normal = -normal;
    return {a.to_axes(normal), best};
}

}  // namespace

Gap find_gap(const PlacedBox& a, const PlacedBox& b) {
    CoreStorage of_a;
    CoreStorage of_b;
    const Core core_a = make_core(a, of_a);
    const Core core_b = make_core(b, of_b);
    // The 15 axes come first: for clearly overlapping boxes they suffice without GJK.
    const Axis axis = find_box_separating_axis(core_a, core_b, 0.0);
    if (axis.gap > -touch_of(core_a, core_b)) {
        return find_core_gap(core_a, core_b, find_box_separating_axis);
    }
    Gap gap;
    gap.distance = axis.gap;
    gap.normal = axis.normal;
    gap.has_points = false;
    return gap;
}

void find_contacts(const PlacedBox& a, const PlacedBox& b, const Gap& gap, Manifold& manifold) {
    CoreStorage of_a;
    CoreStorage of_b;
    find_core_contacts(make_core(a, of_a), make_core(b, of_b), gap, manifold);
}

bool is_touching(const PlacedBox& a, const PlacedBox& b) {
    CoreStorage of_a;
    CoreStorage of_b;
    const Core core_a = make_core(a, of_a);
    const Core core_b = make_core(b, of_b);
    const double touch = touch_of(core_a, core_b);
    const double gap = find_box_separating_axis(core_a, core_b, touch).gap;
    if (gap > touch || gap < -touch) return gap < 0.0;
    return find_core_gap(core_a, core_b, find_box_separating_axis).distance <= touch;
}

Axis find_pseudodistance(const PlacedBox& a, const PlacedBox& b) {
    CoreStorage of_a;
    CoreStorage of_b;
    return find_polyhedra_pseudodistance(make_core(a, of_a), make_core(b, of_b),
                                         find_box_separating_axis);
}

}  // namespace terrane::internal
