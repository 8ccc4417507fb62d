// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/placed_shape.h"

namespace terrane::internal {

struct CompoundCast {
    bool hit = false;
    double fraction = 1.0;
    bool started_in_contact = false;
};

/// The earliest hit of all pairs of parts, which rotate about their bodies' origins.
///
/// @param motion_a start.rotation is orthonormal; the same for motion_b
CompoundCast cast_compounds(const ShapeView& a, const Motion& motion_a, const ShapeView& b,
                            const Motion& motion_b, const CastSettings& settings);

}  // namespace terrane::internal
