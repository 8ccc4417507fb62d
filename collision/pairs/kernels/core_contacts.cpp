// SPDX-License-Identifier: MIT
// Sources: G. van den Bergen. Collision detection in interactive 3D environments. 2003, section 4.4.
// Deviations: the support faces are intersected in the plane orthogonal to the normal and keep their own heights, so
//             that each contact's depth is the overlap along the normal, and its two points lie on the two shapes.
#include "pairs/kernels/manifold.h"
#include "pairs/kernels/support_polygon.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Adds the intersection of two edges in the plane.
void cross_edges(const SupportPolygon& a, std::size_t i, const SupportPolygon& b, std::size_t j,
                 double slack, const auto& add) {
    const std::size_t i1 = i + 1 == a.count ? 0 : i + 1;
    const std::size_t j1 = j + 1 == b.count ? 0 : j + 1;
    const double ux = a.x[i1] - a.x[i], uy = a.y[i1] - a.y[i];
    const double vx = b.x[j1] - b.x[j], vy = b.y[j1] - b.y[j];
    const double rx = b.x[j] - a.x[i], ry = b.y[j] - a.y[i];
    const double uu = ux * ux + uy * uy;
    const double vv = vx * vx + vy * vy;
    const double across = ux * vy - uy * vx;
    const auto add_at = [&](double s, double t) {
        add(a.x[i] + s * ux, a.y[i] + s * uy, a.h[i] + s * (a.h[i1] - a.h[i]),
            b.h[j] + t * (b.h[j1] - b.h[j]), a.edge_feature(i), b.edge_feature(j));
    };
    if (across * across > 1e-18 * uu * vv) {
        const double s = (rx * vy - ry * vx) / across;
        const double t = (rx * uy - ry * ux) / across;
        const auto is_beyond = [&](double share, double square) {
            const double over = std::max(-share, share - 1.0);
            return over > 0.0 && over * over * square > slack * slack;
        };
        if (is_beyond(s, uu) || is_beyond(t, vv)) return;
        add_at(std::clamp(s, 0.0, 1.0), std::clamp(t, 0.0, 1.0));
        return;
    }
    // Collinear edges: the ends of their common interval.
    if (uu == 0.0 || vv == 0.0) return;
    if (std::abs(rx * uy - ry * ux) > slack * std::sqrt(uu)) return;
    const auto on_a = [&](double t) { return ((rx + t * vx) * ux + (ry + t * vy) * uy) / uu; };
    const auto on_b = [&](double s) { return ((s * ux - rx) * vx + (s * uy - ry) * vy) / vv; };
    for (const double end : {0.0, 1.0}) {
        if (const double t = on_b(end); t >= 0.0 && t <= 1.0) add_at(end, t);
        if (const double s = on_a(end); s >= 0.0 && s <= 1.0) add_at(s, end);
    }
}

void intersect(const Core& a, const Core& b, const ContactPlane& plane, const SupportPolygon& of_a,
               const SupportPolygon& of_b, Manifold& manifold) {
    const double radii = a.radius + b.radius;
    const double size = a.reach + b.reach;
    const double slack = 1e-11 * size;
    const auto add = [&](double x, double y, double height_a, double height_b,
                         const ShapeFeature& feature_a, const ShapeFeature& feature_b) {
        manifold.add(plane.at(x, y, height_a - a.radius), height_b - height_a + radii, feature_a,
                     feature_b);
    };
    for (std::size_t i = 0; i < of_a.count; ++i) {
        if (!of_b.contains(of_a.x[i], of_a.y[i], slack)) continue;
        add(of_a.x[i], of_a.y[i], of_a.h[i], of_b.height(of_a.x[i], of_a.y[i]),
            of_a.vertex_feature(i), of_b.face_feature());
    }
    for (std::size_t j = 0; j < of_b.count; ++j) {
        if (!of_a.contains(of_b.x[j], of_b.y[j], slack)) continue;
        add(of_b.x[j], of_b.y[j], of_a.height(of_b.x[j], of_b.y[j]), of_b.h[j], of_a.face_feature(),
            of_b.vertex_feature(j));
    }
    // An edge has one side, a vertex none.
    const auto sides = [](const SupportPolygon& p) { return p.count < 3 ? p.count - 1 : p.count; };
    for (std::size_t i = 0; i < sides(of_a); ++i) {
        for (std::size_t j = 0; j < sides(of_b); ++j) {
            cross_edges(of_a, i, of_b, j, slack, add);
        }
    }
}

}  // namespace

void intersect_support_features(const Core& a, const Core& b, const Eigen::Vector3d& normal,
                                Manifold& manifold) {
    const ContactPlane plane(normal);
    intersect(a, b, plane, SupportPolygon(a, plane, -1.0), SupportPolygon(b, plane, 1.0), manifold);
}

void find_core_contacts(const Core& a, const Core& b, const Gap& gap, Manifold& manifold) {
    const ContactPlane plane(gap.normal);
    const SupportPolygon of_a(a, plane, -1.0);
    const SupportPolygon of_b(b, plane, 1.0);
    intersect(a, b, plane, of_a, of_b, manifold);
    const double radii = a.radius + b.radius;
    const double size = a.reach + b.reach;
    // The deepest contact may be missing: vertex on vertex, or on a face that is too steep for a support face.
    if (manifold.has_depth(-gap.distance - 1e-9 * (size + radii))) return;
    Eigen::Vector3d on_a = gap.core_a;
    if (!gap.has_points) {
        const std::uint32_t vertex = find_extreme(a.shape, a.to_body(-gap.normal));
        on_a = a.vertex(vertex);
    }
    manifold.add(on_a - a.radius * gap.normal, -gap.distance, of_a.vertex_feature(0),
                 of_b.vertex_feature(0));
}

}  // namespace terrane::internal
