// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"

#include <terrane/base/math.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace terrane::internal {

/// The empty box, from +infinity to -infinity: the value from which include() starts.
inline Aabb empty_box() {
    return {Eigen::Vector3d::Constant(kInfinity), Eigen::Vector3d::Constant(-kInfinity)};
}

/// Extends a box to contain a sphere.
inline void include(const Eigen::Vector3d& centre, double radius, Aabb& box) {
    for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min(box.low[axis], centre[axis] - radius);
        box.high[axis] = std::max(box.high[axis], centre[axis] + radius);
    }
}

/// Whether two boxes, each widened by `margin`, overlap or touch: the exact test of all broadphases. It has no
/// branches: most boxes that are compared are close to each other, so that branches would be mispredicted.
inline bool overlap(const Aabb& a, const Aabb& b, double margin) {
    const double both = 2.0 * margin;
    int is = 1;
    for (int i = 0; i < 3; ++i) {
        is &= static_cast<int>(a.low[i] - b.high[i] <= both) &
              static_cast<int>(b.low[i] - a.high[i] <= both);
    }
    return is != 0;
}

// Bounding volume trees over boxes, for the parts of a compound and the bodies of a world.

/// A node of a tree in depth-first order. The root is the first node. The children of inner node i are node i + 1 and
/// node nodes[i + 1].end. A leaf has one item.
struct AabbNode {
    static constexpr std::uint32_t kInner = ~std::uint32_t{0};
    /// Largest number of nodes on a path from the root to a leaf, for 2^31 items.
    static constexpr std::size_t kMaxDepth = 32;

    Aabb bounds;                  ///< around all boxes of the subtree
    std::uint32_t end = 0;        ///< the first node after the subtree
    std::uint32_t item = kInner;  ///< index of a leaf's box
};

/// Splits items into halves, the second one larger by one if the count is odd, along the axis on which the centres of
/// their boxes extend farthest; at equal centres, the order of indices decides. Empty boxes, from +infinity to
/// -infinity, sort after all others. Which items a half contains is deterministic; their order in it is not.
///
/// @param bounds indexed by items
///
/// Returns: the size of the first half
std::size_t split_into_halves(std::span<const Aabb> bounds, std::span<std::uint32_t> items);

/// Builds a tree by recursively splitting the boxes into halves of equal count, along the axis on which their centres
/// extend farthest. The tree is deterministic: at equal centres, the order of indices decides. Empty boxes, from
/// +infinity to -infinity, sort after all others and count as contained in every box.
///
/// @param bounds    [items] at most 2^31; each is the empty box, or is finite with low <= high
/// @param order_out [items] the order of the leaves
/// @param nodes_out empty if there are no items
///
/// Allocates: only to grow the outputs
/// Cost:      O(n log n); 0.2 microseconds per item
void build_aabb_tree(std::span<const Aabb> bounds, std::vector<std::uint32_t>& order_out,
                     std::vector<AabbNode>& nodes_out);

/// As build_aabb_tree(), in about half the time, but allocates temporary memory: for trees that are built once.
std::vector<AabbNode> make_aabb_tree(std::span<const Aabb> bounds);

/// Recomputes the bounds of all nodes from the boxes and keeps the tree's structure. The farther items move relative to
/// each other, the more expensive queries become.
///
/// Cost: O(n)
void refit_aabb_tree(std::span<const Aabb> bounds, std::span<AabbNode> nodes);

/// Visits the items whose box and all enclosing boxes satisfy `wants`, in the order of the tree, without a stack.
///
/// @param wants bool(const Aabb&)
/// @param visitor  void(std::uint32_t item)
template <class Wants, class Visitor>
void visit_leaves(std::span<const AabbNode> tree, const Wants& wants, const Visitor& visitor) {
    for (std::size_t i = 0; i < tree.size();) {
        const AabbNode& node = tree[i];
        const bool is_wanted = wants(node.bounds);
        if (is_wanted && node.item != AabbNode::kInner) visitor(node.item);
        i = is_wanted ? i + 1 : node.end;
    }
}

/// Visits the items whose boxes have a bound of at most `limit`. Of two siblings, visits the one with the smaller bound
/// first, and at equal bounds the first one. Items with an infinite bound are not visited.
///
/// @param bound double(const Aabb&), not NaN; if box A contains box B, bound(A) <= bound(B)
/// @param visit double(std::uint32_t item): returns the new limit, -infinity to stop
template <class Bound, class Visit>
void visit_leaves_up_to(std::span<const AabbNode> tree, double limit, const Bound& bound,
                        const Visit& visit) {
    struct Entry {
        std::uint32_t node;
        double bound;
    };
    constexpr double kNever = std::numeric_limits<double>::infinity();
    // every descent replaces one node of the stack by two
    std::array<Entry, AabbNode::kMaxDepth + 1> stack;
    std::size_t count = 0;
    const auto entry_of = [&](std::uint32_t node) -> Entry {
        return {node, bound(tree[node].bounds)};
    };
    const auto push = [&](const Entry& entry) {
        if (entry.bound <= limit && entry.bound < kNever) stack[count++] = entry;
    };
    if (!tree.empty()) push(entry_of(0));
    while (count > 0) {
        const Entry entry = stack[--count];
        if (!(entry.bound <= limit)) continue;
        const AabbNode& node = tree[entry.node];
        if (node.item != AabbNode::kInner) {
            limit = visit(node.item);
            continue;
        }
        const Entry left = entry_of(entry.node + 1);
        const Entry right = entry_of(tree[entry.node + 1].end);
        const bool is_left_first = left.bound <= right.bound;
        push(is_left_first ? right : left);
        push(is_left_first ? left : right);
    }
}

/// Fraction of a segment, 0 to 1, at which it enters a widened box; 0 if it starts inside; infinity if it misses the
/// box, or if the box is empty.
///
/// @param displacement from the start to the end of the segment
/// @param margin       added to each side, metres
double segment_entry(const Eigen::Vector3d& from, const Eigen::Vector3d& displacement,
                     const Aabb& box, double margin);

}  // namespace terrane::internal
