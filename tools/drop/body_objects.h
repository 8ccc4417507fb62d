// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/bodies.h>
#include <terrane/render/terrain_renderer.h>

#include <vector>

namespace terrane::tools {

/// Adds what is drawn of a body: of a hull its edges. What sleeps is darker.
void add_objects(const Shape& shape, const BodyState& state, std::vector<DrawnObject>& objects);

}  // namespace terrane::tools
