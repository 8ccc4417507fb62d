// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/value_parsing.h"

#include <terrane/collision/shapes.h>

namespace terrane::tools {

/// Parses the shape at `key` of an object: `{"sphere":{"radius":r}}`, `{"capsule":{"radius":r,"half_height":h}}`,
/// `{"box":{"half_extents":[..]}}`, `{"hull":{"points":[[..]..]}}` or
/// `{"compound":[{"shape":S,"position":..,"rotation":..}..]}`. Parts of a compound cannot be compounds; a
/// part without a position is at the origin.
Parsed<Shape> read_shape(const nlohmann::ordered_json& object, const char* key);

}  // namespace terrane::tools
