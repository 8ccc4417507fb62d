// SPDX-License-Identifier: MIT
#include "pairs/kernels/support_polygon.h"

#include <algorithm>
#include <limits>

namespace terrane::internal {

SupportPolygon::SupportPolygon(const Core& core, const ContactPlane& plane, double side) {
    // Least cosine of a support face with the normal; a steeper face is replaced by its edge.
    constexpr double kSteep = 0.05;
    constexpr double kLevel = 1e-8;
    constexpr double kNone = std::numeric_limits<double>::infinity();
    const Polyhedron& shape = core.shape;
    const Eigen::Vector3d direction = core.to_body(side * plane.normal);
    const std::uint32_t vertex = find_extreme(shape, direction);

    // Squared sine of an edge's slope, for edges that end at the support vertex. Vertices of a flat box may coincide.
    const auto slope_of = [&](const Polyhedron::Edge& e) {
        const Eigen::Vector3d& from = shape.vertices[e.from];
        const Eigen::Vector3d& to = shape.vertices[e.to];
        const Eigen::Vector3d& here = shape.vertices[vertex];
        if (from == to || (from != here && to != here)) return kNone;
        const double rise = dot(to - from, direction);
        return rise * rise / dot(to - from, to - from);
    };
    double lowest = kNone;
    const Polyhedron::Edge* edge = nullptr;
    for (const Polyhedron::Edge& e : shape.edges) {
        const double slope = slope_of(e);
        if (slope < lowest) {
            lowest = slope;
            edge = &e;
        }
    }
    // Where an edge is level the support face must be adjacent to a level edge.
    const double steepest = lowest < kLevel * kLevel ? kLevel * kLevel : kNone;
    double flattest = kSteep;
    for (const Polyhedron::Edge& e : shape.edges) {
        if (e.left == Polyhedron::kNoFace || !(slope_of(e) < steepest)) continue;
        for (const std::uint32_t f : {e.left, e.right}) {
            const double cosine = dot(direction, shape.faces[f].normal);
            if (cosine > flattest || (is_face && cosine == flattest && f < face)) {
                flattest = cosine;
                face = f;
                is_face = true;
            }
        }
    }
    const auto add = [&](std::uint32_t i) {
        const Eigen::Vector3d p = core.vertex(i);
        x[count] = dot(plane.x, p);
        y[count] = dot(plane.y, p);
        h[count] = dot(plane.normal, p);
        index[count] = i;
        ++count;
    };
    if (!is_face) {
        if (edge == nullptr) {
            add(vertex);
        } else {
            add(edge->from);
            add(edge->to);
        }
        return;
    }
    const Polyhedron::Face& f = shape.faces[face];
    const std::size_t stride = (f.count + kMost - 1) / kMost;
    // Thinning keeps the support vertex.
    std::size_t start = 0;
    while (shape.loops[f.first + start] != vertex && start + 1 < f.count) ++start;
    for (std::size_t k = 0; k < f.count; k += stride) {
        add(shape.loops[f.first + (start + k) % f.count]);
    }
    // normal . p = offset, with p = px x + py y + height n.
    const Eigen::Vector3d m = core.to_axes(f.normal);
    const double offset = f.offset + dot(m, core.centre);
    const double across = dot(m, plane.normal);
    base = offset / across;
    slope_x = -dot(m, plane.x) / across;
    slope_y = -dot(m, plane.y) / across;
    turn_ = side;
    low_x_ = *std::min_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(count));
    high_x_ = *std::max_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(count));
    low_y_ = *std::min_element(y.begin(), y.begin() + static_cast<std::ptrdiff_t>(count));
    high_y_ = *std::max_element(y.begin(), y.begin() + static_cast<std::ptrdiff_t>(count));
}

bool SupportPolygon::contains(double px, double py, double slack) const {
    // The bounding box also limits faces without area.
    if (!is_face || px < low_x_ - slack || px > high_x_ + slack || py < low_y_ - slack ||
        py > high_y_ + slack) {
        return false;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t j = i + 1 == count ? 0 : i + 1;
        const double ex = x[j] - x[i];
        const double ey = y[j] - y[i];
        const double inside = turn_ * (ex * (py - y[i]) - ey * (px - x[i]));
        if (inside < 0.0 && inside * inside > slack * slack * (ex * ex + ey * ey)) return false;
    }
    return true;
}

ShapeFeature SupportPolygon::edge_feature(std::size_t i) const {
    const std::size_t j = i + 1 == count ? 0 : i + 1;
    return {std::min(index[i], index[j]), std::max(index[i], index[j])};
}

}  // namespace terrane::internal
