// SPDX-License-Identifier: MIT
#include "record/replay.h"

#include "commands/journey.h"
#include "support/grounds.h"
#include "support/meshes.h"
#include "support/random.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace terrane::tools {
namespace replay_test {

constexpr std::size_t kMemory = std::size_t{256} << 20;
constexpr double kSeconds = 16.0;

/// A frame of a live run: place of the eye, and of the traveller or nothing.
struct LiveFrame {
    WorldPos eye_world;
    std::vector<double> figures;
};

struct LiveRun {
    std::vector<LiveFrame> frames;
    std::uint64_t state_hash = 0;
};

enum class Kind { drive_among_crates, walk_among_crates, drive_among_boulders, drop };

void PrintTo(Kind kind, std::ostream* out) {
    *out << std::vector{"drive among crates", "walk among crates", "drive among boulders",
                        "drop"}[static_cast<std::size_t>(kind)];
}

// Rolling hills, with boulders that bodies collide with where they are wanted.
Terrain make_terrain(Kind kind) {
    Terrain terrain{.source = test::rolling_hills(), .dem = {}, .name = "hills"};
    if (kind == Kind::drive_among_boulders) {
        auto objects = std::make_shared<SceneObjects>();
        objects->meshes = {test::make_rock(2, 1)};
        objects->files = {"rock.obj"};
        objects->names = {"rock"};
        objects->scatters = {{0, {.per_km2 = 2500.0, .seed = 2}, 0.1}};
        terrain.objects = objects;
    }
    return terrain;
}

LiveRun play(Journey& journey, const FlightOptions& options, const Terrain& terrain,
             const Traveller& traveller, RunRecorder* recorder) {
    FrameMaker maker = FrameMaker::create(terrain.source, frame_maker_settings(options)).value();
    FlightOutput output =
        FlightOutput::create(options, terrain, Journey::columns(traveller)).value();
    BodyNodes nodes = output.add_bodies(terrain, maker).value();
    const CommandResult<void> played = journey.play(maker, output, nodes, recorder);
    EXPECT_TRUE(played) << played.error().message;
    LiveRun run;
    for (const FrameRecord& frame : output.frames())
        run.frames.push_back({frame.eye_world, frame.extra});
    run.state_hash = journey.state_hash();
    return run;
}

LiveRun record_journey(Kind kind, const Terrain& terrain, const std::string& path) {
    FlightOptions options;
    options.threads = 0;
    options.budget = 300;
    options.size = {64, 48};
    const bool walks = kind == Kind::walk_among_crates;
    const std::size_t crates = kind == Kind::drive_among_boulders ? 0 : 40;
    const DrivePlan plan{.path = Polyline({{-100.0, 0.0}, {-60.0, 5.0}, {0.0, 0.0}, {100.0, 50.0}}),
                         .speed = walks ? 3.0 : 9.0,
                         .frame_count = static_cast<std::size_t>(kSeconds * options.fps)};
    std::unique_ptr<Traveller> traveller;
    if (walks) {
        traveller = std::make_unique<CharacterTraveller>(CharacterSettings(), plan.path, plan.speed,
                                                         *terrain.source);
    } else {
        const VehicleSettings settings = make_vehicle(VehicleKind::truck);
        PathDriver driver =
            PathDriver::create(plan.path.points(), {.cruise_speed = plan.speed}).value();
        const std::vector<Eigen::Vector2d>& points = plan.path.points();
        traveller =
            std::make_unique<VehicleTraveller>(settings, std::move(driver), OnRoll::right,
                                               *terrain.source, points[0], points[1] - points[0]);
    }
    Journey journey =
        Journey::create(options, terrain, plan, crates, ChaseCameraSettings(), *traveller).value();
    RunSettings settings = journey.run_settings(walks ? RunKind::walk : RunKind::drive);
    settings.terrain = identify(terrain);
    RunRecorder recorder = RunRecorder::create(path, settings).value();
    const LiveRun run = play(journey, options, terrain, *traveller, &recorder);
    EXPECT_TRUE(recorder.commit());
    return run;
}

// Balls that roll down the hills, with a frame that none, one or two steps precede.
LiveRun record_drop(const Terrain& terrain, const std::string& path) {
    constexpr double kDt = 1.0 / 50.0, kFps = 70.0;
    Pager pager = Pager::create(terrain.source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({-100.0, -100.0, 100.0, 100.0}, 0.0);
    pager.update({}, {}, 0.0);
    World world = World::create({}).value();
    for (int i = 0; i < 20; ++i) {
        BodyState ball;
        const int column = i % 5, row = i / 5;
        const double x = 4.0 * column, y = 4.0 * row;
        ball.pose.translation = {x, y, pager.ground().height(x, y).height + 2.0 + i};
        EXPECT_TRUE(world.add({.shape = Sphere{0.5}}, ball));
    }
    DropCamera camera(terrain.source, world.states());
    RunRecorder recorder =
        RunRecorder::create(
            path, {.kind = RunKind::drop, .terrain = identify(terrain), .fps = kFps, .dt = kDt})
            .value();
    LiveRun run;
    StepFigures last;
    const auto show_until = [&](double time) {
        for (; static_cast<double>(run.frames.size()) / kFps <= time;) {
            if (!run.frames.empty()) camera.follow(world.states(), 1.0 / kFps);
            recorder.add_frame(world, camera.state(), CharacterGait(), last);
            run.frames.push_back({camera.view(View()).eye_world,
                                  {static_cast<double>(last.awake),
                                   static_cast<double>(last.touching_pairs), last.max_depth_m}});
        }
    };
    show_until(0.0);
    const auto step_count = static_cast<int>(kSeconds / kDt);
    for (int step = 1; step <= step_count; ++step) {
        const StepReport report = world.step(pager.ground(), kDt);
        last = {report.awake, report.touching_pairs, report.max_depth_m};
        recorder.add_step({});
        show_until(kDt * step);
    }
    run.state_hash = world.state_hash();
    EXPECT_TRUE(recorder.commit());
    return run;
}

class ReplayOf : public testing::TestWithParam<Kind> {
protected:
    ReplayOf()
        : path_((std::filesystem::temp_directory_path() /
                 ("terrane_replay_" + std::to_string(getpid()) + "_" +
                  std::to_string(static_cast<int>(GetParam()))))
                    .string()),
          terrain_(make_terrain(GetParam())),
          run_(GetParam() == Kind::drop ? record_drop(terrain_, path_)
                                        : record_journey(GetParam(), terrain_, path_)) {}
    ~ReplayOf() override { std::filesystem::remove(path_); }

    Replay open() const {
        return Replay::create(RunRecord::open(path_).value(), terrain_, kMemory).value();
    }
    static std::vector<double> figures_of(const Replay& replay) {
        if (GetParam() == Kind::drop) {
            const StepFigures& last = replay.figures();
            return {static_cast<double>(last.awake), static_cast<double>(last.touching_pairs),
                    last.max_depth_m};
        }
        const BodyId traveller = replay.record().settings().traveller;
        std::vector<double> figures =
            journey_figures(replay.world().state(traveller), replay.figures());
        const VehicleState* const vehicle = replay.world().vehicle(traveller);
        const std::vector<double> more =
            vehicle != nullptr ? vehicle_figures(*vehicle)
                               : character_figures(*replay.world().character(traveller));
        figures.insert(figures.end(), more.begin(), more.end());
        return figures;
    }
    void expect_live(const Replay& replay) const {
        const LiveFrame& frame = run_.frames.at(replay.frame());
        EXPECT_EQ(replay.view(View()).eye_world, frame.eye_world);
        EXPECT_EQ(figures_of(replay), frame.figures);
    }

    std::string path_;
    Terrain terrain_;
    LiveRun run_;
};

TEST_P(ReplayOf, HasBodiesAndCamerasOfTheRunInEveryFrame) {
    Replay replay = open();
    ASSERT_EQ(replay.record().frame_count(), run_.frames.size());
    // the replay compares its state with the run's at the start of each
    ASSERT_GE(replay.record().block_count(), 3u);
    expect_live(replay);
    for (std::size_t frame = 1; frame < run_.frames.size() && !HasFailure(); ++frame) {
        const Result<void> advanced = replay.advance();
        ASSERT_TRUE(advanced) << advanced.error().message;
        expect_live(replay);
    }
    ASSERT_TRUE(replay.finish());
    EXPECT_EQ(replay.world().state_hash(), run_.state_hash);
    ASSERT_TRUE(replay.seek(run_.frames.size() - 1));
    expect_live(replay);
}

TEST_P(ReplayOf, HasTheSameStateWhetherPlayedOrSought) {
    Replay played = open();
    std::vector<std::vector<std::byte>> worlds{played.world().save()};
    while (worlds.size() < run_.frames.size()) {
        ASSERT_TRUE(played.advance());
        worlds.push_back(played.world().save());
    }
    test::SeededRandom random(5);
    Replay sought = open();
    for (int i = 0; i < 12; ++i) {
        const auto frame =
            static_cast<std::size_t>(random.below(static_cast<int>(run_.frames.size())));
        const Result<void> found = sought.seek(frame);
        ASSERT_TRUE(found) << found.error().message;
        ASSERT_EQ(sought.frame(), frame);
        ASSERT_EQ(sought.world().save(), worlds[frame]) << frame;
        expect_live(sought);
    }
}

INSTANTIATE_TEST_SUITE_P(Runs, ReplayOf,
                         testing::Values(Kind::drive_among_crates, Kind::walk_among_crates,
                                         Kind::drive_among_boulders, Kind::drop));

// The recorded steps let a ball fall, but the recorded states keep it in the air.
TEST(Replay, NamesTheStepsAfterWhichItDiffersFromTheRun) {
    const Terrain terrain = make_terrain(Kind::drop);
    const std::string path = (std::filesystem::temp_directory_path() /
                              ("terrane_replay_" + std::to_string(getpid()) + "_other"))
                                 .string();
    World world = World::create({}).value();
    BodyState ball;
    ball.pose.translation = {0.0, 0.0, 500.0};
    ASSERT_TRUE(world.add({.shape = Sphere{0.5}}, ball));
    const DropCamera camera(terrain.source, world.states());
    constexpr int kSteps = 60;
    RunRecorder recorder =
        RunRecorder::create(
            path, {.kind = RunKind::drop, .terrain = identify(terrain), .fps = 1.0, .dt = 0.1})
            .value();
    recorder.add_frame(world, camera.state(), CharacterGait(), {});
    for (int i = 0; i < kSteps; ++i) recorder.add_step({});
    recorder.add_frame(world, camera.state(), CharacterGait(), {});  // the ball has not fallen
    ASSERT_TRUE(recorder.commit());
    Replay replay = Replay::create(RunRecord::open(path).value(), terrain, kMemory).value();
    const Result<void> advanced = replay.advance();
    ASSERT_FALSE(advanced);
    EXPECT_NE(advanced.error().message.find("differs from the run after 60 steps"),
              std::string::npos)
        << advanced.error().message;
    std::filesystem::remove(path);
}

}  // namespace replay_test
}  // namespace terrane::tools
