// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"

#include <array>
#include <cstddef>

namespace terrane::internal {

/// Translations d with normal . d >= depth: those that separate two convex sets along a direction.
struct HalfSpace {
    Eigen::Vector3d normal;  ///< unit
    double depth;            ///< metres
};

/// Up to kMost half-spaces, in the order of arrival.
struct HalfSpaces {
    static constexpr std::size_t kMost = 48;
    std::array<HalfSpace, kMost> planes;
    std::size_t count = 0;

    /// Removes the oldest one where it is full.
    void add(const HalfSpace& plane);
};

/// The shortest translation inside all half-spaces. False where their intersection is empty.
bool find_shortest(const HalfSpaces& spaces, Eigen::Vector3d& d_out);

}  // namespace terrane::internal
