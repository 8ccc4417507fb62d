// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

// Brute-force oracles that share no method with the library; grounds and shapes of random tests.
namespace terrane::test {

/// Pseudorandom height of a lattice point, in [0, 1).
inline double hash_height(double x, double y) {
    auto h = static_cast<std::uint32_t>(static_cast<std::int64_t>(x) * 73856093 ^
                                        static_cast<std::int64_t>(y) * 19349663);
    h = (h ^ (h >> 16)) * 0x7feb352du;
    h = (h ^ (h >> 15)) * 0x846ca68bu;
    return static_cast<double>(h ^ (h >> 16)) / 4294967296.0;
}

struct Scene {
    const char* name;
    Ground ground;
};

/// Grounds over [0, 128]^2 with 1 m cells, each difficult in a different way. Made once.
inline const std::vector<Scene>& scenes() {
    static const auto make = [](auto height) { return make_test_ground(height, 1.0, 1); };
    static const std::vector<Scene> made{
        {"plane", make([](double x, double y) { return 0.25 * x - 0.5 * y; })},
        {"stairs", make([](double x, double) { return std::floor(x / 4.0) * 0.5; })},
        {"spikes", make([](double x, double y) {
             return std::fmod(x, 5.0) == 0.0 && std::fmod(y, 5.0) == 0.0 ? 3.0 : 0.0;
         })},
        {"ridges", make([](double x, double) { return std::abs(std::fmod(x, 4.0) - 2.0); })},
        {"walls", make([](double x, double) { return std::fmod(x, 8.0) == 0.0 ? 5.0 : 0.0; })},
        {"pits", make([](double x, double y) {
             return std::fmod(x, 6.0) == 0.0 && std::fmod(y, 6.0) == 0.0 ? -4.0 : 0.0;
         })},
        {"rough", make(hash_height)}};
    return made;
}

inline std::vector<Shape> make_shapes() {
    return {Sphere{0.5}, Capsule{0.4, 0.8}, Box{Eigen::Vector3d(1.0, 1.5, 0.5)}};
}

/// A triangle of the contact surface, counter-clockwise seen from above.
using Corners = std::array<Eigen::Vector3d, 3>;

/// All triangles of the cells within a rectangle, in world coordinates.
inline std::vector<Corners> make_soup(const Ground& ground, double west, double south, double east,
                                      double north) {
    std::vector<Corners> soup;
    const double q = ground.lattice().quantum;
    for (std::int64_t row = ground.row_at(south) - 1; row <= ground.row_at(north); ++row) {
        for (std::int64_t column = ground.column_at(west) - 1; column <= ground.column_at(east);
             ++column) {
            const GroundCell c = ground.cell(column, row);
            if (c.status != QueryStatus::ok) continue;
            const double x0 = ground.cell_x(column), x1 = ground.cell_x(column + 1);
            const double y0 = ground.cell_y(row), y1 = ground.cell_y(row + 1);
            const Eigen::Vector3d sw(x0, y0, q * c.south_west), se(x1, y0, q * c.south_east);
            const Eigen::Vector3d nw(x0, y1, q * c.north_west), ne(x1, y1, q * c.north_east);
            if (((column + row) & 1) == 0) {
                soup.push_back({sw, se, ne});
                soup.push_back({sw, ne, nw});
            } else {
                soup.push_back({sw, se, nw});
                soup.push_back({se, ne, nw});
            }
        }
    }
    return soup;
}

/// Lift of a polygon over one triangle: the largest at a corner of the polygon clipped by the triangle's three vertical
/// planes. Segments and points are polygons with two corners and one.
inline double clip_polygon_lift(std::vector<Eigen::Vector3d> polygon, const Corners& triangle) {
    const Eigen::Vector3d n = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    double lift = -std::numeric_limits<double>::infinity();
    for (std::size_t e = 0; e < 3 && !polygon.empty(); ++e) {
        const Eigen::Vector3d& a = triangle[e];
        const Eigen::Vector3d& b = triangle[(e + 1) % 3];
        const auto inside = [&](const Eigen::Vector3d& p) {
            return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
        };
        std::vector<Eigen::Vector3d> kept;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Eigen::Vector3d& p = polygon[i];
            const Eigen::Vector3d& r = polygon[(i + 1) % polygon.size()];
            const double dp = inside(p), dr = inside(r);
            if (dp >= 0.0) kept.push_back(p);
            if ((dp >= 0.0) != (dr >= 0.0)) kept.push_back(p + dp / (dp - dr) * (r - p));
        }
        polygon = kept;
    }
    for (const Eigen::Vector3d& p : polygon) {
        const double height =
            triangle[0].z() -
            (n.x() * (p.x() - triangle[0].x()) + n.y() * (p.y() - triangle[0].y())) / n.z();
        lift = std::max(lift, height - p.z());
    }
    return lift;
}

}  // namespace terrane::test
