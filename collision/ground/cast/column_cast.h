// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/ground_cast.h>

namespace terrane::internal::columns {

/// cast() of ground_cast.h against the heightfield alone.
CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings);

}  // namespace terrane::internal::columns
