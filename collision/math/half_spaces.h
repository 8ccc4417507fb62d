// SPDX-License-Identifier: MIT
#pragma once

#include "math/vector_math.h"

#include <array>
#include <cstddef>

namespace terrane::internal {

/// Translations that part two things along one direction: normal . d >= depth.
struct HalfSpace {
    Eigen::Vector3d normal;
    double depth;
};

/// A few half-spaces, in the order in which they came.
struct HalfSpaces {
    static constexpr std::size_t kMost = 48;
    std::array<HalfSpace, kMost> planes;
    std::size_t count = 0;

    /// Drops the oldest where it is full.
    void add(const HalfSpace& plane);
};

/// The shortest translation inside all half-spaces. False where there is none.
bool find_shortest(const HalfSpaces& spaces, Eigen::Vector3d& d_out);

}  // namespace terrane::internal
