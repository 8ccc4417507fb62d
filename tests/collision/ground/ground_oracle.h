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

using HeightFunction = std::function<double(double, double)>;

/// Pseudorandom height of a lattice point, in [0, 1).
inline double hash_height(double x, double y) {
    auto h = static_cast<std::uint32_t>(static_cast<std::int64_t>(x) * 73856093 ^
                                        static_cast<std::int64_t>(y) * 19349663);
    h = (h ^ (h >> 16)) * 0x7feb352du;
    h = (h ^ (h >> 15)) * 0x846ca68bu;
    return static_cast<double>(h ^ (h >> 16)) / 4294967296.0;
}

/// A named height function.
struct Scene {
    const char* name;
    HeightFunction height;
};

/// Grounds over [0, 128]^2 with 1 m cells, each difficult in a different way.
inline std::vector<Scene> make_scenes() {
    return {
        {"plane", [](double x, double y) { return 0.25 * x - 0.5 * y; }},
        {"stairs", [](double x, double) { return std::floor(x / 4.0) * 0.5; }},
        {"spikes",
         [](double x, double y) {
             return std::fmod(x, 5.0) == 0.0 && std::fmod(y, 5.0) == 0.0 ? 3.0 : 0.0;
         }},
        {"ridges", [](double x, double) { return std::abs(std::fmod(x, 4.0) - 2.0); }},
        {"walls", [](double x, double) { return std::fmod(x, 8.0) == 0.0 ? 5.0 : 0.0; }},
        {"pits",
         [](double x, double y) {
             return std::fmod(x, 6.0) == 0.0 && std::fmod(y, 6.0) == 0.0 ? -4.0 : 0.0;
         }},
        {"rough", [](double x, double y) { return hash_height(x, y); }},
    };
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
            if (c.status != GroundStatus::ok) continue;
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

/// Lift of a box over one triangle: the largest over its faces.
inline double clip_box_lift(const Eigen::Vector3d& half, const Pose& pose,
                            const Corners& triangle) {
    double lift = -std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-1.0, 1.0}) {
            std::vector<Eigen::Vector3d> polygon;
            for (int k = 0; k < 4; ++k) {
                Eigen::Vector3d p;
                p[axis] = side * half[axis];
                p[(axis + 1) % 3] = (k == 0 || k == 3 ? -1.0 : 1.0) * half[(axis + 1) % 3];
                p[(axis + 2) % 3] = (k < 2 ? -1.0 : 1.0) * half[(axis + 2) % 3];
                polygon.push_back(pose * p);
            }
            lift = std::max(lift, clip_polygon_lift(polygon, triangle));
        }
    }
    return lift;
}

/// Largest surface height minus z over sampled points of a round shape. It is at most the lift, and less by at most
/// slope times sample distance.
inline double sample_round_lift(const Shape& shape, const Pose& pose, const Ground& ground,
                                int steps) {
    double radius = 0.0, half = 0.0;
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) radius = sphere->radius;
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        radius = capsule->radius;
        half = capsule->half_height;
    }
    double lift = -std::numeric_limits<double>::infinity();
    for (int i = 0; i <= steps; ++i) {
        const double z = -1.0 + 2.0 * i / steps;
        for (int j = 0; j < steps; ++j) {
            const double angle = 6.283185307179586 * j / steps;
            const double ring = std::sqrt(1.0 - z * z);
            const Eigen::Vector3d n(ring * std::cos(angle), ring * std::sin(angle), z);
            for (int k = 0; k <= (half > 0.0 ? 20 : 0); ++k) {
                const Eigen::Vector3d core(0.0, 0.0, half * (-1.0 + 0.1 * k));
                const Eigen::Vector3d p = pose * core + radius * n;
                const HeightAnswer height = ground.height(p.x(), p.y());
                if (height.status == GroundStatus::ok) lift = std::max(lift, height.height - p.z());
            }
        }
    }
    return lift;
}

}  // namespace terrane::test
