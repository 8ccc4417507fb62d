// SPDX-License-Identifier: MIT
#include "graph/world_place.h"

namespace terrane::internal {

WorldPlace turned(const BillboardNode& billboard, const WorldPlace& place, const View& view) {
    WorldPlace turned = place;
    Eigen::Matrix3d& axes = turned.world_from_node.rotation;
    if (billboard.axis == BillboardNode::Axis::screen) {
        axes.col(0) = view.right();
        axes.col(1) = view.up;
        axes.col(2) = -view.forward;
        return turned;
    }
    const Eigen::Vector3d up = axes.col(2);
    const Eigen::Vector3d towards = view.eye_world - place.world_from_node.translation;
    const Eigen::Vector3d level = towards - up * up.dot(towards);
    const double length = level.norm();
    // The eye is on the axis: no rotation faces it, and the node keeps its own.
    if (!(length > 1e-9 * towards.norm())) return turned;
    axes.col(0) = level / length;
    axes.col(1) = up.cross(Eigen::Vector3d(axes.col(0)));
    return turned;
}

}  // namespace terrane::internal
