// SPDX-License-Identifier: MIT
#include "simplify/bounds/triangle_bound.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kRoundedUp = 1.0 + 0x1p-44;

// Largest value of a w0 w1 + b w1 w2 + c w2 w0 where w >= 0 and their sum is 1.
double largest_on_triangle(double a, double b, double c) {
    const double most = std::max({a, b, c}), least = std::min({a, b, c});
    double largest = 0.25 * most;
    // Here the differences below would round too much.
    if (least < most * 0x1p-6) return largest + 0.25 * least;
    // The stationary place has weights in these ratios; outside of the triangle the largest value is on an edge.
    const double w0 = b * (a + c - b), w1 = c * (a + b - c), w2 = a * (b + c - a);
    if (std::min({w0, w1, w2}) > 0.0) largest = std::max(largest, a * b * c / (w0 + w1 + w2));
    return largest;
}

}  // namespace

void TriangleBound::include(double distance) {
    constant = std::max(constant, distance);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], -distance);
        high[axis] = std::max(high[axis], distance);
    }
}

double TriangleBound::largest() const {
    double square = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double far = std::max(std::abs(low[axis]), std::abs(high[axis]));
        square += far * far;
    }
    const double by_edges = constant + largest_on_triangle(edges[0], edges[1], edges[2]);
    return std::min(std::sqrt(square), by_edges) * kRoundedUp;
}

}  // namespace terrane::internal
