// SPDX-License-Identifier: MIT
#include "record/run_record.h"

#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace terrane::tools {
namespace run_record_test {

namespace fs = std::filesystem;

constexpr double kDt = 1.0 / 60.0;

Terrain make_terrain(std::uint64_t seed) {
    return {.source = FractalHeights::create({.seed = seed}).value(), .dem = {}, .name = "hills"};
}

World make_world(double height) {
    World world = World::create({}).value();
    BodyState ball;
    ball.pose.translation.z() = height;
    EXPECT_TRUE(world.add({.shape = Sphere{0.5}}, ball));
    return world;
}

class RunRecordFile : public testing::Test {
protected:
    RunRecordFile()
        : path_((fs::temp_directory_path() /
                 ("terrane_run_" + std::to_string(getpid()) + "_" +
                  testing::UnitTest::GetInstance()->current_test_info()->name()))
                    .string()) {}
    ~RunRecordFile() override { fs::remove(path_); }

    std::vector<char> bytes() const {
        std::ifstream file(path_, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    }
    void write(std::span<const char> bytes) const {
        std::ofstream(path_, std::ios::binary)
            .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }

    // A drive of 8 s, with controls of all bits, that is amended in places.
    void record_drive() {
        settings_ = {.kind = RunKind::drive,
                     .terrain_flags = {"--seed", "7"},
                     .terrain = identify(make_terrain(7)),
                     .fps = 30.0,
                     .dt = kDt,
                     .camera = {.behind = 7.25, .above = 2.5, .target_above = 0.5, .bearing = 0.1},
                     .crate_count = 3};
        RunRecorder recorder = RunRecorder::create(path_, settings_).value();
        recorder.set_traveller({0, 0});
        test::SeededRandom random(kSeed);
        const World world = make_world(1.0), other = make_world(2.0);
        const std::vector<double> camera{1.0, 2.0, 3.0};
        recorder.add_frame(world, camera, CharacterGait(), {});
        for (int i = 0; i < kSteps; ++i) {
            controls_.push_back({random.between(-1.0, 1.0), 0.0, random.between(-1.0, 1.0)});
            recorder.add_step({DriveVehicle{{0, 0}, controls_.back()}});
            if (i == kAmended) recorder.amend(other.save(), {.walked = 7.0});
            if (i == kAmended) recorder.amend(std::vector{4.0, 5.0});
            if (i % 2 == 1)
                recorder.add_frame(world, camera, {.walked = 0.5 * i},
                                   {.awake = 1, .touching_pairs = 2, .max_depth_m = 0.25});
        }
        ASSERT_TRUE(recorder.commit());
    }

    static constexpr std::uint64_t kSeed = 11;
    static constexpr int kSteps = 480, kAmended = 77;
    std::string path_;
    RunSettings settings_;
    std::vector<VehicleControls> controls_;
};

TEST_F(RunRecordFile, ReturnsWhatWasRecorded) {
    record_drive();
    const Result<RunRecord> record = RunRecord::open(path_);
    ASSERT_TRUE(record) << record.error().message;
    EXPECT_EQ(record->frame_count(), 1u + kSteps / 2);
    EXPECT_EQ(record->step_count(), std::size_t{kSteps});
    ASSERT_EQ(record->block_count(), 2u);
    EXPECT_EQ(record->first_frame(1), 150u);
    EXPECT_EQ(record->first_step(1), 300u);
    EXPECT_EQ(record->block_of(149), 0u);
    EXPECT_EQ(record->block_of(150), 1u);
    EXPECT_EQ(record->frame_at(-1.0), 0u);
    EXPECT_EQ(record->frame_at(7.0 / 30.0), 7u);
    EXPECT_EQ(record->frame_at(7.9 / 30.0), 7u);
    EXPECT_EQ(record->frame_at(99.0), std::size_t{kSteps} / 2);
    const RunSettings& settings = record->settings();
    EXPECT_EQ(settings.kind, RunKind::drive);
    EXPECT_EQ(settings.terrain_flags, settings_.terrain_flags);
    EXPECT_EQ(settings.terrain.name, "hills");
    EXPECT_EQ(settings.fps, 30.0);
    EXPECT_EQ(settings.dt, kDt);
    EXPECT_EQ(settings.camera.behind, 7.25);
    EXPECT_EQ(settings.camera.above, 2.5);
    EXPECT_EQ(settings.camera.target_above, 0.5);
    EXPECT_EQ(settings.camera.bearing, 0.1);
    EXPECT_EQ(settings.crate_count, 3u);
    EXPECT_EQ(settings.traveller, (BodyId{0, 0}));

    std::size_t step = 0;
    for (std::size_t i = 0; i < 2; ++i) {
        const RunBlock block = record->read(i).value();
        EXPECT_EQ(block.start.world, make_world(1.0).save());
        EXPECT_EQ(block.start.camera, (std::vector{1.0, 2.0, 3.0}));
        EXPECT_EQ(block.start.gait.walked, i == 0 ? 0.0 : 0.5 * 299);
        EXPECT_EQ(block.start.last.touching_pairs, i == 0 ? 0u : 2u);
        EXPECT_EQ(block.start.last.max_depth_m, i == 0 ? 0.0 : 0.25);
        EXPECT_EQ(block.start_frame_count, 1u);
        for (const RunStep& each : block.steps) {
            ASSERT_EQ(each.actions.size(), 1u);
            const auto& drive = std::get<DriveVehicle>(each.actions[0]);
            EXPECT_EQ(drive.vehicle, (BodyId{0, 0}));
            EXPECT_EQ(drive.controls.throttle, controls_[step].throttle);
            EXPECT_EQ(drive.controls.steer, controls_[step].steer);
            const bool is_amended = step == kAmended;
            EXPECT_EQ(each.world, is_amended ? make_world(2.0).save() : std::vector<std::byte>());
            EXPECT_EQ(each.gait.walked, is_amended ? 7.0 : 0.0);
            const std::vector<double> camera =
                is_amended ? std::vector{4.0, 5.0} : std::vector<double>();
            EXPECT_EQ(each.camera, camera);
            const bool starts_block = step == 299;
            EXPECT_EQ(each.frame_count, step % 2 == 1 && !starts_block ? 1u : 0u);
            ++step;
        }
    }
    EXPECT_EQ(step, std::size_t{kSteps});
}

TEST_F(RunRecordFile, ReturnsTheControlsOfACharacterAndFramesWithoutSteps) {
    RunRecorder recorder =
        RunRecorder::create(path_, {.kind = RunKind::walk, .fps = 200.0, .dt = 0.01}).value();
    const World world = make_world(1.0);
    recorder.add_frame(world, {}, {.heading = {0.0, 1.0}, .walked = 3.0}, {});
    recorder.add_frame(world, {}, {}, {});
    recorder.add_step({WalkCharacter{{4, 5}, {.velocity = {1.5, -0.25}, .jump_speed = 3.0}}});
    recorder.add_frame(world, {}, {}, {});
    recorder.add_frame(world, {}, {}, {});
    ASSERT_TRUE(recorder.commit());
    const RunRecord record = RunRecord::open(path_).value();
    EXPECT_EQ(record.frame_count(), 4u);
    const RunBlock block = record.read(0).value();
    EXPECT_EQ(block.start.gait.heading, Eigen::Vector2d(0.0, 1.0));
    EXPECT_EQ(block.start_frame_count, 2u);
    ASSERT_EQ(block.steps.size(), 1u);
    EXPECT_EQ(block.steps[0].frame_count, 2u);
    const auto& walk = std::get<WalkCharacter>(block.steps[0].actions.at(0));
    EXPECT_EQ(walk.character, (BodyId{4, 5}));
    EXPECT_EQ(walk.controls.velocity, WorldVec2(1.5, -0.25));
    EXPECT_EQ(walk.controls.jump_speed, 3.0);
}

TEST_F(RunRecordFile, ReturnsActionsOfAllKindsCamerasAndGroundOfAView) {
    RunRecorder recorder =
        RunRecorder::create(path_, {.kind = RunKind::view, .fps = 60.0, .dt = kDt}).value();
    const World world = make_world(1.0);
    CameraPose pose;
    pose.eye_world = {1.5, -2.5, 3.5};
    recorder.add_frame(world, numbers_of(pose), {}, {});
    const std::vector<RunAction> actions{
        PullBody{{0, 0}, {0.1, 0.2, 0.3}, {4.0, 5.0, 6.0}},
        WalkCharacter{{1, 2}, {.velocity = {1.0, 2.0}, .jump_speed = 3.0}, {0.6, 0.8}},
        DriveVehicle{{3, 4}, {.throttle = 0.5, .brake = 0.25, .steer = -1.0}},
        PullBody{{0, 0}, {0.4, 0.5, 0.6}, {7.0, 8.0, 9.0}}};
    for (int i = 0; i < 3; ++i) {
        recorder.add_step(i == 1 ? std::vector<RunAction>() : actions);
        pose.eye_world.x() += 1.0;
        recorder.amend(numbers_of(pose));
        recorder.add_frame();
    }
    const GroundEdit ball{true, {1.0, 2.0, 3.0}, {1.0, 2.0, 3.0}, 4.0};
    const GroundEdit tube{false, {1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}, 0.5};
    recorder.ground().set(1, std::vector{ball, tube});
    recorder.ground().set(2, std::vector{ball});
    ASSERT_TRUE(recorder.commit());
    const RunRecord record = RunRecord::open(path_).value();
    EXPECT_EQ(record.settings().kind, RunKind::view);
    EXPECT_TRUE(record.ground().at(0).empty());
    EXPECT_EQ(record.ground().at(1), (std::vector{ball, tube}));
    EXPECT_EQ(record.ground().at(2), (std::vector{ball}));
    const RunBlock block = record.read(0).value();
    ASSERT_EQ(block.steps.size(), 3u);
    EXPECT_EQ(block.steps[2].camera.at(0), 4.5);
    EXPECT_EQ(block.steps[2].camera.at(2), 3.5);
    EXPECT_TRUE(block.steps[1].actions.empty());
    ASSERT_EQ(block.steps[2].actions.size(), actions.size());
    const auto& first = std::get<PullBody>(block.steps[2].actions[0]);
    EXPECT_EQ(first.grip_body, WorldPos(0.1, 0.2, 0.3));
    const auto& pull = std::get<PullBody>(block.steps[2].actions[3]);
    EXPECT_EQ(pull.body, (BodyId{0, 0}));
    EXPECT_EQ(pull.grip_body, WorldPos(0.4, 0.5, 0.6));
    EXPECT_EQ(pull.hand_world, WorldPos(7.0, 8.0, 9.0));
    const auto& walk = std::get<WalkCharacter>(block.steps[2].actions[1]);
    EXPECT_EQ(walk.character, (BodyId{1, 2}));
    EXPECT_EQ(walk.controls.jump_speed, 3.0);
    EXPECT_EQ(walk.heading, WorldVec2(0.6, 0.8));
    const auto& drive = std::get<DriveVehicle>(block.steps[2].actions[2]);
    EXPECT_EQ(drive.controls.brake, 0.25);
}

TEST_F(RunRecordFile, ReturnsTheCamerasOfAFlight) {
    test::SeededRandom random(kSeed);
    std::vector<CameraPose> poses(5000);
    RunRecorder recorder = RunRecorder::create(path_, {.fps = 24.0}).value();
    for (CameraPose& pose : poses) {
        for (Eigen::Vector3d* v : {&pose.eye_world, &pose.forward, &pose.up, &pose.velocity}) {
            for (int axis = 0; axis < 3; ++axis) (*v)[axis] = random.between(-1e3, 1e3);
        }
        recorder.add_pose(pose);
    }
    ASSERT_TRUE(recorder.commit());
    const RunRecord record = RunRecord::open(path_).value();
    EXPECT_EQ(record.settings().kind, RunKind::flight);
    EXPECT_EQ(record.frame_count(), poses.size());
    const std::vector<CameraPose> read = record.read_poses().value();
    ASSERT_EQ(read.size(), poses.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_EQ(read[i].eye_world, poses[i].eye_world);
        EXPECT_EQ(read[i].forward, poses[i].forward);
        EXPECT_EQ(read[i].up, poses[i].up);
        EXPECT_EQ(read[i].velocity, poses[i].velocity);
    }
}

TEST_F(RunRecordFile, IsRefusedWhereverItIsCutOff) {
    record_drive();
    const std::vector<char> whole = bytes();
    constexpr std::size_t kCuts = 50;
    for (std::size_t cut = 0; cut < kCuts; ++cut) {
        write(std::span(whole).first(whole.size() * cut / kCuts));
        const Result<RunRecord> record = RunRecord::open(path_);
        ASSERT_FALSE(record) << cut;
        EXPECT_NE(record.error().message.find(path_), std::string::npos) << record.error().message;
        EXPECT_NE(record.error().message.find("cut off"), std::string::npos)
            << record.error().message;
    }
}

TEST_F(RunRecordFile, IsRefusedWhicheverByteIsDamaged) {
    record_drive();
    const std::vector<char> whole = bytes();
    test::SeededRandom random(kSeed);
    constexpr std::size_t kPlaces = 200;
    for (std::size_t i = 0; i < kPlaces; ++i) {
        std::vector<char> damaged = whole;
        const std::size_t place = whole.size() * i / kPlaces;
        damaged[place] = static_cast<char>(damaged[place] ^ (1 << (i % 8)));
        write(damaged);
        const Result<RunRecord> record = RunRecord::open(path_);
        ASSERT_FALSE(record) << place;
        EXPECT_NE(record.error().message.find(path_), std::string::npos) << record.error().message;
    }
}

TEST_F(RunRecordFile, OfAnotherVersionAndForeignFilesAreRefusedByName) {
    for (const std::uint32_t version : {1u, 3u}) {
        SealedWriter other = SealedWriter::create(path_, {{'T', 'R', 'U', 'N'}, version}).value();
        ASSERT_TRUE(other.commit({}));
        const Result<RunRecord> of_other = RunRecord::open(path_);
        ASSERT_FALSE(of_other);
        EXPECT_NE(of_other.error().message.find("version " + std::to_string(version)),
                  std::string::npos)
            << of_other.error().message;
        EXPECT_NE(of_other.error().message.find(path_), std::string::npos);
    }

    write(std::vector<char>(1000, 'x'));
    const Result<RunRecord> foreign = RunRecord::open(path_);
    ASSERT_FALSE(foreign);
    EXPECT_NE(foreign.error().message.find("is no "), std::string::npos);
    EXPECT_FALSE(RunRecord::open(path_ + ".none"));
}

TEST_F(RunRecordFile, OfAnotherTerrainIsRefused) {
    record_drive();
    const RunRecord record = RunRecord::open(path_).value();
    EXPECT_TRUE(record.check_terrain(make_terrain(7)));
    Terrain other = make_terrain(8);
    other.name = "other hills";
    const Result<void> refused = record.check_terrain(other);
    ASSERT_FALSE(refused);
    for (const std::string& word : {path_, std::string("'hills'"), std::string("'other hills'")})
        EXPECT_NE(refused.error().message.find(word), std::string::npos) << refused.error().message;
    Terrain with_bodies = make_terrain(7);
    with_bodies.bodies.resize(1);
    EXPECT_FALSE(record.check_terrain(with_bodies));
}

}  // namespace run_record_test
}  // namespace terrane::tools
