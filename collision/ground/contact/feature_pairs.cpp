// SPDX-License-Identifier: MIT
// Sources: G. van den Bergen. Collision detection in interactive 3D environments. 2003, section 4.4
//          (contacts from pairs of features).
// Deviations: features are paired where the shape is *separated*, so that every normal is one of a contact there;
//             depths are counted back from there.
#include "ground/contact/feature_pairs.h"

#include "ground/column/closest_points.h"
#include "ground/column/normal_cone.h"

namespace terrane::internal {

void FeaturePairs::pair(const Triangle& triangle) {
    if (shape_.kind == ShapeKind::round) pair_round(triangle);
    if (shape_.kind == ShapeKind::box) pair_box(triangle);
    if (shape_.kind == ShapeKind::hull) pair_hull(triangle);
}

void FeaturePairs::add(const Eigen::Vector3d& on_shape, const Eigen::Vector3d& n, double gap,
                       const ShapeFeature& feature) {
    const double depth = dot(n, translation_) - gap;
    if (gap > reach_ || depth < -margin_) return;
    patches_.add(make_contact(on_shape - translation_, n, depth, feature, part_));
}

Separation FeaturePairs::find_separation_in_cone(const Triangle& triangle) const {
    Separation best;
    visit_tops(shape_, triangle, [&](const Eigen::Vector3d& n, double gap) {
        if (gap > best.gap && is_in_normal_cone(local_, triangle, n)) best = {n, gap};
    });
    return best;
}

void FeaturePairs::pair_round(const Triangle& triangle) {
    const Eigen::Vector3d& n = triangle.normal;
    const bool has_core = shape_.has_core();
    bool has_face = false;
    for (const double sign : {-1.0, 1.0}) {
        if (!has_core && sign > 0.0) break;
        const Eigen::Vector3d end = shape_.centre + sign * shape_.core;
        const double gap = dot(n, end - triangle.v[0]) - shape_.radius;
        if (gap > reach_ || gap < least_ || !is_foot_inside(end, triangle)) continue;
        has_face = true;
        const std::uint32_t vertex = sign > 0.0 ? 1 : 0;
        add(end - shape_.radius * n, n, gap, {vertex, vertex});
    }
    const ClosestPair pair = find_closest_core(shape_.centre, shape_.core, triangle);
    if (pair.distance - shape_.radius > reach_) return;
    Eigen::Vector3d direction;
    if (find_direction(pair, direction)) {
        const double gap = pair.distance - shape_.radius;
        const bool is_face = dot(direction, n) > 1.0 - 1e-14;
        if ((is_face && has_face) || !is_in_normal_cone(local_, triangle, direction)) return;
        add(pair.on_shape - shape_.radius * direction, is_face ? n : direction, gap,
            shape_.core_feature(pair.on_shape));
        return;
    }
    if (has_face || pair.distance > 1e-9) return;
    // A core of radius 0 that touches: any direction of the cone that separates.
    const Separation best = find_separation_in_cone(triangle);
    add(pair.on_shape - shape_.radius * best.normal, best.normal, best.gap,
        shape_.core_feature(pair.on_shape));
}

void FeaturePairs::pair_box(const Triangle& triangle) {
    pair_box_face(triangle);
    pair_box_corners(triangle);
    pair_box_edges(triangle);
}

// Corners of the face of the box that is nearest to parallel to the triangle, over the triangle.
void FeaturePairs::pair_box_face(const Triangle& triangle) {
    const Eigen::Vector3d& n = triangle.normal;
    const std::size_t face = shape_.nearest_axis(n);
    const bool is_down = dot(n, shape_.axes[face]) > 0.0;
    for (int k = 0; k < 8; ++k) {
        if (((k >> face & 1) == 0) != is_down) continue;
        const Eigen::Vector3d corner = shape_.corner(k);
        const double gap = dot(n, corner - triangle.v[0]);
        // Far below the face it belongs to another column.
        if (gap > reach_ || gap < -kTouch || !is_foot_inside(corner, triangle)) continue;
        const auto vertex = static_cast<std::uint32_t>(k);
        add(corner, n, gap, {vertex, vertex});
    }
}

// Corners of the triangle under the lower faces of the box.
void FeaturePairs::pair_box_corners(const Triangle& triangle) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& axis = shape_.axes[i];
        if (axis[2] == 0.0) continue;
        const Eigen::Vector3d n = axis[2] < 0.0 ? Eigen::Vector3d(-axis) : axis;
        for (const Eigen::Vector3d& v : triangle.v) {
            const Eigen::Vector3d to = shape_.centre - v;
            const double gap = dot(n, to) - shape_.half[static_cast<Eigen::Index>(i)];
            if (gap > reach_ || gap < -kTouch) continue;
            const std::size_t j = (i + 1) % 3;
            const std::size_t k = (i + 2) % 3;
            if (std::abs(dot(shape_.axes[j], to)) > shape_.half[static_cast<Eigen::Index>(j)] ||
                std::abs(dot(shape_.axes[k], to)) > shape_.half[static_cast<Eigen::Index>(k)]) {
                continue;
            }
            // Only where the corner is the triangle's highest along n.
            if (dot(n, triangle.v[0] - v) > 1e-12 || dot(n, triangle.v[1] - v) > 1e-12 ||
                dot(n, triangle.v[2] - v) > 1e-12) {
                continue;
            }
            const std::uint32_t face = static_cast<std::uint32_t>(2 * i) + (axis[2] < 0.0 ? 1 : 0);
            if (is_in_normal_cone(local_, triangle, n)) {
                add(v + gap * n, n, gap, {face, ShapeFeature::kFace});
            }
        }
    }
}

void FeaturePairs::pair_box_edges(const Triangle& triangle) {
    for (std::size_t j = 0; j < 3; ++j) {
        const Eigen::Vector3d& a = triangle.v[j];
        const Eigen::Vector3d edge = triangle.v[(j + 1) % 3] - a;
        const double edge_length = length(edge);
        const Eigen::Vector3d direction = edge / edge_length;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto axis_index = static_cast<Eigen::Index>(i);
            const Eigen::Vector3d& axis = shape_.axes[i];
            Eigen::Vector3d n = cross(axis, direction);
            const double size = length(n);
            if (size < 1e-6) continue;  // nearly parallel: faces and corners have the same contacts
            n /= n[2] < 0.0 ? -size : size;
            if (n[2] <= 0.0) continue;
            // The edge must be the triangle's highest part along n.
            if (dot(n, triangle.v[(j + 2) % 3] - a) > 0.0) continue;
            // The edge of the box that is farthest against n.
            Eigen::Vector3d p = shape_.centre;
            std::uint32_t corner = 0;
            for (std::size_t m = 0; m < 3; ++m) {
                if (m == i) continue;
                const double half = shape_.half[static_cast<Eigen::Index>(m)];
                const bool is_low = dot(n, shape_.axes[m]) > 0.0;
                p += (is_low ? -half : half) * shape_.axes[m];
                if (!is_low) corner |= 1u << m;
            }
            const double gap = dot(n, p - a);
            if (gap > reach_ || gap < -kTouch) continue;
            // The closest points of the two lines.
            const Eigen::Vector3d r = p - a;
            const double b = dot(axis, direction);
            const double denominator = 1.0 - b * b;
            const double s = (b * dot(direction, r) - dot(axis, r)) / denominator;
            const double t = dot(direction, r) + s * b;
            if (std::abs(s) > shape_.half[axis_index] || t < 0.0 || t > edge_length) continue;
            if (is_in_normal_cone(local_, triangle, n)) {
                add(p + s * axis, n, gap, {corner, corner | 1u << i});
            }
        }
    }
}

}  // namespace terrane::internal
