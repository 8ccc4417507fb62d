// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/placed_shape.h"

#include <array>
#include <limits>

// Traversal of the pairs of parts of two placed shapes by their trees, nearest bounds first.
namespace terrane::internal {

/// Lower bounds of the signed distances of parts.
class BoundGaps {
public:
    BoundGaps(const PlacedShape& a, const PlacedShape& b);

    /// Lower bound of the signed distance of any two shapes inside the boxes: the distance of the boxes, or minus their
    /// least overlap along a face normal.
    double operator()(const Aabb& of_a, const Aabb& of_b) const;

private:
    Eigen::Matrix3d a_from_b_;
    Eigen::Matrix3d spread_;  ///< its absolute values
    Eigen::Vector3d offset_;  ///< of b's body frame, in a's
    double rounding_ = 0.0;
};

/// Calls visit(part_a, part_b, bound) for the pairs whose bound is at most `limit`; it returns the new limit, -infinity
/// to stop.
///
/// @param bound (box of a, box of b) -> number; not smaller for boxes inside of them
template <class Bound, class Visit>
void visit_part_pairs(std::span<const AabbNode> tree_a, std::span<const AabbNode> tree_b,
                      double limit, const Bound& bound, const Visit& visit) {
    struct Entry {
        std::uint32_t a, b;
        double bound;
    };
    // Every descent replaces one pair by two.
    std::array<Entry, 2 * AabbNode::kMaxDepth + 1> stack;
    std::size_t count = 0;
    const auto push = [&](std::uint32_t a, std::uint32_t b, double value) {
        if (value <= limit) stack[count++] = {a, b, value};
    };
    const auto bound_of = [&](std::uint32_t a, std::uint32_t b) {
        return bound(tree_a[a].bounds, tree_b[b].bounds);
    };
    const auto size_of = [](const AabbNode& node) {
        const Eigen::Vector3d side = node.bounds.high - node.bounds.low;
        return node.item != AabbNode::kInner ? -1.0 : dot(side, side);
    };
    push(0, 0, bound_of(0, 0));
    while (count > 0) {
        const Entry entry = stack[--count];
        if (!(entry.bound <= limit)) continue;
        const AabbNode& a = tree_a[entry.a];
        const AabbNode& b = tree_b[entry.b];
        if (a.item != AabbNode::kInner && b.item != AabbNode::kInner) {
            limit = visit(a.item, b.item, entry.bound);
            continue;
        }
        std::uint32_t a2 = entry.a, b2 = entry.b;
        std::uint32_t a1 = a2, b1 = b2;
        if (size_of(a) >= size_of(b)) {
            a1 = entry.a + 1;
            a2 = tree_a[a1].end;
        } else {
            b1 = entry.b + 1;
            b2 = tree_b[b1].end;
        }
        const double first = bound_of(a1, b1);
        const double second = bound_of(a2, b2);
        if (first <= second) {
            push(a2, b2, second);
            push(a1, b1, first);
        } else {
            push(a1, b1, first);
            push(a2, b2, second);
        }
    }
}

/// A pair of parts and their gap.
struct PartGap {
    std::uint32_t part_a = 0;
    std::uint32_t part_b = 0;
    Gap gap;
};

/// The pair of the least signed distance. Where that is above `limit`, the distance returned is any number above
/// `limit`.
PartGap find_least_gap(const PlacedShape& a, const PlacedShape& b,
                       double limit = std::numeric_limits<double>::infinity());

}  // namespace terrane::internal
