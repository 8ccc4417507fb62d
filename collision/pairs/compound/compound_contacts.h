// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/compound/part_pairs.h"

namespace terrane::internal {

struct CompoundContacts {
    std::size_t count = 0;      ///< written, deepest first
    bool is_truncated = false;  ///< some contacts were dropped
};

/// Contacts of all pairs of parts, points relative to the common origin: at most four a normal, and 24 normals.
///
/// Overlapping shapes are evaluated after a separating translation, where they just touch; each depth is the component
/// of that translation along the normal. So the seams between a floor's parts cause no contacts.
///
/// @param margin gaps up to this are contacts too, metres
CompoundContacts find_compound_contacts(const PlacedShape& a, const PlacedShape& b, double margin,
                                        double touch, std::span<PairContact> contacts_out);

}  // namespace terrane::internal
