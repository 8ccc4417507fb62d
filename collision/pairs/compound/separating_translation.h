// SPDX-License-Identifier: MIT
#pragma once

#include "math/half_spaces.h"
#include "pairs/compound/part_pairs.h"

namespace terrane::internal {

/// A translation of a after which no two parts overlap by more than `touch`.
struct SeparatingTranslation {
    bool is_found = false;
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    double least = 0.0;  ///< no shorter translation parts the shapes, metres

    /// What decided, plane i between parts[i]; nothing where the translation was found from elsewhere.
    HalfSpaces spaces;
    std::array<std::array<std::uint32_t, 2>, HalfSpaces::kMost> parts{};
};

/// From inside: each pair of parts that stands in the translation is left by its own shortest way. Quick, and where
/// the overlap is shallow exact; may find nothing, or a longer translation than need be.
///
/// @param deepest find_least_gap() of the shapes
SeparatingTranslation grow_separating_translation(const PlacedShape& a, const PlacedShape& b, const PartGap& deepest,
                                 double touch);

/// The shortest translation that a search from many directions finds; always one that parts.
SeparatingTranslation find_separating_translation(const PlacedShape& a, const PlacedShape& b, const PartGap& deepest,
                     double touch);

}  // namespace terrane::internal
