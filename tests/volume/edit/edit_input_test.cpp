// SPDX-License-Identifier: MIT
//
// Digs of absurd sizes, at absurd places, too many, and in too little memory.
#include "edit/edit_files.h"
#include "volume/edit/edited_world.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

namespace terrane {
namespace edit_input_test {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(EditInput, WhatCannotBeDugIsRefusedWithOneLineAndChangesNothing) {
    EditedWorld world;
    Pager pager = whole_world(world.source, 0);
    settle(pager);
    const auto before = pager.resident();
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 0}).value();
    const auto refusal = [&](const VolumeShape& shape, const Pose& pose) {
        const auto dug = editor.dig(shape, pose);
        const auto filled = editor.fill(shape, pose);
        EXPECT_FALSE(dug || filled);
        return dug || filled ? std::string() : dug.error().message;
    };
    const Pose middle = at(256.0, 256.0, 0.0);
    EXPECT_NE(refusal(VolumeSphere{0.0005}, middle).find("0.001 m thick"), std::string::npos);
    EXPECT_NE(refusal(VolumeSphere{kNan}, middle).find("radius"), std::string::npos);
    EXPECT_NE(refusal(VolumeSphere{2e5}, middle).find("radius"), std::string::npos);
    EXPECT_NE(refusal(VolumeSphere{-1.0}, middle).find("radius"), std::string::npos);
    EXPECT_NE(refusal(VolumeSphere{5.0}, at(-1000.0, 0.0, 0.0)).find("outside the world"),
              std::string::npos);
    EXPECT_NE(refusal(VolumeSphere{5.0}, at(kNan, 0.0, 0.0)), "");
    EXPECT_NE(refusal(VolumeSphere{5.0}, at(256.0, 256.0, 1e300)), "");
    EXPECT_NE(refusal(VolumeTube{{}, 2.0}, middle), "");
    EXPECT_NE(refusal(VolumeMesh{}, middle).find("not a mesh"), std::string::npos);
    EXPECT_NE(refusal(VolumeFile{"a.vdb"}, middle).find("not a mesh or file"), std::string::npos);
    Pose sheared = middle;
    sheared.rotation(0, 1) = 0.5;
    EXPECT_NE(refusal(VolumeSphere{5.0}, sheared), "");
    const auto nothing = editor.undo();
    ASSERT_FALSE(nothing);
    EXPECT_EQ(nothing.error().message, "there is no dig or fill to undo");
    EXPECT_EQ(editor.update(pager), 0u);
    settle(pager);
    EXPECT_EQ(difference(*pager.resident(), *before), "");
    EXPECT_EQ(editor.stats().waiting, 0u);
    EXPECT_FALSE(editor.save()) << "without a folder";
}

TEST(EditInput, ALogOfEditsThatCannotBeDugIsRefused) {
    const auto refusal = [](const internal::LogRecord& record) {
        const DigFolder folder;
        const EditedWorld world;
        std::filesystem::create_directories(folder.path());
        auto log =
            internal::DigLog::open(folder.log(), world.source->volumes().fingerprint()).value();
        log.add(record);
        EXPECT_TRUE(log.save());
        const auto editor =
            VolumeEditor::create(world.source, {.worker_count = 0, .folder = folder.path()});
        return editor ? std::string() : editor.error().message;
    };
    const auto edit = [](const VolumeShape& shape) {
        return VolumeOperation{VolumeOp::remove, shape, at(256.0, 256.0, 0.0), 1.0};
    };
    EXPECT_EQ(refusal({1, 0, edit(VolumeSphere{5.0})}), "");
    EXPECT_NE(refusal({1, 0, edit(VolumeFile{"a.vdb"})}).find("not a mesh or file"),
              std::string::npos);
    EXPECT_NE(refusal({1, 0, edit(VolumeMesh{})}).find("not a mesh or file"), std::string::npos);
    EXPECT_NE(refusal({1, 0, edit(VolumeSphere{-5.0})}).find("radius"), std::string::npos);
    EXPECT_NE(refusal({2, 1, std::nullopt}).find("not the last edit"), std::string::npos);
    for (const std::uint32_t number : {0u, 0x80000000u, 0xffffffffu}) {
        EXPECT_NE(refusal({number, 0, edit(VolumeSphere{5.0})}).find("impossible record"),
                  std::string::npos)
            << number;
    }
}

TEST(EditInput, SettingsOutOfRangeAreRefused) {
    const EditedWorld world;
    EXPECT_FALSE(VolumeEditor::create(nullptr));
    EXPECT_FALSE(VolumeEditor::create(world.source, {.worker_count = 2}));
    EXPECT_FALSE(VolumeEditor::create(world.source, {.undo_depth = -1}));
    EXPECT_FALSE(VolumeEditor::create(world.source, {.folder = "/proc/digs"}));
}

TEST(EditInput, AKilometreIsDug) {
    EditedWorld world;
    Pager pager = whole_world(world.source, 0);
    settle(pager);
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 1}).value();
    const VolumeOperation big{.op = VolumeOp::remove,
                              .shape = VolumeSphere{500.0},
                              .world_from_shape = at(256.0, 256.0, 400.0),
                              .voxel = 1.0};
    apply(editor, big);
    editor.update(pager);
    editor.wait();
    EXPECT_EQ(editor.update(pager), 1u);
    settle(pager);
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with({big})), "");
    ASSERT_TRUE(editor.undo());
    editor.update(pager);
    editor.wait();
    editor.update(pager);
    settle(pager);
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with({})), "");
}

TEST(EditInput, TenThousandDigsInOnePlace) {
    constexpr int kCount = TERRANE_ASSERTS ? 1000 : 10000;
    EditedWorld world;
    Pager pager = whole_world(world.source, 0);
    settle(pager);
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 1}).value();
    Random random(21);
    std::vector<VolumeOperation> edits;
    for (int i = 0; i < kCount; ++i) {
        const double x = 192.0 + random.between(-9.0, 9.0), y = 192.0 + random.between(-9.0, 9.0);
        edits.push_back({.op = random.below(2) == 0 ? VolumeOp::add : VolumeOp::remove,
                         .shape = VolumeSphere{random.between(1.0, 3.0)},
                         .world_from_shape = at(x, y, random.between(-5.0, 5.0)),
                         .voxel = 1.0});
        apply(editor, edits.back());
    }
    editor.update(pager);
    editor.wait();
    EXPECT_EQ(editor.update(pager), static_cast<std::uint32_t>(kCount));
    settle(pager);
    EXPECT_LE(pager.stats().replaced, 4u) << "what comes into force at once is swapped once";
    EXPECT_EQ(pager.stats().failed, 0u) << pager.last_failure();
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with(edits)), "");
    // What a load of it claims is no sum over all digs.
    EXPECT_LT(world.source->max_chunk_bytes({1, 1, 2}), std::size_t{20} << 20);
}

// The ceiling holds while chunks are swapped; where they do not fit, others go first, and the change waits.
TEST(EditInput, DigsStayBelowTheCeiling) {
    for (const int worker_count : {0, 1}) {
        EditedWorld world;
        std::size_t all_bytes = 0;
        {
            Pager whole = whole_world(world.source, 0);
            settle(whole);
            all_bytes = whole.stats().resident_bytes;
        }
        const std::size_t ceiling = all_bytes + (std::size_t{64} << 10);
        Pager pager =
            Pager::create(world.source, {.memory_bytes = ceiling, .worker_count = worker_count})
                .value();
        VolumeEditor editor =
            VolumeEditor::create(world.source, {.worker_count = worker_count}).value();
        Random random(8);
        std::vector<VolumeOperation> edits;
        double time_s = 0.0;
        const auto frame = [&] {
            editor.update(pager);
            CameraNeed camera;
            camera.view.eye_world = {200.0, 200.0, 200.0};
            camera.view.forward = Eigen::Vector3d(0.1, 0.1, -1.0).normalized();
            camera.view.up = Eigen::Vector3d(0.0, 1.0, 0.1).normalized();
            camera.threshold_px = 0.01;
            pager.update({&camera, 1}, {}, time_s += 0.05);
            ASSERT_LE(pager.stats().resident_bytes + pager.stats().in_flight_bytes, ceiling);
        };
        for (int i = 0; i < 40; ++i) {
            frame();
            pager.finish();
        }
        for (int i = 0; i < 60; ++i) {
            edits.push_back(random_edit(random, *world.hills));
            apply(editor, edits.back());
            for (int k = 0; k < 3; ++k) frame();
        }
        for (int i = 0; i < 400 && editor.stats().waiting > 0; ++i) {
            editor.wait();
            frame();
        }
        EXPECT_EQ(editor.stats().waiting, 0u);
        EXPECT_LE(pager.stats().peak_bytes, ceiling);
        EXPECT_GT(editor.stats().postponed, 0u);
        EXPECT_GT(pager.stats().evicted, 0u);
        EXPECT_EQ(difference(*pager.resident(), world.volumes_with(edits)), "");
    }
}

}  // namespace edit_input_test
}  // namespace terrane
