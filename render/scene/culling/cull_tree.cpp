// SPDX-License-Identifier: MIT
// Sources: J. Clark. Hierarchical Geometric Models for Visible Surface Algorithms. CACM 19(10), 1976.
//          U. Assarsson, T. Moller. Optimized View Frustum Culling Algorithms for Bounding Boxes. Journal of Graphics
//          Tools 5(1), 2000 (masks of planes, the last plane first).
// Deviation: nodes are in depth-first order without pointers (base/aabb_tree.h), so that the objects below a node that
//            is inside are one range.
#include "base/aabb_tree.h"

#include <terrane/scene/cull_tree.h>
#include <terrane/terrain/assert.h>

#include <array>

namespace terrane {
namespace {

using internal::AabbNode;

// Exactly one plane crosses a box: as the box is inside of the others, it meets the volume wherever it reaches the
// inner side of that plane, which the test of planes has found.
bool is_one_plane(std::uint8_t mask) { return (mask & (mask - 1)) == 0; }

}  // namespace

struct CullTree::Nodes {
    std::vector<AabbNode> nodes;
    std::vector<std::uint32_t> order;  // [objects] as the leaves
};

CullTree::CullTree(std::span<const Aabb> boxes_world) : nodes_(std::make_unique<Nodes>()) {
    internal::build_aabb_tree(boxes_world, nodes_->order, nodes_->nodes);
}
CullTree::CullTree(CullTree&&) noexcept = default;
CullTree& CullTree::operator=(CullTree&&) noexcept = default;
CullTree::~CullTree() = default;

std::size_t CullTree::size() const { return nodes_->order.size(); }

void CullTree::refit(std::span<const Aabb> boxes_world) {
    TERRANE_ASSERT(boxes_world.size() == size(), "there must be one box an object");
    internal::refit_aabb_tree(boxes_world, nodes_->nodes);
}

void CullTree::cull(const ViewVolume& volume, CullTest test, CullMemory& memory,
                    std::vector<std::uint32_t>& visible_out) const {
    const std::span<const AabbNode> nodes = nodes_->nodes;
    const std::span<const std::uint32_t> order = nodes_->order;
    if (memory.last_plane.size() != nodes.size()) memory.last_plane.assign(nodes.size(), 0);
    visible_out.clear();

    // Masks of the nodes around the current one.
    struct Around {
        std::uint32_t end;
        std::uint8_t mask;
    };
    std::array<Around, AabbNode::kMaxDepth + 1> stack;
    std::size_t depth = 0;
    stack[0] = {static_cast<std::uint32_t>(nodes.size()), PlaneState::kAll};
    std::size_t leaf = 0;  // leaves before the current node
    for (std::uint32_t i = 0; i < nodes.size();) {
        const AabbNode& node = nodes[i];
        while (stack[depth].end <= i) --depth;
        PlaneState state = {stack[depth].mask, memory.last_plane[i]};
        Containment where = volume.test_planes(node.bounds, state);
        if (where == Containment::intersecting && test == CullTest::exact &&
            !is_one_plane(state.mask) && !volume.meets(node.bounds)) {
            where = Containment::outside;
        }
        memory.last_plane[i] = state.first;
        const std::size_t leaves = (node.end - i + 1) / 2;
        const bool is_leaf = node.item != AabbNode::kInner;
        if (where == Containment::intersecting && !is_leaf) {
            stack[++depth] = {node.end, state.mask};
            ++i;
            continue;
        }
        if (where != Containment::outside) {
            const auto first = order.begin() + static_cast<std::ptrdiff_t>(leaf);
            visible_out.insert(visible_out.end(), first,
                               first + static_cast<std::ptrdiff_t>(leaves));
        }
        leaf += leaves;
        i = node.end;
    }
}

void CullTree::find_casters(const CasterVolume& volume,
                            std::vector<std::uint32_t>& casters_out) const {
    casters_out.clear();
    internal::visit_leaves(
        nodes_->nodes, [&](const Aabb& box) { return volume.meets(box); },
        [&](std::uint32_t item) { casters_out.push_back(item); });
}

}  // namespace terrane
