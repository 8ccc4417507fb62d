// SPDX-License-Identifier: MIT
#pragma once

#include "proxy/solid_cells.h"

#include <span>

namespace terrane::internal {

/// A lower bound of the distance between a mesh and any proxy whose hulls contain the parts, each part in one of them,
/// and of the same after vertices of these hulls are left out: metres, 0 where none is known.
double least_error(const SolidMesh& solid, std::span<const ProxyPart> parts);

}  // namespace terrane::internal
