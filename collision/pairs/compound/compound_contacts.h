// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/compound/part_pairs.h"

namespace terrane::internal {

struct CompoundContacts {
    std::size_t count = 0;      ///< written, deepest first
    bool is_truncated = false;  ///< there was no room for all
};

/// Contacts of all pairs of parts, points from the common origin. At most four of one normal, and of
/// kMostNormals normals.
///
/// Overlapping shapes are looked at where they just touch: what they would touch with there are the
/// contacts, with the depths that are missing. So the parts of a floor do not push along their seams.
///
/// @param margin gaps up to it too
CompoundContacts find_compound_contacts(const PlacedShape& a, const PlacedShape& b, double margin,
                                        double touch, std::span<PairContact> contacts_out);

}  // namespace terrane::internal
