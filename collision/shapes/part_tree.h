// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/compound.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

// Bounding volume tree of a compound's parts.
namespace terrane::internal {

/// Nodes are in depth-first order: the root is the first, and the children of an inner node i are nodes i + 1 and
/// nodes[i + 1].end. A leaf has one part.
struct PartNode {
    static constexpr std::uint32_t kInner = ~std::uint32_t{0};
    /// Largest number of nodes on a path from the root.
    static constexpr std::size_t kMaxDepth = 18;

    Aabb bounds;                  ///< around all parts of the subtree, body frame
    std::uint32_t end = 0;        ///< the first node after the subtree
    std::uint32_t part = kInner;  ///< of a leaf: index of its part
};

/// Splits into halves of equal count along the longest extent of the boxes' centres. Deterministic, ties included.
///
/// @param bounds [parts] 1 to Compound::kMaxParts
///
/// Cost: O(n log n); 0.2 microseconds a part
std::vector<PartNode> make_part_tree(std::span<const Aabb> bounds);

/// Valid as long as `compound` or a copy of it.
std::span<const PartNode> part_tree(const Compound& compound);

/// Visits the parts whose box and all boxes around it are wanted, in the order of the tree, without a stack.
///
/// @param wants bool(const Aabb&), body frame
/// @param take  void(std::uint32_t part)
template <class Wants, class Take>
void visit_parts(std::span<const PartNode> tree, const Wants& wants, const Take& take) {
    for (std::size_t i = 0; i < tree.size();) {
        const PartNode& node = tree[i];
        const bool is_wanted = wants(node.bounds);
        if (is_wanted && node.part != PartNode::kInner) take(node.part);
        i = is_wanted ? i + 1 : node.end;
    }
}

}  // namespace terrane::internal
