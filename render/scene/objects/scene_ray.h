// SPDX-License-Identifier: MIT
#pragma once

#include "objects/cluster_set.h"

#include <terrane/scene/object_model.h>
#include <terrane/scene/scene.h>

#include <optional>
#include <span>

namespace terrane::internal {

/// The first object that a segment meets; of several at once, the first one in the order of groups and clusters.
///
/// @param models by ObjectCluster::model
std::optional<SceneHit> find_hit(const ClusterSet& clusters, std::span<const ObjectModel> models,
                                 const WorldPos& from_world, const WorldPos& to_world);

}  // namespace terrane::internal
