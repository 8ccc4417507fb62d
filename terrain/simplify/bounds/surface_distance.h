// SPDX-License-Identifier: MIT
#pragma once

#include "base/triangle_distance.h"
#include "base/vector_math.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>

namespace terrane::internal {

/// Largest distance of a point of one triangle from another one, rounded up: at a corner, because the distance from a
/// convex set is convex.
double largest_distance(const Corners& from, const Corners& to);

/// Splits a triangle into parts until each part is as near to one triangle of a set as it will be, and returns the
/// largest of the parts' distances, an upper bound of the distance of the triangle's points from the set.
///
/// @param limit   no more parts where the bound is above this
/// @param nearest double(const Corners& part): least largest_distance() from a part to a triangle of the set
template <class Nearest>
double distance_to_set(const Corners& triangle, double limit, const Nearest& nearest) {
    // Parts shorter than this share of their distance would change it little.
    constexpr double kShortPart = 0.5;
    constexpr int kMostSplits = 2;
    struct Part {
        Corners corners;
        int splits;
    };
    // Depth first: a part leaves three others behind on each level.
    std::array<Part, 3 * kMostSplits + 1> stack;
    std::size_t count = 0;
    stack[count++] = {triangle, 0};
    double largest = 0.0;
    while (count > 0 && largest <= limit) {
        const Part part = stack[--count];
        const Corners& c = part.corners;
        const double distance = nearest(c);
        if (distance <= largest) continue;
        double longest = 0.0;
        for (std::size_t i = 0; i < 3; ++i)
            longest = std::max(longest, length(c[(i + 1) % 3] - c[i]));
        if (part.splits == kMostSplits || longest < kShortPart * distance) {
            largest = distance;
            continue;
        }
        const Eigen::Vector3d a = 0.5 * (c[0] + c[1]), b = 0.5 * (c[1] + c[2]),
                              d = 0.5 * (c[2] + c[0]);
        for (const Corners& quarter :
             {Corners{c[0], a, d}, Corners{a, c[1], b}, Corners{d, b, c[2]}, Corners{a, b, d}})
            stack[count++] = {quarter, part.splits + 1};
    }
    return largest;
}

}  // namespace terrane::internal
