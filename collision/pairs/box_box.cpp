// SPDX-License-Identifier: MIT
// Sources: S. Gottschalk, M. Lin, D. Manocha. OBBTree. 1996 (the separating axis test with 15 axes).
#include "pairs/pairs.h"

#include <array>

namespace terrane::internal {
namespace {

// The axis of the largest gap: three face normals of each box and all cross products of edges, each of which is a facet
// normal of the Minkowski difference. Works in a's frame.
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
            if (square < 1e-20) continue;  // nearly parallel: faces are as good
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
    // The 15 axes first: where the boxes overlap clearly they decide without GJK.
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
