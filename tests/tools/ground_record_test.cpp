// SPDX-License-Identifier: MIT
//
// Records of what a user does in a view, digs included.
#include "record/replay.h"
#include "support/grounds.h"
#include "support/random.h"
#include "view/live_history.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <vector>

namespace terrane::tools {
namespace ground_record_test {

constexpr std::size_t kMemory = std::size_t{256} << 20;

TEST(GroundLog, HasTheEditsOfEveryStepWhateverIsUndoneAndForgotten) {
    const std::uint64_t seed = 20261201;
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::Random random(seed);
    GroundLog log;
    std::vector<std::vector<GroundEdit>> steps(1);  // the edits of each step
    std::size_t undone = 0, forgotten = 0;
    for (int i = 0; i < 2000; ++i) {
        std::vector<GroundEdit> now = steps.back();
        const int what = random.below(8);
        if (what < 3) {
            now.push_back({.fills = what == 0, .radius = static_cast<double>(i)});
        } else if (what == 3 && !now.empty()) {
            now.pop_back();
            ++undone;
        } else if (what == 4 && random.below(6) == 0) {
            steps.resize(1 +
                         static_cast<std::size_t>(random.below(static_cast<int>(steps.size()))));
            log.forget_after(steps.size() - 1);
            ++forgotten;
            continue;
        } else if (what > 5) {
            steps.push_back(now);
            continue;
        }
        steps.back() = now;
        log.set(steps.size() - 1, now);
    }
    EXPECT_GT(undone, 100u);
    EXPECT_GT(forgotten, 10u);
    ASSERT_GT(steps.size(), 20u);
    std::uint64_t next = GroundLog::kNever;
    for (std::size_t step = steps.size(); step-- > 0;) {
        ASSERT_EQ(log.at(step), steps[step]) << step;
        ASSERT_LE(log.next_change(step), next) << step;
        if (step > 0 && steps[step] != steps[step - 1]) next = step;
    }
    EXPECT_TRUE(GroundLog().is_empty());
}

/// What the user of a view does, without its window.
class ViewOfHills {
public:
    ViewOfHills(Terrain& terrain, std::size_t history_bytes, RunRecorder* recorder)
        : editor_(GroundEditor::create(terrain, 0).value()),
          pager_(Pager::create(terrain.source, {.worker_count = 0}).value()),
          live_(LiveWorld::create(terrain).value()),
          history_(history_bytes, recorder) {}

    LiveWorld& live() { return live_; }
    LiveHistory& history() { return history_; }

    /// The user has changed the world.
    void change() {
        history_.change(live_);
        remember();
    }
    void edit_ground(const GroundEdit& edit) {
        ASSERT_TRUE(editor_->add(edit));
        change_ground();
    }
    void undo() {
        if (editor_->undo()) change_ground();
    }
    void step() {
        pager_.update({}, live_.needs(), time_ += LiveWorld::kStep);
        ASSERT_TRUE(history_.step(live_, pager_.ground()));
        remember();
    }
    void show(const CameraPose& camera) {
        for (std::size_t step = cameras.size(); step <= history_.step_count(); ++step)
            cameras[step] = camera;
        history_.show(camera);
    }
    Result<void> seek(std::size_t step) {
        return history_.seek(
            step, live_, [this](std::span<const GroundEdit> edits) { return ground_with(edits); });
    }

    std::size_t edit_count() const { return editor_->edits_in_force().size(); }

    std::map<std::size_t, std::uint64_t> hashes;  // of the state before each step
    std::map<std::size_t, CameraPose> cameras;
    std::map<std::size_t, std::size_t> edit_counts;  // in force

private:
    Result<Ground> ground_with(std::span<const GroundEdit> edits) {
        TERRANE_TRY(editor_->set_edits(edits));
        TERRANE_TRY(editor_->finish(pager_));
        pager_.update({}, live_.needs(), time_ += LiveWorld::kStep);
        return pager_.ground();
    }
    void change_ground() {
        const Aabb changed = editor_->finish(pager_).value();
        pager_.update({}, live_.needs(), time_ += LiveWorld::kStep);
        live_.change_ground(changed);
        history_.change_ground(live_, editor_->edits_in_force());
        remember();
    }
    void remember() {
        const std::size_t now = history_.step_now();
        hashes[now] = live_.world().state_hash();
        edit_counts[now] = editor_->edits_in_force().size();
        hashes.erase(hashes.upper_bound(now), hashes.end());
        edit_counts.erase(edit_counts.upper_bound(now), edit_counts.end());
        cameras.erase(cameras.upper_bound(now), cameras.end());
    }

    std::unique_ptr<GroundEditor> editor_;
    Pager pager_;
    LiveWorld live_;
    LiveHistory history_;
    double time_ = 0.0;
};

class RecordOfAView : public testing::Test {
protected:
    RecordOfAView()
        : path_((std::filesystem::temp_directory_path() /
                 ("terrane_view_" + std::to_string(getpid()) + "_" +
                  testing::UnitTest::GetInstance()->current_test_info()->name()))
                    .string()),
          recorder_(RunRecorder::create(path_, {.kind = RunKind::view,
                                                .terrain = identify(terrain_),
                                                .fps = 1.0 / LiveWorld::kStep,
                                                .dt = LiveWorld::kStep})
                        .value()) {}
    ~RecordOfAView() override { std::filesystem::remove(path_); }

    // Drives, walks, throws, pulls, digs, fills and undoes; goes back to the past some times, and goes on there.
    void play(ViewOfHills& view, test::Random& random, std::size_t frame_count) {
        LiveWorld& live = view.live();
        const double height = terrain_.source->height(0.0, 0.0);
        for (std::size_t i = 0; i < frame_count; ++i) {
            const WorldPos place =
                live.body().is_valid() ? live.pose().translation : WorldPos(5.0, 0.0, height);
            switch (i % 300) {
                case 0:
                    live.drive(i % 600 == 0 ? VehicleKind::truck : VehicleKind::tracked,
                               place.head<2>(), 1e3, {1.0, 0.0});
                    view.change();
                    break;
                case 40:
                case 150:
                    ASSERT_TRUE(live.throw_crate(place + WorldPos(3.0, 0.0, 6.0),
                                                 {random.between(-5, 5), 0.0, 0.0}));
                    view.change();
                    break;
                case 60:
                case 75:
                case 180:
                    view.edit_ground({.fills = i % 2 == 1,
                                      .from_world = place + WorldPos(3.0, 1.0, -1.0),
                                      .to_world = place + WorldPos(3.0, 1.0, -1.0),
                                      .radius = 2.5});
                    break;
                case 100:
                    view.undo();
                    break;
                case 120:
                    live.walk(place.head<2>(), 1e3, {0.0, 1.0});
                    view.change();
                    break;
                case 200:
                    live.grab(live.world().id(0),
                              live.world().state(live.world().id(0)).pose.translation);
                    break;
                case 230:
                    live.let_go();
                    break;
                case 250:
                    live.leave();
                    view.change();
                    break;
                case 280: {
                    const std::size_t to = view.history().step_now() - 25;
                    ASSERT_TRUE(view.seek(to));
                    view.undo();
                    break;
                }
                default:
                    break;
            }
            if (live.grabbed().is_valid())
                live.pull_to(place + WorldPos(2.0, random.between(-2, 2), 4.0));
            live.steer(
                VehicleControls{.throttle = random.between(-1, 1), .steer = random.between(-1, 1)});
            live.steer(WorldVec2(random.between(-3, 3), random.between(-3, 3)), i % 40 == 0);
            if (live.being() == Being::walker && !live.is_waiting())
                live.turn(random.between(-0.1, 0.1));
            for (int steps = random.below(3); steps > 0; --steps) view.step();
            CameraPose camera;
            for (Eigen::Vector3d* v : {&camera.eye_world, &camera.velocity})
                *v = {random.between(-9, 9), random.between(-9, 9), random.between(0, 9)};
            view.show(camera);
        }
    }

    Terrain terrain_{.source = test::rolling_hills(), .dem = {}, .name = "hills"};
    std::string path_;
    RunRecorder recorder_;
};

TEST_F(RecordOfAView, HasItsBodiesCamerasAndGroundWhetherPlayedOrSought) {
    const std::uint64_t seed = 1201;
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::Random random(seed);
    constexpr std::size_t kHistoryBytes = 700'000;  // less than the run has
    Terrain diggable = terrain_;
    ViewOfHills view(diggable, kHistoryBytes, &recorder_);
    play(view, random, 1800);
    ASSERT_FALSE(HasFailure());
    const LiveHistory& history = view.history();
    EXPECT_GT(history.first_step(), 100u);
    EXPECT_LE(history.bytes(), kHistoryBytes);
    EXPECT_EQ(view.live().totals().fell_through, 0u);
    std::set<std::size_t> edit_counts;
    for (const auto& [step, count] : view.edit_counts) edit_counts.insert(count);
    EXPECT_GT(edit_counts.size(), 3u);
    view.history().finish(view.live());
    ASSERT_TRUE(recorder_.commit());

    Replay replay = Replay::create(RunRecord::open(path_).value(), terrain_, kMemory).value();
    const RunRecord& record = replay.record();
    EXPECT_EQ(record.settings().kind, RunKind::view);
    ASSERT_EQ(record.step_count(), history.step_count());
    ASSERT_EQ(record.frame_count(), history.step_count() + 1);
    ASSERT_GE(record.block_count(), 3u);
    const auto expect_run = [&] {
        const std::size_t step = replay.step_count();
        ASSERT_EQ(replay.frame(), step);
        ASSERT_EQ(replay.world().state_hash(), view.hashes.at(step)) << step;
        ASSERT_EQ(replay.ground_edits().size(), view.edit_counts.at(step)) << step;
        const CameraPose& camera = view.cameras.at(step);
        ASSERT_EQ(replay.view(View()).eye_world, camera.eye_world) << step;
        ASSERT_EQ(replay.camera_velocity(), camera.velocity) << step;
    };
    expect_run();
    while (replay.frame() + 1 < record.frame_count()) {
        const Result<void> advanced = replay.advance();
        ASSERT_TRUE(advanced) << advanced.error().message;
        ASSERT_NO_FATAL_FAILURE(expect_run());
    }
    for (int i = 0; i < 15; ++i) {
        const auto frame =
            static_cast<std::size_t>(random.below(static_cast<int>(record.frame_count())));
        const Result<void> found = replay.seek(frame);
        ASSERT_TRUE(found) << found.error().message;
        ASSERT_NO_FATAL_FAILURE(expect_run());
    }
    ASSERT_TRUE(replay.seek(record.frame_count() - 1));
    ASSERT_TRUE(replay.finish());
    EXPECT_EQ(replay.world().state_hash(), view.live().world().state_hash());
}

TEST_F(RecordOfAView, WithoutAStepHasItsStart) {
    Terrain diggable = terrain_;
    ViewOfHills view(diggable, kMemory, &recorder_);
    view.show({});
    view.history().finish(view.live());
    ASSERT_TRUE(recorder_.commit());
    const Replay replay = Replay::create(RunRecord::open(path_).value(), terrain_, kMemory).value();
    EXPECT_EQ(replay.record().frame_count(), 1u);
    EXPECT_EQ(replay.world().state_hash(), view.live().world().state_hash());
}

TEST_F(RecordOfAView, ThePastHasTheGroundThatItHad) {
    const std::uint64_t seed = 1202;
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::Random random(seed);
    Terrain diggable = terrain_;
    ViewOfHills view(diggable, kMemory, nullptr);
    play(view, random, 500);
    ASSERT_FALSE(HasFailure());
    const auto hashes = view.hashes;
    const auto edits = view.edit_counts;
    ASSERT_EQ(view.history().first_step(), 0u);
    for (int i = 0; i < 20; ++i) {
        const auto step =
            static_cast<std::size_t>(random.below(static_cast<int>(view.history().step_count())));
        const Result<void> found = view.seek(step);
        ASSERT_TRUE(found) << found.error().message;
        ASSERT_EQ(view.history().step_now(), step);
        ASSERT_EQ(view.live().world().state_hash(), hashes.at(step)) << step;
        ASSERT_EQ(view.edit_count(), edits.at(step)) << step;
    }
}

}  // namespace ground_record_test
}  // namespace terrane::tools
