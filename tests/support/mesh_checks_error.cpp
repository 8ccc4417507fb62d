// SPDX-License-Identifier: MIT
// Measures the displayed error of meshes by brute force.
// Sources: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (R2).
#include "mesh_checks.h"

#include <algorithm>
#include <cmath>

namespace terrane::test {
namespace {

using Corners = std::array<WorldPos, 3>;

// Screen errors of single points of one view.
class PointErrors {
public:
    PointErrors(const HeightSource& source, const View& view, double allowed_m = 0.0)
        : source_(source),
          allowed_(allowed_m),
          eye_(view.eye_world),
          near_(view.near_distance),
          pixels_(view.pixels_per_radian()),
          frustum_(make_frustum(view)) {}

    // Compares a displayed point with the true surface.
    void add(const WorldPos& shown_world) {
        if (!source_.extent().contains(shown_world.x(), shown_world.y())) return;
        const double truth = source_.height(shown_world.x(), shown_world.y());
        const Eigen::Vector3d from_eye = WorldPos(shown_world.x(), shown_world.y(), truth) - eye_;
        for (const Eigen::Vector3d& normal : frustum_.normals) {
            if (normal.dot(from_eye) < 0.0) return;
        }
        const double metres = std::abs(shown_world.z() - truth) - allowed_;
        const double error = metres * pixels_ / std::max(near_, from_eye.norm());
        if (!(error <= worst_) && !std::isnan(worst_)) worst_ = error;  // NaN stays
    }

    // Whether a true point over the box of a triangle may be inside the side planes.
    bool may_see(const Corners& corners) const {
        const WorldPos low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
        const WorldPos high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
        const HeightInterval z = source_.interval({low.x(), low.y(), high.x(), high.y()});
        const auto is_before = [&](const Eigen::Vector3d& normal) {
            const WorldPos corner(normal.x() > 0.0 ? high.x() : low.x(),
                                  normal.y() > 0.0 ? high.y() : low.y(),
                                  normal.z() > 0.0 ? z.high : z.low);
            const Eigen::Vector3d from_eye = corner - eye_;
            return normal.dot(from_eye) >= -1e-9 * from_eye.norm();
        };
        return std::all_of(frustum_.normals.begin(), frustum_.normals.end(), is_before);
    }

    double worst() const { return worst_; }

private:
    const HeightSource& source_;
    double allowed_;
    WorldPos eye_;
    double near_, pixels_;
    Frustum frustum_;
    double worst_ = 0.0;
};

Corners corners_of(const SoupTriangle& triangle, const Lattice& lattice) {
    return {displayed(triangle[0], lattice), displayed(triangle[1], lattice),
            displayed(triangle[2], lattice)};
}

// Adds the points of a net, in units of its own mesh width, that lie in a triangle, edges included.
void add_net(const SoupTriangle& triangle, const Lattice& lattice, int per_side,
             PointErrors& errors) {
    const Corners corners = corners_of(triangle, lattice);
    if (!errors.may_see(corners)) return;
    std::array<Eigen::Vector2d, 3> net;
    for (std::size_t k = 0; k < 3; ++k) {
        net[k] = {static_cast<double>(triangle[k].point.x * per_side),
                  static_cast<double>(triangle[k].point.y * per_side)};
    }
    const Eigen::Vector2d b = net[1] - net[0], c = net[2] - net[0];
    const double area = b.x() * c.y() - b.y() * c.x();
    const double south = std::min({net[0].y(), net[1].y(), net[2].y()});
    const double north = std::max({net[0].y(), net[1].y(), net[2].y()});
    for (double y = south + 0.5; y < north; y += 1.0) {
        double west = std::max({net[0].x(), net[1].x(), net[2].x()});
        double east = std::min({net[0].x(), net[1].x(), net[2].x()});
        for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector2d& from = net[k];
            const Eigen::Vector2d& to = net[(k + 1) % 3];
            if ((y < from.y()) == (y < to.y())) continue;
            const double x = from.x() + (y - from.y()) * (to.x() - from.x()) / (to.y() - from.y());
            west = std::min(west, x);
            east = std::max(east, x);
        }
        for (double x = std::ceil(west - 0.5) + 0.5; x <= east; x += 1.0) {
            const double px = x - net[0].x(), py = y - net[0].y();
            const double u = (px * c.y() - py * c.x()) / area;
            const double v = (b.x() * py - b.y() * px) / area;
            errors.add(corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]));
        }
    }
}

}  // namespace

double measure_error_px(const std::vector<SoupTriangle>& soup, const HeightSource& source,
                        const View& view, int per_triangle, double allowed_m) {
    PointErrors errors(source, view, allowed_m);
    for (std::size_t t = 0; t < soup.size(); ++t) {
        const Corners corners = corners_of(soup[t], source.lattice());
        for (int i = 0; i < per_triangle; ++i) {
            // another part of the sequence for each triangle, folded into it
            const double k = static_cast<double>(i) + 0.5 + 0.137 * static_cast<double>(t % 97);
            double u = k * 0.7548776662466927;
            double v = k * 0.5698402909980532;
            u -= std::floor(u);
            v -= std::floor(v);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            errors.add(corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]));
        }
    }
    return errors.worst();
}

double measure_error_px_everywhere(const std::vector<SoupTriangle>& soup,
                                   const HeightSource& source, const View& view, int per_side) {
    PointErrors errors(source, view);
    for (const SoupTriangle& triangle : soup) {
        add_net(triangle, source.lattice(), per_side, errors);
    }
    return errors.worst();
}

}  // namespace terrane::test
