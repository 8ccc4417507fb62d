// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

namespace terrane::tools {

/// A point or vector of numbers of one precision.
template <class T>
using Point3 = std::array<T, 3>;

/// Squared distance of a point from a triangle, in the precision of its numbers.
///
/// Source: C. Ericson. Real-Time Collision Detection, 2005, 5.1.5: the regions of the corners, the edges and the face,
/// told apart by barycentric coordinates. Written for one precision at a time, so that two can be compared.
template <class T>
T squared_distance_to_triangle(const Point3<T>& p, const std::array<Point3<T>, 3>& corners) {
    const auto minus = [](const Point3<T>& a, const Point3<T>& b) {
        return Point3<T>{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    };
    const auto dot = [](const Point3<T>& a, const Point3<T>& b) {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const Point3<T>&a = corners[0], &b = corners[1], &c = corners[2];
    const Point3<T> ab = minus(b, a), ac = minus(c, a);
    const auto squared_to = [&](T v, T w) {
        Point3<T> off{};
        for (std::size_t i = 0; i < 3; ++i) off[i] = a[i] + v * ab[i] + w * ac[i] - p[i];
        return dot(off, off);
    };
    const Point3<T> ap = minus(p, a);
    const T d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return squared_to(0, 0);
    const Point3<T> bp = minus(p, b);
    const T d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return squared_to(1, 0);
    const T vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return squared_to(d1 / (d1 - d3), 0);
    const Point3<T> cp = minus(p, c);
    const T d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return squared_to(0, 1);
    const T vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return squared_to(0, d2 / (d2 - d6));
    const T va = d3 * d6 - d5 * d4;
    const T bc = (d4 - d3) + (d5 - d6);
    if (va <= 0 && d4 >= d3 && d5 >= d6) return squared_to((d5 - d6) / bc, (d4 - d3) / bc);
    const T sum = va + vb + vc;
    return squared_to(vb / sum, vc / sum);
}

}  // namespace terrane::tools
