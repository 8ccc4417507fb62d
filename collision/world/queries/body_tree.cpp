// SPDX-License-Identifier: MIT
// Sources: C. Ericson. Real-time collision detection. 2005, sections 5.5.8 (moving boxes) and 6.3 (traversals).
#include "world/queries/body_tree.h"

#include "base/boxes.h"
#include "base/vector_math.h"

#include <terrane/terrain/assert.h>

#include <algorithm>

namespace terrane::internal {

double box_separation(const Aabb& a, const Aabb& b) {
    Eigen::Vector3d apart;
    bool is_apart = false;
    for (int axis = 0; axis < 3; ++axis) {
        apart[axis] = std::max({0.0, a.low[axis] - b.high[axis], b.low[axis] - a.high[axis]});
        is_apart |= apart[axis] > 0.0;
    }
    return is_apart ? length(apart) : -kInfinity;
}

void BodyTree::take(std::span<const Aabb> bounds) {
    const Aabb empty = empty_box();
    boxes_.resize(bounds.size());
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        boxes_[i] = is_box(bounds[i]) ? bounds[i] : empty;
    }
}

void BodyTree::build(std::span<const Aabb> bounds) {
    take(bounds);
    build_aabb_tree(boxes_, order_, nodes_);
}

void BodyTree::refit(std::span<const Aabb> bounds) {
    TERRANE_ASSERT(bounds.size() == slot_count(), "as many boxes as the tree was built of");
    take(bounds);
    refit_aabb_tree(boxes_, nodes_);
}

}  // namespace terrane::internal
