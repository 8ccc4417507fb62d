// SPDX-License-Identifier: MIT
//
// Bits depend on the volumes and the log alone.
#include "volume/edit/edited_world.h"

#include <gtest/gtest.h>

namespace terrane {
namespace edit_bits_test {

using namespace test;

// A tenth where contracts are checked: such builds are slow.
constexpr int kEdits = TERRANE_ASSERTS ? 100 : 1000;

/// Digs, fills and undos, one after the other; what is in force at the end.
std::vector<VolumeOperation> play(EditedWorld& world, VolumeEditor& editor, Pager* pager,
                                  std::uint64_t seed, int count) {
    Random random(seed);
    std::vector<VolumeOperation> in_force;
    for (int i = 0; i < count; ++i) {
        if (!in_force.empty() && random.below(8) == 0) {
            EXPECT_TRUE(editor.undo());
            in_force.pop_back();
        } else {
            in_force.push_back(random_edit(random, *world.hills));
            apply(editor, in_force.back());
        }
        if (pager != nullptr) {
            editor.update(*pager);
            pager->update({}, {}, 0.02 * i);
        }
    }
    if (pager != nullptr) {
        for (int i = 0; i < 1000 && editor.stats().waiting > 0; ++i) {
            editor.wait();
            editor.update(*pager);
            settle(*pager);
        }
        settle(*pager);
    } else {
        editor.update();
    }
    EXPECT_EQ(editor.stats().waiting, 0u);
    return in_force;
}

TEST(EditedBits, AreThoseOfAFreshLoadAfterTheWholeLog) {
    const std::uint64_t seed = 2026;
    EditedWorld resident, fresh;
    VolumeEditor editor = VolumeEditor::create(resident.source, {.worker_count = 0}).value();
    Pager pager = whole_world(resident.source, 0);
    settle(pager);
    const auto edits = play(resident, editor, &pager, seed, kEdits);
    EXPECT_EQ(pager.stats().failed, 0u) << pager.last_failure();

    VolumeEditor other = VolumeEditor::create(fresh.source, {.worker_count = 0}).value();
    play(fresh, other, nullptr, seed, kEdits);
    Pager loaded = whole_world(fresh.source, 0);
    settle(loaded);
    ASSERT_EQ(loaded.resident()->chunks().size(), 21u);
    EXPECT_EQ(difference(*pager.resident(), *loaded.resident()), "") << "seed " << seed;
    // And those that volumes make without an editor.
    EXPECT_EQ(difference(*loaded.resident(), resident.volumes_with(edits)), "") << "seed " << seed;
}

TEST(EditedBits, DoNotDependOnThreads) {
    const std::uint64_t seed = 77;
    const int count = kEdits / 10;
    EditedWorld one;
    VolumeEditor editor = VolumeEditor::create(one.source, {.worker_count = 0}).value();
    Pager pager = whole_world(one.source, 0);
    const auto edits = play(one, editor, &pager, seed, count);
    for (const int loaders : {1, 2, 3, 4, 5, 6, 7, 8}) {
        EditedWorld world;
        // Little memory, so that tiles are dropped and made again; undos beyond the depth.
        const VolumeEditorSettings settings{.worker_count = 1,
                                            .memory_bytes = std::size_t{1} << (18 + loaders),
                                            .undo_depth = loaders % 3};
        VolumeEditor threaded = VolumeEditor::create(world.source, settings).value();
        Pager with_threads = whole_world(world.source, loaders);
        play(world, threaded, &with_threads, seed, count);
        ASSERT_EQ(with_threads.resident()->chunks().size(), 21u) << with_threads.last_failure();
        ASSERT_EQ(difference(*pager.resident(), *with_threads.resident()), "")
            << "seed " << seed << ", loaders " << loaders;
    }
}

}  // namespace edit_bits_test
}  // namespace terrane
