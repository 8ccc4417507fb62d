// SPDX-License-Identifier: MIT
#include "pairs/compound/compound_ray.h"

#include "math/vector_math.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Fraction at which a segment of the body frame enters a box; infinity: never.
double entry_of(const Eigen::Vector3d& from, const Eigen::Vector3d& displacement, const Aabb& box,
                double slack) {
    double first = 0.0;
    double last = 1.0;
    for (int i = 0; i < 3; ++i) {
        const double low = box.low[i] - slack - from[i];
        const double high = box.high[i] + slack - from[i];
        if (displacement[i] == 0.0) {
            if (low > 0.0 || high < 0.0) return kInfinity;
            continue;
        }
        const double t0 = low / displacement[i];
        const double t1 = high / displacement[i];
        first = std::max(first, std::min(t0, t1));
        last = std::min(last, std::max(t0, t1));
    }
    return first <= last ? first : kInfinity;
}

}  // namespace

PartRay cast_ray(const PlacedShape& shape, const Eigen::Vector3d& from,
                 const Eigen::Vector3d& displacement) {
    PartRay best;
    if (shape.view->is_single()) {
        static_cast<ConvexRay&>(best) = cast_ray(shape.part(0), from, displacement);
        return best;
    }
    const Eigen::Vector3d start = rotated_back(shape.rotation, from - shape.centre);
    const Eigen::Vector3d displacement_body = rotated_back(shape.rotation, displacement);
    // Rounding, and the distance that counts as touching.
    const double slack = 2.0 * kTouchShare * shape.view->reach() +
                         1e-15 * (length(start) + length(displacement_body));
    const std::span<const PartNode> tree = shape.view->tree();
    struct Entry {
        std::uint32_t node;
        double fraction;
    };
    std::array<Entry, PartNode::kMaxDepth + 1> stack;
    std::size_t count = 0;
    const auto push = [&](const Entry& entry) {
        if (entry.fraction < kInfinity) stack[count++] = entry;
    };
    const auto enter = [&](std::uint32_t node) -> Entry {
        return {node, entry_of(start, displacement_body, tree[node].bounds, slack)};
    };
    push(enter(0));
    while (count > 0) {
        const Entry entry = stack[--count];
        if (best.hit && entry.fraction > best.fraction) continue;
        const PartNode& node = tree[entry.node];
        if (node.part != PartNode::kInner) {
            const ConvexRay ray = cast_ray(shape.part(node.part), from, displacement);
            const bool is_tie = best.hit && ray.fraction == best.fraction && node.part < best.part;
            if (ray.hit && (!best.hit || ray.fraction < best.fraction || is_tie)) {
                static_cast<ConvexRay&>(best) = ray;
                best.part = node.part;
            }
            continue;
        }
        const Entry left = enter(entry.node + 1);
        const Entry right = enter(tree[entry.node + 1].end);
        const bool is_left_first = left.fraction <= right.fraction;
        push(is_left_first ? right : left);
        push(is_left_first ? left : right);
    }
    return best;
}

}  // namespace terrane::internal
