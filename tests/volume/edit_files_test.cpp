// SPDX-License-Identifier: MIT
//
// What is saved is there again, with the same bits; what is damaged is refused.
#include "volume/edited_world.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

namespace terrane::edit_files_test {

using namespace test;

Result<VolumeEditor> open(EditedWorld& world, const DigFolder& folder) {
    return VolumeEditor::create(world.source, {.worker_count = 0, .folder = folder.path()});
}

/// A new world with the digs of a folder, all of it loaded.
struct Reopened {
    EditedWorld world;
    VolumeEditor editor;
    WholePager pager;

    explicit Reopened(const DigFolder& folder)
        : editor(open(world, folder).value()), pager(whole_world(world.source, 0)) {
        settle(pager);
        EXPECT_EQ(pager.stats().failed, 0u) << pager.last_failure();
    }
};

/// Digs and fills in a folder, in force in a pager, and saved.
struct SavedWorld {
    DigFolder folder;
    EditedWorld world;
    std::vector<VolumeOperation> edits;  // in force
    std::shared_ptr<const ResidentSet> set;

    explicit SavedWorld(int count = 30, std::uint64_t seed = 9) {
        VolumeEditor editor = open(world, folder).value();
        WholePager pager = whole_world(world.source, 0);
        settle(pager);
        Random random(seed);
        for (int i = 0; i < count; ++i) {
            edits.push_back(random_edit(random, *world.hills));
            apply(editor, edits.back());
            editor.update(pager);
            pager.update({}, {}, 0.1 * i);
        }
        set = pager.resident();
        const auto saved = editor.save();
        EXPECT_TRUE(saved) << saved.error().message;
    }
    /// Opens the folder for a new world and compares what a pager loads from it.
    VolumeEditorStats compare() const {
        const Reopened again(folder);
        EXPECT_EQ(difference(*again.pager.resident(), *set), "");
        return again.editor.stats();
    }
};

TEST(EditFiles, GiveTheSameBitsAgain) {
    const SavedWorld saved;
    const std::size_t file_count = saved.folder.chunk_files().size();
    EXPECT_GE(file_count, 4u);
    const VolumeEditorStats stats = saved.compare();
    EXPECT_EQ(stats.in_force, 30u);
    EXPECT_EQ(stats.files_read, file_count);
    EXPECT_EQ(stats.files_refused, 0u);
    // Without the chunks' files, from the log alone.
    for (const std::string& path : saved.folder.chunk_files()) std::filesystem::remove(path);
    EXPECT_EQ(saved.compare().files_read, 0u);
}

TEST(EditFiles, OfAnEarlierPositionHaveTheLaterEditsApplied) {
    SavedWorld saved;
    {
        // Elsewhere and not loaded: the chunks' files stay as they are.
        auto editor = open(saved.world, saved.folder).value();
        Random random(10);
        for (int i = 0; i < 10; ++i) {
            saved.edits.push_back(random_edit(random, *saved.world.hills));
            apply(editor, saved.edits.back());
        }
        ASSERT_TRUE(editor.undo());  // of an edit that no file has
        saved.edits.pop_back();
        EXPECT_EQ(editor.update(), 41u);
        ASSERT_TRUE(editor.save());
    }
    const Reopened again(saved.folder);
    EXPECT_EQ(difference(*again.pager.resident(), again.world.volumes_with(saved.edits)), "");
    EXPECT_EQ(again.editor.stats().files_read, saved.folder.chunk_files().size());
    EXPECT_EQ(again.editor.stats().files_refused, 0u);
}

TEST(EditFiles, WithAnEditThatWasUndoneAreNotUsed) {
    SavedWorld saved;
    {
        auto editor = open(saved.world, saved.folder).value();
        for (int i = 0; i < 5; ++i) {
            ASSERT_TRUE(editor.undo());
            saved.edits.pop_back();
        }
        editor.update();
        ASSERT_TRUE(editor.save());
    }
    Reopened again(saved.folder);
    auto& [world, editor, pager] = again;
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with(saved.edits)), "");
    EXPECT_LT(editor.stats().files_read, saved.folder.chunk_files().size());
    // Undone to the beginning, over two sessions.
    for (std::size_t i = saved.edits.size(); i > 0; --i) ASSERT_TRUE(editor.undo());
    EXPECT_FALSE(editor.undo());
    editor.update(pager);
    settle(pager);
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with({})), "");
}

// Every byte of a chunk's file is covered: OpenVDB reads none of a file that was changed.
TEST(EditFiles, ADamagedFileOfAChunkIsRefusedAndTheChunkMadeFromTheLog) {
    const SavedWorld saved(6);
    const std::string path = saved.folder.chunk_files().front();
    const std::vector<char> good = read_file(path);
    Random random(3);
    for (int i = 0; i < few_or_many(8, 60); ++i) {
        std::vector<char> bad = good;
        const auto at = static_cast<std::size_t>(random.below(static_cast<int>(good.size())));
        bad[at] = static_cast<char>(bad[at] ^ (1 << random.below(8)));
        write_file(path, bad);
        EXPECT_EQ(saved.compare().files_refused, 1u) << "byte " << at << " of " << good.size();
    }
    for (const std::size_t length :
         {std::size_t{0}, std::size_t{71}, good.size() / 2, good.size() - 1}) {
        write_file(path, {good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length)});
        EXPECT_EQ(saved.compare().files_refused, 1u) << "cut to " << length;
    }
    // Whole files, but of another chunk, of another log, of a newer format.
    write_file(path, read_file(saved.folder.chunk_files().back()));
    EXPECT_EQ(saved.compare().files_refused, 1u);
    SavedWorld other(6, 99);
    write_file(path, read_file(other.folder.chunk_files().front()));
    EXPECT_EQ(saved.compare().files_refused, 1u);
    write_file(path, good);
    EXPECT_EQ(saved.compare().files_refused, 0u);
}

TEST(EditFiles, ATornEndOfTheLogIsLeftOutAndOverwritten) {
    const SavedWorld saved(4);
    const std::vector<char> good = read_file(saved.folder.log());
    for (const std::size_t extra : {std::size_t{1}, std::size_t{11}, std::size_t{60}}) {
        std::vector<char> torn = good;
        torn.insert(torn.end(), good.begin() + 36,
                    good.begin() + 36 + static_cast<std::ptrdiff_t>(extra));
        write_file(saved.folder.log(), torn);
        EXPECT_EQ(saved.compare().torn_bytes, extra);
    }
    EditedWorld again;
    auto editor = open(again, saved.folder).value();
    EXPECT_EQ(apply(editor, saved.edits[0]), 5u);
    editor.update();
    ASSERT_TRUE(editor.save());
    EditedWorld third;
    const VolumeEditorStats stats = open(third, saved.folder).value().stats();
    EXPECT_EQ(stats.torn_bytes, 0u);
    EXPECT_EQ(stats.in_force, 5u);
}

TEST(EditFiles, ADamagedOrForeignLogIsRefusedAndLeftAlone) {
    const SavedWorld saved(4);
    const std::vector<char> good = read_file(saved.folder.log());
    const auto refusal = [&](const std::vector<char>& bytes) {
        write_file(saved.folder.log(), bytes);
        EditedWorld again;
        const auto editor = open(again, saved.folder);
        EXPECT_EQ(read_file(saved.folder.log()), bytes);
        return editor ? std::string() : editor.error().message;
    };
    // Each byte before the last record. The header has 36; a record has its length first, and 12 beside its content.
    std::size_t last = 36;
    for (std::size_t next = last; next < good.size();) {
        last = next;
        std::uint32_t length = 0;
        std::memcpy(&length, good.data() + last, sizeof length);
        next += length + 12;
    }
    for (std::size_t at = 0; at < last; at += 7) {
        std::vector<char> bad = good;
        bad[at] = static_cast<char>(bad[at] ^ 16);
        EXPECT_NE(refusal(bad).find("digs.log"), std::string::npos) << "byte " << at;
    }
    EXPECT_NE(refusal({'n', 'o'}).find("no log of digs"), std::string::npos);
    EXPECT_NE(refusal({}).find("no log of digs"), std::string::npos);
    // Of the same ground with other volumes.
    write_file(saved.folder.log(), good);
    EditedWorld other(false);
    const auto editor = open(other, saved.folder);
    ASSERT_FALSE(editor);
    EXPECT_NE(editor.error().message.find("other volumes"), std::string::npos);
}

TEST(EditFiles, AFullDiskLosesNothingAndLeavesNoPartOfAFile) {
    SavedWorld saved(4);
    const std::vector<char> log = read_file(saved.folder.log());
    const std::size_t file_count = saved.folder.file_count();
    auto editor = open(saved.world, saved.folder).value();
    WholePager pager = whole_world(saved.world.source, 0);
    settle(pager);
    Random random(12);
    for (int i = 0; i < 5; ++i) {
        saved.edits.push_back(random_edit(random, *saved.world.hills));
        apply(editor, saved.edits.back());
    }
    editor.update(pager);
    {
        const FullDisk full(log.size() + 150);  // a record and a part of the next
        const auto failed = editor.save();
        ASSERT_FALSE(failed);
        EXPECT_EQ(failed.error().code, ErrorCode::io);
        EXPECT_NE(failed.error().message.find("digs.log"), std::string::npos);
    }
    EXPECT_EQ(read_file(saved.folder.log()), log);
    {
        const FullDisk full(3000);  // the log fits, no chunk does
        const auto failed = editor.save();
        ASSERT_FALSE(failed);
        EXPECT_NE(failed.error().message.find(".dig"), std::string::npos) << failed.error().message;
    }
    EXPECT_GT(read_file(saved.folder.log()).size(), log.size());
    EXPECT_EQ(saved.folder.file_count(), file_count);
    settle(pager);
    saved.set = pager.resident();
    EXPECT_EQ(saved.compare().in_force, 9u);
    ASSERT_TRUE(editor.save());
    EXPECT_EQ(saved.compare().files_refused, 0u);
    EXPECT_EQ(difference(*saved.set, saved.world.volumes_with(saved.edits)), "");
}

TEST(EditFiles, ALogThatAnotherProgramChangesIsNotOverwritten) {
    SavedWorld saved(2);
    auto editor = open(saved.world, saved.folder).value();
    std::vector<char> bytes = read_file(saved.folder.log());
    bytes.push_back('x');
    write_file(saved.folder.log(), bytes);
    apply(editor, saved.edits[0]);
    editor.update();
    const auto failed = editor.save();
    ASSERT_FALSE(failed);
    EXPECT_NE(failed.error().message.find("another program"), std::string::npos);
    EXPECT_EQ(read_file(saved.folder.log()), bytes);
}

}  // namespace terrane::edit_files_test

// Bits depend on the volumes and the log alone.

namespace terrane::edit_bits_test {

using namespace test;

// In CI half as many where contracts are checked: such builds are slow.
const int kEdits = test::few_or_many(TERRANE_ASSERTS ? 60 : 120, 1000);

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
    WholePager pager = whole_world(resident.source, 0);
    settle(pager);
    const auto edits = play(resident, editor, &pager, seed, kEdits);
    EXPECT_EQ(pager.stats().failed, 0u) << pager.last_failure();

    VolumeEditor other = VolumeEditor::create(fresh.source, {.worker_count = 0}).value();
    play(fresh, other, nullptr, seed, kEdits);
    WholePager loaded = whole_world(fresh.source, 0);
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
    WholePager pager = whole_world(one.source, 0);
    const auto edits = play(one, editor, &pager, seed, count);
    for (const int loaders : {1, 2, 3, 4, 5, 6, 7, 8}) {
        EditedWorld world;
        // Little memory, so that tiles are dropped and made again; undos beyond the depth.
        const VolumeEditorSettings settings{.worker_count = 1,
                                            .memory_bytes = std::size_t{1} << (18 + loaders),
                                            .undo_depth = loaders % 3};
        VolumeEditor threaded = VolumeEditor::create(world.source, settings).value();
        WholePager with_threads = whole_world(world.source, loaders);
        play(world, threaded, &with_threads, seed, count);
        ASSERT_EQ(with_threads.resident()->chunks().size(), 21u) << with_threads.last_failure();
        ASSERT_EQ(difference(*pager.resident(), *with_threads.resident()), "")
            << "seed " << seed << ", loaders " << loaders;
    }
}

}  // namespace terrane::edit_bits_test
