// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/scene_graph.h>
#include <terrane/terrain/view.h>

namespace terrane::internal {

/// Transform from a node's frame to the world frame.
struct WorldPlace {
    Pose world_from_node;
    double scale = 1.0;

    WorldPlace operator*(const NodePlace& place) const {
        const Pose& inner = place.parent_from_node;
        return {{world_from_node.rotation * inner.rotation,
                 world_from_node * Eigen::Vector3d(scale * inner.translation)},
                scale * place.scale};
    }
};

/// The place of a billboard that faces a view.
WorldPlace turned(const BillboardNode& billboard, const WorldPlace& place, const View& view);

}  // namespace terrane::internal
