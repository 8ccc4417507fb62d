// SPDX-License-Identifier: MIT
#include "record/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kHorizonSteps = 4.0;  // of the pager; ground is loaded before each step

StepFigures figures_of(const StepReport& report) {
    return {report.awake, report.touching_pairs, report.max_depth_m};
}

}  // namespace

Replay::Replay(RunRecord record, const Terrain& terrain, Pager pager, ObjectBodies objects,
               World world)
    : record_(std::move(record)),
      terrain_(&terrain),
      pager_(std::move(pager)),
      objects_(std::move(objects)),
      world_(std::move(world)) {}

Result<Replay> Replay::create(RunRecord record, const Terrain& terrain, std::size_t memory_bytes) {
    const RunSettings& settings = record.settings();
    TERRANE_TRY(Pager pager,
                Pager::create(terrain.source, {.memory_bytes = memory_bytes,
                                               .worker_count = 0,
                                               .horizon = kHorizonSteps * settings.dt,
                                               .contact_spacing = settings.contact_spacing}));
    TERRANE_TRY(ObjectBodies objects, ObjectBodies::create(terrain.source, terrain.objects.get()));
    TERRANE_TRY(World world, World::create({}));
    Replay replay(std::move(record), terrain, std::move(pager), std::move(objects),
                  std::move(world));
    TERRANE_TRY(replay.enter(0));
    (void)replay.load_ground();
    return replay;
}

// The pose that the camera of a drive or walk follows.
Pose Replay::target_pose() const {
    const RunSettings& settings = record_.settings();
    const BodyState& body = world_.state(settings.traveller);
    return settings.kind == RunKind::walk ? gait_.world_from_capsule(body.pose.translation)
                                          : body.pose;
}

Result<void> Replay::load(std::span<const std::byte> world) {
    TERRANE_TRY(world_, World::load(world));
    objects_.take_over();
    return {};
}

Result<void> Replay::set_camera(std::span<const double> state) {
    const std::size_t size = is_drop() ? DropCamera::kStateSize : ChaseCamera::kStateSize;
    if (state.size() != size) {
        return fail(ErrorCode::bad_data,
                    fmt::format("the record '{}' has a camera of {} numbers, where {} belong",
                                record_.path(), state.size(), size));
    }
    if (is_drop()) {
        CameraState<DropCamera::kStateSize> numbers{};
        std::ranges::copy(state, numbers.begin());
        drop_camera_->restore(numbers);
    } else {
        CameraState<ChaseCamera::kStateSize> numbers{};
        std::ranges::copy(state, numbers.begin());
        chase_camera_->restore(numbers);
    }
    return {};
}

std::vector<double> Replay::camera_state() const {
    if (is_drop()) {
        const auto state = drop_camera_->state();
        return {state.begin(), state.end()};
    }
    const auto state = chase_camera_->state();
    return {state.begin(), state.end()};
}

// Goes to the start of a block.
Result<void> Replay::enter(std::size_t block) {
    TERRANE_TRY(block_, record_.read(block));
    TERRANE_TRY(load(block_.start.world));
    const RunSettings& settings = record_.settings();
    if (world_.states().empty() || (!is_drop() && !world_.contains(settings.traveller))) {
        return fail(ErrorCode::bad_data,
                    fmt::format("the record '{}' lacks the body that it follows", record_.path()));
    }
    gait_ = block_.start.gait;
    figures_ = block_.start.last;
    if (is_drop() && !drop_camera_) drop_camera_.emplace(terrain_->source, world_.states());
    if (!is_drop() && !chase_camera_)
        chase_camera_.emplace(*terrain_->source, target_pose(), settings.camera);
    TERRANE_TRY(set_camera(block_.start.camera));
    block_index_ = block;
    frame_ = record_.first_frame(block);
    step_count_ = record_.first_step(block);
    steps_in_block_ = 0;
    frames_of_state_ = 1;
    is_finished_ = false;
    return {};
}

// Compares the hash of the current state with the recorded one. Fails with bad_data, naming the step, if they differ.
Result<void> Replay::check_start(std::size_t block) const {
    if (hash_of_state(world_, camera_state(), gait_) == record_.state_hash(block)) return {};
    return fail(ErrorCode::bad_data,
                fmt::format("the replay of '{}' differs from the run after {} steps, at {:.6g} s",
                            record_.path(), step_count_, time()));
}

Result<void> Replay::seek(std::size_t frame) {
    const std::size_t block = record_.block_of(frame);
    if (block != block_index_ || frame < frame_ || is_finished_) TERRANE_TRY(enter(block));
    while (frame_ < frame) TERRANE_TRY(advance());
    return {};
}

Result<void> Replay::advance() {
    const RunSettings& settings = record_.settings();
    const auto frames_here = [&] {
        return steps_in_block_ == 0 ? block_.start_frame_count
                                    : block_.steps[steps_in_block_ - 1].frame_count;
    };
    while (frames_of_state_ >= frames_here()) {
        if (steps_in_block_ == block_.steps.size()) {
            // the block's last step led to the start of the next block
            ++frame_;
            if (is_drop()) drop_camera_->follow(world_.states(), 1.0 / settings.fps);
            const std::size_t next = block_index_ + 1;
            if (next >= record_.block_count() || record_.first_frame(next) != frame_) {
                return fail(ErrorCode::bad_data,
                            fmt::format("the record '{}' has no frame {}", record_.path(), frame_));
            }
            TERRANE_TRY(check_start(next));
            TERRANE_TRY(block_, record_.read(next));
            block_index_ = next;
            steps_in_block_ = 0;
            frames_of_state_ = 1;
            return {};
        }
        TERRANE_TRY(step(block_.steps[steps_in_block_]));
        ++steps_in_block_;
        frames_of_state_ = 0;
    }
    ++frames_of_state_;
    ++frame_;
    if (is_drop()) drop_camera_->follow(world_.states(), 1.0 / settings.fps);
    return {};
}

Result<void> Replay::finish() {
    for (; steps_in_block_ < block_.steps.size(); ++steps_in_block_)
        TERRANE_TRY(step(block_.steps[steps_in_block_]));
    is_finished_ = true;
    return {};
}

// Loads the ground that bodies and camera need.
Ground Replay::load_ground() {
    const std::span<const BodyNeed> of_world = world_.needs();
    needs_.assign(of_world.begin(), of_world.end());
    if (chase_camera_) needs_.push_back(chase_camera_->need());
    pager_.update({}, needs_, clock_);
    return pager_.ground(terrain_->surface);
}

Result<void> Replay::step(const RunStep& step) {
    const RunSettings& settings = record_.settings();
    clock_ += settings.dt;
    ++step_count_;
    const Ground ground = load_ground();
    TERRANE_TRY(objects_.follow(world_, ground));
    for (const RunAction& action : step.actions) TERRANE_TRY(apply(action, world_));
    figures_ = figures_of(world_.step(ground, settings.dt));
    if (!step.world.empty()) TERRANE_TRY(load(step.world));
    if (is_drop()) return {};
    if (const CharacterState* const character = world_.character(settings.traveller)) {
        // the controls that were set last
        for (const RunAction& action : step.actions) {
            if (const auto* walk = std::get_if<WalkCharacter>(&action))
                gait_.follow(*character, walk->controls, settings.dt);
        }
    }
    chase_camera_->follow(target_pose(), settings.dt, ground, world_, settings.traveller);
    if (!step.camera.empty()) TERRANE_TRY(set_camera(step.camera));
    return {};
}

View Replay::view(const View& view) const {
    return is_drop() ? drop_camera_->view(view) : chase_camera_->view(view);
}

const Eigen::Vector3d& Replay::camera_velocity() const {
    return is_drop() ? drop_camera_->velocity() : chase_camera_->velocity();
}

}  // namespace terrane::tools
