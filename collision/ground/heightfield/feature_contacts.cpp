// SPDX-License-Identifier: MIT
//
// Sources: G. van den Bergen. Collision detection in interactive 3D environments. 2003, section 4.4
//          (contacts from pairs of features).
// Deviations: features are paired after a *separating* translation, where every pair has a normal; depths are those at
//             the untranslated pose.
#include "ground/heightfield/feature_contacts.h"

#include "ground/column/column.h"
#include "ground/column/local_ground.h"
#include "ground/heightfield/contact_patches.h"
#include "pairs/manifold.h"

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
    // The shape has radius 0 and touches the triangle: takes the direction in the cone that has the largest gap.
    const Separation best = find_separation_in_cone(triangle);
    add(pair.on_shape - shape_.radius * best.normal, best.normal, best.gap,
        shape_.core_feature(pair.on_shape));
}

void FeaturePairs::pair_box(const Triangle& triangle) {
    pair_box_face(triangle);
    pair_box_corners(triangle);
    pair_box_edges(triangle);
}

// Of the face of the box most nearly parallel to the triangle, adds the corners that project into the triangle.
void FeaturePairs::pair_box_face(const Triangle& triangle) {
    const Eigen::Vector3d& n = triangle.normal;
    const std::size_t face = shape_.nearest_axis(n);
    const bool is_down = dot(n, shape_.axes[face]) > 0.0;
    for (int k = 0; k < 8; ++k) {
        if (((k >> face & 1) == 0) != is_down) continue;
        const Eigen::Vector3d corner = shape_.corner(k);
        const double gap = dot(n, corner - triangle.v[0]);
        // A corner far below the face belongs to another column.
        if (gap > reach_ || gap < -kTouch || !is_foot_inside(corner, triangle)) continue;
        const auto vertex = static_cast<std::uint32_t>(k);
        add(corner, n, gap, {vertex, vertex});
    }
}

// Adds corners of the triangle that lie below the lower faces of the box.
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
            // Only the corner that is the triangle's highest along n makes a contact.
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
            if (size < 1e-6) continue;  // nearly parallel: faces and corners give the same contacts
            n /= n[2] < 0.0 ? -size : size;
            if (n[2] <= 0.0) continue;
            // The edge must be the triangle's highest part along n.
            if (dot(n, triangle.v[(j + 2) % 3] - a) > 0.0) continue;
            // The support edge of the box against n.
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

// Sources: G. van den Bergen. Collision detection in interactive 3D environments. 2003, section 4.4.
// Deviations: a hull has too many features to pair all: only its support features along the triangle's normal and along
//             the direction between the closest points are clipped against the triangle.

namespace {

// The support feature of a triangle along a direction, projected along it: a corner, an edge, or the whole triangle.
struct TopPolygon {
    TopPolygon(const Triangle& triangle, const ContactPlane& plane) {
        const Eigen::Vector3d& a = triangle.v[0];
        const Eigen::Vector3d ab = triangle.v[1] - a;
        const Eigen::Vector3d ac = triangle.v[2] - a;
        const std::array<Eigen::Vector3d, 3> corners = {Eigen::Vector3d::Zero(), ab, ac};
        // Features tilted only by rounding count as level.
        const double slack = 1e-10 * std::sqrt(std::max(dot(ab, ab), dot(ac, ac)));
        for (const Eigen::Vector3d& p : corners) height = std::max(height, dot(plane.normal, p));
        for (const Eigen::Vector3d& p : corners) {
            if (dot(plane.normal, p) < height - slack) continue;
            x[count] = dot(plane.x, p);
            y[count] = dot(plane.y, p);
            ++count;
        }
    }
    std::size_t count = 0;
    std::array<double, 3> x;
    std::array<double, 3> y;
    double height = 0.0;
};

std::size_t side_count(std::size_t corner_count) {
    return corner_count < 3 ? corner_count - 1 : corner_count;
}

// Calls `visitor(parameter on side i)` at the crossing of side i of a support polygon with side j of a top polygon; for
// collinear sides, at the ends of their common part.
template <class Visitor>
void cross_sides(const SupportPolygon& a, std::size_t i, const TopPolygon& b, std::size_t j,
                 double slack, Visitor&& visitor) {
    const std::size_t i1 = i + 1 == a.count ? 0 : i + 1;
    const std::size_t j1 = j + 1 == b.count ? 0 : j + 1;
    const double ux = a.x[i1] - a.x[i], uy = a.y[i1] - a.y[i];
    const double vx = b.x[j1] - b.x[j], vy = b.y[j1] - b.y[j];
    const double rx = b.x[j] - a.x[i], ry = b.y[j] - a.y[i];
    const double uu = ux * ux + uy * uy;
    const double vv = vx * vx + vy * vy;
    if (uu == 0.0 || vv == 0.0) return;
    const double across = ux * vy - uy * vx;
    if (across * across > 1e-18 * uu * vv) {
        const double s = (rx * vy - ry * vx) / across;
        const double t = (rx * uy - ry * ux) / across;
        const double over_u = std::max(-s, s - 1.0) * std::sqrt(uu);
        const double over_v = std::max(-t, t - 1.0) * std::sqrt(vv);
        if (over_u <= slack && over_v <= slack) visitor(std::clamp(s, 0.0, 1.0));
        return;
    }
    if (std::abs(rx * uy - ry * ux) > slack * std::sqrt(uu)) return;
    const double s0 = (rx * ux + ry * uy) / uu;
    const double s1 = ((rx + vx) * ux + (ry + vy) * uy) / uu;
    const double first = std::max(0.0, std::min(s0, s1));
    const double last = std::min(1.0, std::max(s0, s1));
    if (first > last) return;
    visitor(first);
    if (last > first) visitor(last);
}

// The direction from a triangle to a hull. It is corrected for the rounding of the closest points if the correction
// increases the gap: 3 nm from a cliff of 125 km, the error of the uncorrected direction is 3.5 milliradians.
Eigen::Vector3d refine_direction(const Eigen::Vector3d& direction, double distance,
                                 const LocalShape& shape, const Triangle& triangle) {
    // Distance relative to the triangle's size beyond which rounding errors are below 1e-9 radians.
    constexpr double kExact = 1e-7;
    double square = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        square = std::max(square, dot(edge, edge));
    }
    if (distance * distance > kExact * kExact * square) return direction;
    Separation best{direction, gap_along(direction, shape, triangle)};
    visit_perpendicular_to_edges(triangle, direction, [&](const Eigen::Vector3d& n) {
        const double gap = gap_along(n, shape, triangle);
        if (gap > best.gap) best = {n, gap};
    });
    return best.normal;
}

}  // namespace

void FeaturePairs::pair_hull(const Triangle& triangle) {
    constexpr double kFlat = 1.0 - 1e-14;  // cosine: equal to the triangle's normal within rounding
    const ClosestPair closest = find_closest(shape_, triangle);
    if (closest.distance > reach_) return;
    const bool has_face =
        pair_hull_along(triangle.normal, triangle) < std::numeric_limits<double>::infinity();
    const Eigen::Vector3d across = closest.on_shape - closest.on_triangle;
    Separation nearest{
        refine_direction(across / length(across), closest.distance, shape_, triangle),
        closest.distance};
    if (!(closest.distance > kTouch)) {
        if (has_face) return;
        nearest = find_separation_in_cone(triangle);
        if (nearest.gap < -kTouch) return;
    } else if (!(nearest.normal[2] > 0.0)) {
        return;
    }
    const bool is_flat = dot(nearest.normal, triangle.normal) > kFlat;
    if (is_flat && has_face) return;
    if (!is_flat) {
        if (!is_in_normal_cone(local_, triangle, nearest.normal)) return;
        if (pair_hull_along(nearest.normal, triangle) <= nearest.gap + kTouch) return;
    }
    add(closest.on_shape, is_flat ? triangle.normal : nearest.normal, nearest.gap,
        shape_.deepest(nearest.normal).feature);
}

// Clips the hull's support feature along a direction against that of the triangle. Returns the smallest gap found.
double FeaturePairs::pair_hull_along(const Eigen::Vector3d& n, const Triangle& triangle) {
    const Eigen::Vector3d& origin = triangle.v[0];
    const ContactPlane plane(n);
    const SupportPolygon of_hull(make_core(*shape_.hull, shape_.centre - origin), plane, -1.0);
    const TopPolygon top(triangle, plane);
    const double slack = 1e-11 * (length(shape_.bounds) + local_.spacing());
    double least = std::numeric_limits<double>::infinity();
    const auto visitor = [&](double x, double y, double height, const ShapeFeature& feature) {
        const double gap = height - top.height;
        // A point far below belongs to another column.
        if (gap > reach_ || gap < -kTouch) return;
        least = std::min(least, gap);
        add(origin + plane.at(x, y, height), n, gap, feature);
    };
    // If n does not separate hull and column, only vertices of the hull that project into the triangle are paired.
    const bool is_apart = gap_along(n, shape_, triangle) >= -kTouch;
    if (top.count == 3) {
        for (std::size_t i = 0; i < of_hull.count; ++i) {
            const Eigen::Vector3d p = origin + plane.at(of_hull.x[i], of_hull.y[i], of_hull.h[i]);
            if (!is_foot_inside(p, triangle)) continue;
            visitor(of_hull.x[i], of_hull.y[i], of_hull.h[i], of_hull.vertex_feature(i));
        }
    }
    for (std::size_t j = 0; is_apart && j < top.count; ++j) {
        if (!of_hull.contains(top.x[j], top.y[j], slack)) continue;
        visitor(top.x[j], top.y[j], of_hull.height(top.x[j], top.y[j]), of_hull.face_feature());
    }
    for (std::size_t i = 0; is_apart && i < side_count(of_hull.count); ++i) {
        const std::size_t i1 = i + 1 == of_hull.count ? 0 : i + 1;
        for (std::size_t j = 0; j < side_count(top.count); ++j) {
            cross_sides(of_hull, i, top, j, slack, [&](double s) {
                visitor(of_hull.x[i] + s * (of_hull.x[i1] - of_hull.x[i]),
                        of_hull.y[i] + s * (of_hull.y[i1] - of_hull.y[i]),
                        of_hull.h[i] + s * (of_hull.h[i1] - of_hull.h[i]), of_hull.edge_feature(i));
            });
        }
    }
    return least;
}

}  // namespace terrane::internal
