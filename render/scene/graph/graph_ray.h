// SPDX-License-Identifier: MIT
#pragma once

#include "graph/node_store.h"

#include <optional>

namespace terrane::internal {

/// The first geometry that a segment meets: see SceneGraph::ray().
///
/// @param nodes updates their bounds
/// @param view  that billboards face; null: what is below them is not met
std::optional<NodeHit> find_hit(NodeStore& nodes, const View* view, const WorldPos& from_world,
                                const WorldPos& to_world);

}  // namespace terrane::internal
