// SPDX-License-Identifier: MIT
#include "scene/culling/random_views.h"

#include <terrane/scene/culling.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

namespace terrane::test::cull_tree {
namespace {

std::vector<Aabb> random_boxes(Random& random, int count, double spread) {
    std::vector<Aabb> boxes;
    for (int i = 0; i < count; ++i) {
        const WorldPos centre(random.between(-spread, spread), random.between(-spread, spread),
                              random.between(-spread / 10, spread / 10));
        boxes.push_back(bounding_box(random_box(random, centre, random.between(0.1, 10.0))));
    }
    return boxes;
}

std::vector<std::uint32_t> one_by_one(const ViewVolume& volume, std::span<const Aabb> boxes,
                                      CullTest test) {
    std::vector<std::uint32_t> visible;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        PlaneState state;
        if (volume.test_planes(boxes[i], state) == Containment::outside) continue;
        if (test == CullTest::exact && !volume.meets(boxes[i])) continue;
        visible.push_back(i);
    }
    return visible;
}

std::vector<std::uint32_t> sorted(std::vector<std::uint32_t> indices) {
    std::sort(indices.begin(), indices.end());
    return indices;
}

// Views a tree, each culled with both tests and compared with every box on its own. The memory is kept from view to
// view, as a viewer that jumps.
void compare_views(std::uint64_t seed, int views) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    std::vector<Aabb> boxes = random_boxes(random, random.below(400), 200.0);
    CullTree tree(boxes);
    CullMemory memory;
    std::vector<std::uint32_t> visible;
    for (int i = 0; i < views; ++i) {
        if (i % 10 == 9) {
            for (Aabb& box : boxes) {
                const Eigen::Vector3d move = random.between(0.0, 5.0) * random.direction();
                box = {box.low + move, box.high + move};
            }
            tree.refit(boxes);
        }
        const ViewVolume volume(random_view(random, WorldPos(0, 0, 0)),
                                random.below(2) == 0 ? random.between(1.0, 300.0)
                                                     : std::numeric_limits<double>::infinity());
        for (const CullTest test : {CullTest::planes, CullTest::exact}) {
            tree.cull(volume, test, memory, visible);
            ASSERT_EQ(sorted(visible), one_by_one(volume, boxes, test));
        }
    }
}

TEST(CullTree, FindsWhatEveryBoxOnItsOwnFinds) {
    for (std::uint64_t seed = 0; seed < 100; ++seed) compare_views(seed, 30);
}

// TERRANE_VIEWS=1000000 is the long run: see docs/scenes.md.
TEST(CullTree, NeverDropsWhatIsInViewOverRandomViews) {
    const char* wanted = std::getenv("TERRANE_VIEWS");
    const int views = wanted != nullptr ? std::stoi(wanted) : 2000;
    Random random(7);
    const std::vector<Aabb> boxes = random_boxes(random, 2000, 300.0);
    const CullTree tree(boxes);
    CullMemory memory;
    std::vector<std::uint32_t> visible;
    std::vector<char> is_kept(boxes.size());
    std::size_t checked = 0;
    for (int i = 0; i < views; ++i) {
        const View view = random_view(random, WorldPos(0, 0, 0));
        tree.cull(ViewVolume(view), i % 2 == 0 ? CullTest::planes : CullTest::exact, memory,
                  visible);
        std::fill(is_kept.begin(), is_kept.end(), char{0});
        for (const std::uint32_t index : visible) is_kept[index] = 1;
        // A point of a box that is in view makes the box visible, whatever the tests of boxes say.
        const Frustum frustum = make_frustum(view);
        for (std::size_t box = 0; box < boxes.size(); ++box) {
            const Eigen::Vector3d size = boxes[box].high - boxes[box].low;
            const Eigen::Vector3d p =
                boxes[box].low +
                size.cwiseProduct(Eigen::Vector3d(
                    random.between(0.0, 1.0), random.between(0.0, 1.0), random.between(0.0, 1.0)));
            const bool is_in_view = std::all_of(frustum.normals.begin(), frustum.normals.end(),
                                                [&](const Eigen::Vector3d& normal) {
                                                    return normal.dot(p - view.eye_world) >= 0.0;
                                                });
            if (!is_in_view) continue;
            ++checked;
            ASSERT_TRUE(is_kept[box]) << "view " << i << ", box " << box;
        }
    }
    std::printf("%zu boxes in view over %d views\n", checked, views);
    EXPECT_GT(checked, static_cast<std::size_t>(views));
}

TEST(CullTree, IsEmptyForNoBoxesAndKeepsTheOnlyOne) {
    const CullTree none(std::span<const Aabb>{});
    CullMemory memory;
    std::vector<std::uint32_t> visible = {7};
    none.cull(ViewVolume(View{}), CullTest::exact, memory, visible);
    EXPECT_TRUE(visible.empty());
    const Aabb box = {{-1, 5, -1}, {1, 6, 1}};
    const CullTree one({&box, 1});
    one.cull(ViewVolume(View{}), CullTest::exact, memory, visible);
    EXPECT_EQ(visible, std::vector<std::uint32_t>{0});
}

TEST(CullTree, TheOrderDoesNotDependOnTheFramesBefore) {
    Random random(3);
    const std::vector<Aabb> boxes = random_boxes(random, 1000, 100.0);
    const CullTree tree(boxes);
    CullMemory used;
    std::vector<std::uint32_t> visible, fresh;
    for (int i = 0; i < 50; ++i) {
        const ViewVolume volume(random_view(random, WorldPos(0, 0, 0)));
        tree.cull(volume, CullTest::planes, used, visible);
        CullMemory none;
        tree.cull(volume, CullTest::planes, none, fresh);
        ASSERT_EQ(visible, fresh);
    }
}

}  // namespace
}  // namespace terrane::test::cull_tree
