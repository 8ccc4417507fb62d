// SPDX-License-Identifier: MIT
//
// Digs in a running pager: what comes into force when, and with which bits.
#include "edit/edit_files.h"
#include "volume/edited_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

namespace terrane::volume_editor_test {

using namespace test;

double height_at(const Pager& pager, double x, double y) {
    return pager.ground().height(x, y).height;
}

TEST(VolumeEditor, ADigIsInForceInThePagersNextUpdateAndAnUndoTakesItBack) {
    EditedWorld world(false);
    WholePager pager = whole_world(world.source, 0);
    settle(pager);
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 0}).value();
    const double before = height_at(pager, 100.0, 100.0);
    const auto old_set = pager.resident();
    ASSERT_EQ(editor.dig(VolumeSphere{5.0}, at(100.0, 100.0, before)).value(), 1u);
    EXPECT_EQ(editor.stats().waiting, 1u);
    EXPECT_EQ(editor.update(pager), 1u);
    EXPECT_EQ(height_at(pager, 100.0, 100.0), before) << "the set changes in the pager's update";
    pager.update({}, {}, 1.0);
    EXPECT_NEAR(height_at(pager, 100.0, 100.0), before - 5.0, 0.1);
    EXPECT_EQ(pager.stats().replaced, 1u);
    // What is replaced has another address, and no fade; the rest is the same.
    const auto set = pager.resident();
    ASSERT_EQ(set->chunks().size(), old_set->chunks().size());
    int changed = 0;
    for (std::size_t i = 0; i < set->chunks().size(); ++i) {
        changed += set->chunks()[i].get() != old_set->chunks()[i].get() ? 1 : 0;
        EXPECT_EQ(set->fade(i), 1.0f);
    }
    EXPECT_EQ(changed, 1);
    ASSERT_EQ(editor.undo().value(), 2u);
    EXPECT_EQ(editor.update(pager), 2u);
    pager.update({}, {}, 2.0);
    EXPECT_EQ(height_at(pager, 100.0, 100.0), before);
    EXPECT_EQ(difference(*pager.resident(), *old_set), "");
}

// A load that has begun before a change comes into force ends after it.
TEST(VolumeEditor, ALoadInFlightDoesNotBringOldGroundBack) {
    EditedWorld world;
    Pager pager = Pager::create(world.source, {.worker_count = 3}).value();
    settle(pager);  // the root
    world.hills->is_held = true;
    const int before = world.hills->sample_count;
    const RequiredRegion region =
        pager.require({10.0, 10.0, 20.0, 20.0}, 0.0);  // no volume touches it yet
    for (int i = 0; i < 1000 && world.hills->sample_count < before + 2; ++i) {
        pager.update({}, {}, 10.0 + 0.1 * i);  // a chunk of each level
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ASSERT_GE(world.hills->sample_count, before + 2);
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 0}).value();
    std::vector<VolumeOperation> edits;
    for (int y = 64; y < 512; y += 128) {
        for (int x = 64; x < 512; x += 128) {
            edits.push_back({.op = VolumeOp::remove,
                             .shape = VolumeSphere{3.0},
                             .world_from_shape = at(x, y, world.hills->height(x, y)),
                             .voxel = 1.0});
            apply(editor, edits.back());
        }
    }
    EXPECT_EQ(editor.update(pager), edits.size());
    world.hills->is_held = false;
    world.hills->is_held.notify_all();
    settle(pager);
    EXPECT_GT(pager.stats().outdated, 0u);
    EXPECT_EQ(pager.stats().failed, 0u) << pager.last_failure();
    EXPECT_EQ(pager.resident()->chunks().size(), 3u);
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with(edits)), "");
}

TEST(VolumeEditor, AChunkThatArrivesWhileAChangeIsOnItsWayIsMadeAgainFirst) {
    EditedWorld world;
    Pager pager = Pager::create(world.source, {.worker_count = 0}).value();
    settle(pager);
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 1}).value();
    std::vector<VolumeOperation> edits;
    for (int i = 0; i < 3; ++i) {  // over the corner of four chunks, of which one is resident
        edits.push_back({.op = VolumeOp::remove,
                         .shape = VolumeSphere{6.0},
                         .world_from_shape = at(128.0 + i, 128.0, world.hills->height(128, 128)),
                         .voxel = 1.0});
        apply(editor, edits.back());
    }
    const RequiredRegion region = pager.require({10.0, 10.0, 20.0, 20.0}, 0.0);
    settle(pager);
    editor.update(pager);
    editor.wait();
    const RequiredRegion wide = pager.require({10.0, 10.0, 200.0, 200.0}, 0.0);
    settle(pager);
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with({})), "");
    EXPECT_EQ(editor.update(pager), 0u);
    pager.update({}, {}, 1000.0);
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with({})), "");
    editor.wait();
    EXPECT_EQ(editor.stats().completed, 3u);
    EXPECT_EQ(editor.update(pager), 3u);
    pager.update({}, {}, 1001.0);
    EXPECT_EQ(pager.stats().replaced, 4u);
    EXPECT_EQ(difference(*pager.resident(), world.volumes_with(edits)), "");
}

// At every moment all resident chunks are those of the number in force, whatever arrives and is evicted meanwhile.
TEST(VolumeEditor, AllChunksChangeInTheSameUpdate) {
    EditedWorld world;
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 1}).value();
    Pager pager = Pager::create(world.source, {.worker_count = 2}).value();
    Random random(17);
    std::vector<VolumeOperation> edits;
    std::uint32_t in_force = 0, compared = 0;
    for (int frame = 0; frame < few_or_many(80, 150); ++frame) {
        if (frame % 4 == 0 && edits.size() < 30) {
            edits.push_back(random_edit(random, *world.hills));
            apply(editor, edits.back());
        }
        const std::uint32_t number = editor.update(pager);
        ASSERT_GE(number, in_force);
        // A camera that turns: chunks come and go.
        CameraNeed camera;
        camera.view.eye_world = {256.0 + 2.0 * (frame % 60), 200.0, 40.0};
        camera.view.forward =
            (Eigen::Vector3d(frame % 40 < 20 ? 1.0 : -1.0, 0.3, -0.4)).normalized();
        camera.view.up =
            (Eigen::Vector3d::UnitZ() - camera.view.forward.z() * camera.view.forward).normalized();
        camera.threshold_px = 0.2;
        pager.update({&camera, 1}, {}, 0.05 * frame);
        if (number != in_force || frame % 10 == 0) {
            const std::vector<VolumeOperation> until(edits.begin(), edits.begin() + number);
            ASSERT_EQ(difference(*pager.resident(), world.volumes_with(until)), "")
                << "frame " << frame << ", change " << number;
            ++compared;
        }
        in_force = number;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    for (int i = 0; i < 200 && editor.stats().waiting > 0; ++i) {
        editor.wait();
        editor.update(pager);
        pager.update({}, {}, 100.0 + i);
    }
    EXPECT_EQ(editor.stats().in_force, edits.size());
    EXPECT_GT(compared, 10u);
}

TEST(VolumeEditor, WhatAChangeHidesOrShowsIsFoundFromAfar) {
    // The finest chunks are needed because of a dig alone: the hills are almost flat.
    const auto flat = std::make_shared<WaveHeights>(dig_lattice(), 0.01, 300.0);
    const auto volumes = Volumes::create(dig_lattice(), {}, {.level = 2}).value();
    const auto source = VolumeHeights::create(flat, volumes).value();
    VolumeEditor editor = VolumeEditor::create(source, {.worker_count = 0}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    CameraNeed camera;
    camera.view.eye_world = {256.0, -100.0, 60.0};
    camera.view.forward = Eigen::Vector3d(0.0, 1.0, -0.2).normalized();
    camera.view.up = Eigen::Vector3d(0.0, 0.2, 1.0).normalized();
    const auto count_fine = [&](double time_s) {
        editor.update(pager);
        pager.update({&camera, 1}, {}, time_s);
        return std::ranges::count_if(pager.resident()->chunks(), [](const ResidentChunk& chunk) {
            return chunk->key.level == 2 && chunk->solid;
        });
    };
    EXPECT_EQ(count_fine(0.0), 0);
    apply(editor, {.op = VolumeOp::add,
                   .shape = VolumeSphere{20.0},
                   .world_from_shape = at(256.0, 256.0, 20.0),
                   .voxel = 1.0});
    EXPECT_EQ(count_fine(1.0), 4);
    EXPECT_GE(source->solid_extent({0, 0, 0})->heights.high, 40.0);
    EXPECT_GE(source->interval({250.0, 250.0, 260.0, 260.0}).high, 40.0);
    ASSERT_TRUE(editor.undo());
    EXPECT_EQ(count_fine(2.0), 0);
    EXPECT_FALSE(source->solid_extent({0, 0, 0}).has_value());
}

TEST(VolumeEditor, ABodyOnAFillAboveAllGroundHasItResident) {
    EditedWorld world(false);
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 0}).value();
    Pager pager = Pager::create(world.source, {.worker_count = 0}).value();
    BodyNeed body{.centre_world = {300.0, 300.0, 101.0}, .radius = 1.0};
    double time_s = 0.0;
    const auto height = [&] {
        editor.update(pager);
        pager.update({}, {&body, 1}, time_s += 1.0);
        return pager.ground().height(300.0, 300.0);
    };
    EXPECT_EQ(height().status, QueryStatus::not_resident);
    apply(editor, {.op = VolumeOp::add,
                   .shape = VolumeBox{{4.0, 4.0, 100.0}},
                   .world_from_shape = at(300.0, 300.0, 0.0),
                   .voxel = 1.0});
    EXPECT_NEAR(height().height, 100.0, 0.1);
}

}  // namespace terrane::volume_editor_test

// Digs of absurd sizes, at absurd places, too many, and in too little memory.

namespace terrane::edit_input_test {

using namespace test;
using volume_editor_test::height_at;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(EditInput, WhatCannotBeDugIsRefusedWithOneLineAndChangesNothing) {
    EditedWorld world;
    WholePager pager = whole_world(world.source, 0);
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
    EditedWorld world(false);
    WholePager pager = whole_world(world.source, 0);
    settle(pager);
    const auto before = pager.resident();
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 1}).value();
    const Eigen::Vector3d centre(256.0, 256.0, 460.0);
    ASSERT_TRUE(editor.dig(VolumeSphere{500.0}, at(centre.x(), centre.y(), centre.z())));
    editor.update(pager);
    editor.wait();
    EXPECT_EQ(editor.update(pager), 1u);
    settle(pager);
    Random random(22);
    int dug = 0;
    for (int i = 0; i < 1000; ++i) {
        const double x = random.between(1.0, 511.0), y = random.between(1.0, 511.0);
        const double hill = world.hills->height(x, y);
        const double bottom =
            centre.z() -
            std::sqrt(500.0 * 500.0 - (Eigen::Vector2d(x, y) - centre.head<2>()).squaredNorm());
        if (std::abs(hill - bottom) < 3.0) continue;  // at the rim
        ASSERT_NEAR(height_at(pager, x, y), std::min(hill, bottom), 0.1) << x << ", " << y;
        dug += bottom < hill ? 1 : 0;
    }
    EXPECT_GT(dug, 200);
    EXPECT_LT(dug, 800);
    ASSERT_TRUE(editor.undo());
    editor.update(pager);
    editor.wait();
    editor.update(pager);
    settle(pager);
    EXPECT_EQ(difference(*pager.resident(), *before), "");
}

TEST(EditInput, ThousandsOfDigsInOnePlace) {
    const int count = few_or_many(2000, 10000);
    EditedWorld world;
    WholePager pager = whole_world(world.source, 0);
    settle(pager);
    VolumeEditor editor = VolumeEditor::create(world.source, {.worker_count = 1}).value();
    Random random(21);
    std::vector<VolumeOperation> edits;
    for (int i = 0; i < count; ++i) {
        const double x = 192.0 + random.between(-9.0, 9.0), y = 192.0 + random.between(-9.0, 9.0);
        edits.push_back({.op = random.below(2) == 0 ? VolumeOp::add : VolumeOp::remove,
                         .shape = VolumeSphere{random.between(1.0, 3.0)},
                         .world_from_shape = at(x, y, random.between(-5.0, 5.0)),
                         .voxel = 1.0});
        apply(editor, edits.back());
    }
    editor.update(pager);
    editor.wait();
    EXPECT_EQ(editor.update(pager), static_cast<std::uint32_t>(count));
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
            WholePager whole = whole_world(world.source, 0);
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
        for (int i = 0; i < few_or_many(30, 60); ++i) {
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

}  // namespace terrane::edit_input_test
