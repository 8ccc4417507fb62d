// SPDX-License-Identifier: MIT
//
// Sources:    I. Sutherland, G. Hodgman. Reentrant polygon clipping. 1974.
// Deviations: the triangle is clipped by a face of the box along the face's normal, and keeps its own plane for depths.
#include "mesh/face_contacts.h"

#include "pairs/kernels/manifold.h"

#include <algorithm>

namespace terrane::internal {
namespace {

/// Least cosine of a box's face with a triangle's normal at which the face is clipped.
constexpr double kFlat = 0.9;

/// A point of a clipped triangle in the plane of a face.
struct FlatPoint {
    double x, y;
};

/// Clips a polygon by low <= +-x <= half or the same for y.
template <class Along>
std::size_t clip(const std::array<FlatPoint, 8>& from, std::size_t count, double half, Along along,
                 std::array<FlatPoint, 8>& to) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const FlatPoint& a = from[i];
        const FlatPoint& b = from[i + 1 == count ? 0 : i + 1];
        const double da = half - along(a), db = half - along(b);
        if (da >= 0.0) to[kept++] = a;
        if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0)) {
            const double s = da / (da - db);
            to[kept++] = {a.x + s * (b.x - a.x), a.y + s * (b.y - a.y)};
        }
    }
    return kept;
}

}  // namespace

FaceContacts::Found FaceContacts::add(const SurfaceTriangle& triangle) {
    const LocalShape& shape = part_.whole();
    if (shape.kind == ShapeKind::round) {
        const double along = dot(triangle.normal, shape.core);
        const bool is_flat = along * along <= (1.0 - kFlat * kFlat) * dot(shape.core, shape.core);
        return {add_segment(triangle), is_flat};
    }
    if (shape.kind == ShapeKind::box) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double up = dot(triangle.normal, shape.axes[axis]);
            if (std::abs(up) >= kFlat) return {add_box_face(triangle, axis, up), true};
        }
    }
    return {add_support(triangle), false};
}

/// The part of a capsule's core over a triangle.
double FaceContacts::add_segment(const SurfaceTriangle& triangle) {
    const LocalShape& shape = part_.whole();
    const Eigen::Vector3d& n = triangle.normal;
    const Eigen::Vector3d from = shape.centre - shape.core, along = 2.0 * shape.core;
    double begin = 0.0, end = 1.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d inwards = cross(n, triangle.v[(i + 1) % 3] - triangle.v[i]);
        const double at = dot(inwards, from - triangle.v[i]), slope = dot(inwards, along);
        if (slope > 0.0) {
            begin = std::max(begin, -at / slope);
        } else if (slope < 0.0) {
            end = std::min(end, -at / slope);
        } else if (at < 0.0) {
            return -kInfinity;
        }
    }
    if (!(begin <= end)) return -kInfinity;
    double deepest = -kInfinity;
    for (const double s : {begin, end}) {
        const Eigen::Vector3d core = from + s * along;
        const double depth = shape.radius - dot(n, core - triangle.v[0]);
        deepest = std::max(deepest, depth);
        if (depth < -margin_) continue;
        const Contact contact = make_contact(core - shape.radius * n, n, depth,
                                             shape.core_feature(core), part_.index());
        s == 0.0 || s == 1.0 ? add_outer(contact) : add_inner(contact);
    }
    return deepest;
}

/// The face of a box across an axis that is nearly parallel to the triangle's normal.
double FaceContacts::add_box_face(const SurfaceTriangle& triangle, std::size_t axis, double up) {
    const LocalShape& box = part_.whole();
    const std::size_t ix = (axis + 1) % 3, iy = (axis + 2) % 3;
    const Eigen::Vector3d &x = box.axes[ix], &y = box.axes[iy];
    const auto half = [&](std::size_t i) { return box.half[static_cast<Eigen::Index>(i)]; };
    const double hx = half(ix), hy = half(iy);
    const Eigen::Vector3d& n = triangle.normal;
    // The face towards the triangle, as a plane of depths over x and y.
    const double side = up > 0.0 ? -1.0 : 1.0;
    const Eigen::Vector3d middle = box.centre + side * half(axis) * box.axes[axis];
    const double depth0 = dot(n, triangle.v[0] - middle);
    const double slope_x = -dot(n, x), slope_y = -dot(n, y);
    const auto depth_at = [&](const FlatPoint& p) {
        return depth0 + slope_x * p.x + slope_y * p.y;
    };
    std::array<FlatPoint, 3> corners;
    std::array<std::array<FlatPoint, 8>, 2> polygons;
    FlatPoint low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d to = triangle.v[i] - middle;
        const FlatPoint p{dot(to, x), dot(to, y)};
        corners[i] = polygons[0][i] = p;
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    std::size_t count = 3, last = 0;
    const auto clip_side = [&](double limit, auto along) {
        count = clip(polygons[last], count, limit, along, polygons[1 - last]);
        last = 1 - last;
    };
    if (high.x > hx) clip_side(hx, [](const FlatPoint& p) { return p.x; });
    if (low.x < -hx) clip_side(hx, [](const FlatPoint& p) { return -p.x; });
    if (high.y > hy) clip_side(hy, [](const FlatPoint& p) { return p.y; });
    if (low.y < -hy) clip_side(hy, [](const FlatPoint& p) { return -p.y; });
    const std::array<FlatPoint, 8>& a = polygons[last];
    double deepest = -kInfinity;
    FlatPoint best{};
    for (std::size_t i = 0; i < count; ++i) {
        const double depth = depth_at(a[i]);
        if (depth > deepest) {
            deepest = depth;
            best = a[i];
        }
    }
    if (deepest < -margin_) return deepest;
    const auto place = [&](const FlatPoint& p, const ShapeFeature& feature) {
        return make_contact(middle + p.x * x + p.y * y, n, depth_at(p), feature, part_.index());
    };
    // Corners of the box over the triangle.
    const auto turn = [&](std::size_t i, const FlatPoint& p) {
        const FlatPoint &from = corners[i], &to = corners[i == 2 ? 0 : i + 1];
        return (to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x);
    };
    for (int k = 0; k < 4; ++k) {
        const FlatPoint p{(k & 1) != 0 ? hx : -hx, (k & 2) != 0 ? hy : -hy};
        if (p.x < low.x || p.x > high.x || p.y < low.y || p.y > high.y) continue;
        const double depth = depth_at(p);
        if (depth < -margin_) continue;
        const double t0 = turn(0, p), t1 = turn(1, p), t2 = turn(2, p);
        if (!((t0 >= 0.0 && t1 >= 0.0 && t2 >= 0.0) || (t0 <= 0.0 && t1 <= 0.0 && t2 <= 0.0))) {
            continue;
        }
        std::uint32_t corner = side > 0.0 ? 1u << axis : 0u;
        if ((k & 1) != 0) corner |= 1u << ix;
        if ((k & 2) != 0) corner |= 1u << iy;
        add_outer(place(p, {corner, corner}));
    }
    add_inner(place(
        best, {static_cast<std::uint32_t>(2 * axis + (side > 0.0 ? 1 : 0)), ShapeFeature::kFace}));
    return deepest;
}

double FaceContacts::add_support(const SurfaceTriangle& triangle) {
    const TriangleCore core(triangle);
    Manifold manifold(triangle.normal, kInfinity);
    intersect_support_features(part_.whole_core(), core.core(), triangle.normal, manifold);
    if (manifold.is_empty()) return -kInfinity;
    std::array<PairContact, 4> found;
    const std::size_t count = manifold.finish(found);
    for (std::size_t i = 0; i < count; ++i) {
        if (found[i].depth < -margin_) break;
        const bool is_corner = found[i].feature_a.first == found[i].feature_a.second;
        const Contact contact = make_contact(found[i].point_world, found[i].normal, found[i].depth,
                                             found[i].feature_a, part_.index());
        is_corner ? add_outer(contact) : add_inner(contact);
    }
    return found[0].depth;
}

void FaceContacts::add_outer(const Contact& contact) {
    if (count_ < kMostOuter) {
        contacts_[count_++] = contact;
    } else {
        add_inner(contact);
    }
}

void FaceContacts::add_inner(const Contact& contact) {
    if (!wants_inner(contact.depth)) return;
    inner_[inner_count_ < kMostInner ? inner_count_++ : shallowest_] = contact;
    if (inner_count_ < kMostInner) return;
    shallowest_ = 0;
    for (std::size_t i = 1; i < kMostInner; ++i) {
        if (inner_[i].depth < inner_[shallowest_].depth) shallowest_ = i;
    }
}

}  // namespace terrane::internal
