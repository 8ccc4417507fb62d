// SPDX-License-Identifier: MIT
#include "ground/lift/underside.h"

#include <cmath>
#include <limits>

namespace terrane::internal {

Underside::Underside(const LocalShape& shape) : shape_(shape) {
    const Eigen::Vector3d& c = shape.centre;
    if (shape.kind != ShapeKind::round) {
        visit_down_planes(shape, [&](const Eigen::Vector3d& n, double drop) {
            // the shape lies above the plane n . (p - c) = -drop
            if (n[2] < 1e-6) return;
            const double x = -n[0] / n[2];
            const double y = -n[1] / n[2];
            planes_[count_++] = {x, y, c[2] - drop / n[2] - x * c[0] - y * c[1]};
        });
        if (shape.kind == ShapeKind::box) {
            for (const Eigen::Vector3d& axis : shape.axes) add_strip_along(axis[0], axis[1]);
        } else if (shape.hull->is_narrow) {
            add_strip(shape.hull->strip);
        }
        return;
    }
    run_ = std::sqrt(shape.core[0] * shape.core[0] + shape.core[1] * shape.core[1]);
    core_length_ = length(shape.core);
}

void Underside::add_strip(const LocalHull::Strip& strip) {
    constexpr double kSlack = 1e-9;        // metres
    constexpr double kRounding = 0x1p-46;  // share of the size
    const double size = std::sqrt(strip.x * strip.x + strip.y * strip.y);
    const double slack = (kSlack + kRounding * (shape_.bounds[0] + shape_.bounds[1])) * size;
    strips_[strip_count_++] = {strip.x, strip.y, strip.low - slack, strip.high + slack};
}

// Adds the strip of a box along one of its axes.
void Underside::add_strip_along(double axis_x, double axis_y) {
    if (!(axis_x * axis_x + axis_y * axis_y > 1e-18))
        return;  // upright: the others make the outline
    const double x = -axis_y;
    const double y = axis_x;
    double reach = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& axis = shape_.axes[i];
        reach += std::abs(x * axis[0] + y * axis[1]) * shape_.half[static_cast<Eigen::Index>(i)];
    }
    add_strip({x, y, -reach, reach});
}

double Underside::round_bottom(const CellPrism& prism) const {
    constexpr double kSlack = 1e-9;  // metres
    const LocalShape& shape = shape_;
    const Eigen::Vector3d& c = shape.centre;
    double bottom = c[2] - shape.bounds[2];
    const double west = std::max(prism.west, c[0] - shape.bounds[0]) - c[0];
    const double east = std::min(prism.east, c[0] + shape.bounds[0]) - c[0];
    const double south = std::max(prism.south, c[1] - shape.bounds[1]) - c[1];
    const double north = std::min(prism.north, c[1] + shape.bounds[1]) - c[1];
    const double run = run_;
    if (run > 1e-3 * core_length_) {
        // The infinite cylinder around the core: lowest where the rectangle is nearest to its axis.
        const double ux = shape.core[0] / run;
        const double uy = shape.core[1] / run;
        const double across_low =
            std::min(-uy * west, -uy * east) + std::min(ux * south, ux * north);
        const double across_high =
            std::max(-uy * west, -uy * east) + std::max(ux * south, ux * north);
        // Slightly nearer, so that rounding loses nothing at a seam.
        const double across = std::max({0.0, across_low - kSlack, -across_high - kSlack});
        if (across > shape.radius) return std::numeric_limits<double>::infinity();
        const double slope = shape.core[2] / run;
        const double along_low = std::min(ux * west, ux * east) + std::min(uy * south, uy * north);
        const double along_high = std::max(ux * west, ux * east) + std::max(uy * south, uy * north);
        const double drop =
            std::sqrt(shape.radius * shape.radius - across * across) * (core_length_ / run);
        bottom = std::max(bottom, c[2] + std::min(slope * along_low, slope * along_high) - drop);
    }
    // The sphere around the whole core, at the rectangle's nearest point.
    const double x = std::max({0.0, west, -east});
    const double y = std::max({0.0, south, -north});
    const double reach = shape.radius + core_length_;
    const double square = reach * reach - x * x - y * y;
    if (square < 0.0) return std::numeric_limits<double>::infinity();
    return std::max(bottom, c[2] - std::sqrt(square));
}

}  // namespace terrane::internal
