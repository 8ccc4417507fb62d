// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/scene_graph.h>

namespace terrane::internal {

/// Fails: invalid_argument, naming the value, for a place out of range
Result<void> check_place(const NodePlace& place);
/// Fails: invalid_argument, naming the value, for content out of range
Result<void> check_content(const NodeContent& content);

}  // namespace terrane::internal
