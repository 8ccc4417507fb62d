// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"

#include "point_clouds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace terrane {
namespace aabb_tree_test {

using internal::AabbNode;

std::vector<Aabb> random_bounds(test::Random& random, std::size_t count) {
    std::vector<Aabb> bounds;
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3d middle = 10.0 * random.direction();
        const Eigen::Vector3d half = random.between(0.0, 1.0) * random.direction().cwiseAbs();
        bounds.push_back({middle - half, middle + half});
        if (i % 3 == 2) bounds.back() = bounds[i / 2];  // ties
    }
    return bounds;
}

std::size_t depth_of(const std::vector<AabbNode>& tree, std::size_t node) {
    if (tree[node].item != AabbNode::kInner) return 1;
    return 1 + std::max(depth_of(tree, node + 1), depth_of(tree, tree[node + 1].end));
}

bool meets(const Aabb& a, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    return (a.low.array() <= high.array()).all() && (a.high.array() >= low.array()).all();
}

TEST(AabbTree, FindsTheBoxesThatBruteForceFinds) {
    SCOPED_TRACE("seed 31");
    test::Random random(31);
    for (const std::size_t count : {1u, 2u, 3u, 7u, 64u, 1000u}) {
        const std::vector<Aabb> bounds = random_bounds(random, count);
        const std::vector<AabbNode> tree = internal::make_aabb_tree(bounds);
        EXPECT_EQ(tree.size(), 2 * count - 1);
        EXPECT_EQ(tree[0].end, tree.size());
        for (int i = 0; i < 200; ++i) {
            const Eigen::Vector3d low = 10.0 * random.direction();
            const Eigen::Vector3d high = low + random.between(0.0, 5.0) * Eigen::Vector3d::Ones();
            std::multiset<std::size_t> found, expected;
            internal::visit_leaves(
                tree, [&](const Aabb& box) { return meets(box, low, high); },
                [&](std::uint32_t item) { found.insert(item); });
            for (std::size_t k = 0; k < count; ++k) {
                if (meets(bounds[k], low, high)) expected.insert(k);
            }
            EXPECT_EQ(found, expected) << count << " boxes, box " << i;
        }
    }
}

TEST(AabbTree, IsTheSameHoweverItIsBuilt) {
    SCOPED_TRACE("seed 32");
    test::Random random(32);
    for (const std::size_t count : {0u, 1u, 2u, 3u, 5u, 64u, 1000u, 20000u}) {
        std::vector<Aabb> bounds = random_bounds(random, count);
        for (std::size_t i = 0; i < count; ++i) {
            if (i % 7 == 3) bounds[i].low.x() = bounds[i].high.x() = i % 2 == 0 ? 0.0 : -0.0;
            if (i % 11 == 5) bounds[i] = internal::empty_box();
        }
        std::vector<std::uint32_t> order;
        std::vector<AabbNode> expected;
        internal::build_aabb_tree(bounds, order, expected);
        const std::vector<AabbNode> tree = internal::make_aabb_tree(bounds);
        ASSERT_EQ(tree.size(), expected.size());
        for (std::size_t i = 0; i < tree.size(); ++i) {
            ASSERT_EQ(tree[i].item, expected[i].item) << count << " boxes, node " << i;
            ASSERT_EQ(tree[i].end, expected[i].end);
            ASSERT_EQ(tree[i].bounds.low, expected[i].bounds.low);
            ASSERT_EQ(tree[i].bounds.high, expected[i].bounds.high);
        }
    }
}

TEST(AabbTree, HalvesTheCountAtEveryNode) {
    const std::vector<Aabb> same(100'000,
                                 {Eigen::Vector3d::Zero(), Eigen::Vector3d(1.0, 2.0, 3.0)});
    const std::vector<AabbNode> tree = internal::make_aabb_tree(same);
    EXPECT_EQ(depth_of(tree, 0), 18u);
    for (const AabbNode& node : tree) EXPECT_EQ(node.bounds.high.z(), 3.0);
}

}  // namespace aabb_tree_test
}  // namespace terrane
