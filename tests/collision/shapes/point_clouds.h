// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <vector>

// Point sets whose hulls are difficult for different reasons; all are drawn from a Random, so that a seed reproduces
// them.
namespace terrane::test {

using Points = std::vector<Eigen::Vector3d>;

inline Points ball(Random& random, int count) {
    Points points;
    for (int i = 0; i < count; ++i) points.push_back(random.between(0.0, 1.0) * random.direction());
    return points;
}

inline Points sphere(Random& random, int count) {
    Points points;
    for (int i = 0; i < count; ++i) points.push_back(random.direction());
    return points;
}

/// The points of an n^3 grid: nearly all are coplanar or collinear with others.
inline Points grid(int n) {
    Points points;
    for (int i = 0; i < n * n * n; ++i) points.emplace_back(i % n, i / n % n, i / n / n);
    return points;
}

/// Points with small integer coordinates, many of them symmetric, coplanar or coincident.
inline Points integers(Random& random, int count, int highest) {
    Points points;
    const auto draw = [&] { return std::floor(random.between(0.0, highest + 1.0)); };
    // Braces fix the order of evaluation on every compiler.
    for (int i = 0; i < count; ++i) points.push_back(Eigen::Vector3d{draw(), draw(), draw()});
    return points;
}

/// Two regular polygons with count / 2 corners each.
inline Points prism(int count, double height) {
    Points points;
    for (int i = 0; i < count / 2; ++i) {
        const double angle = 4.0 * 3.14159265358979323846 * i / count;
        for (const double z : {-0.5 * height, 0.5 * height}) {
            points.emplace_back(std::cos(angle), std::sin(angle), z);
        }
    }
    return points;
}

inline Points polygon(int count) {
    Points points = prism(2 * count, 0.0);
    for (std::size_t i = 0; i < points.size() / 2; ++i) points[i] = points[2 * i];
    points.resize(points.size() / 2);
    return points;
}

inline Points transformed(Points points, double scale, const Eigen::Matrix3d& rotation,
                          const Eigen::Vector3d& offset = Eigen::Vector3d::Zero()) {
    for (Eigen::Vector3d& p : points) p = rotation * (scale * p) + offset;
    return points;
}

inline Points stretched(Points points, const Eigen::Vector3d& factors) {
    for (Eigen::Vector3d& p : points) p = p.cwiseProduct(factors);
    return points;
}

}  // namespace terrane::test
