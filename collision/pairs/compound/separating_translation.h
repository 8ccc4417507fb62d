// SPDX-License-Identifier: MIT
#pragma once

#include "math/half_spaces.h"
#include "pairs/compound/part_pairs.h"

namespace terrane::internal {

/// A translation of a after which no two parts overlap by more than `touch`.
struct SeparatingTranslation {
    bool is_found = false;
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    double least = 0.0;  ///< lower bound: no shorter translation separates the shapes, metres

    /// The constraints, plane i between parts[i]; empty where the translation comes from another start.
    HalfSpaces spaces;
    std::array<std::array<std::uint32_t, 2>, HalfSpaces::kMost> parts{};
};

/// Adds the half-space of one overlapping pair of parts after the other. Fast, and exact for shallow overlaps; may
/// fail, or give a longer translation than the shortest.
///
/// @param deepest find_least_gap() of the shapes
SeparatingTranslation grow_separating_translation(const PlacedShape& a, const PlacedShape& b,
                                                  const PartGap& deepest, double touch);

/// The shortest translation found from many directions; always one that separates.
SeparatingTranslation find_separating_translation(const PlacedShape& a, const PlacedShape& b,
                                                  const PartGap& deepest, double touch);

}  // namespace terrane::internal
