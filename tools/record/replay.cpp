// SPDX-License-Identifier: MIT
#include "record/replay.h"

#include "flight/flight_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kHorizonSteps = 4.0;  // of the pager; ground is loaded before each step

}  // namespace

Replay::Replay(RunRecord record, Terrain terrain, std::unique_ptr<GroundEditor> editor, Pager pager,
               ObjectBodies objects, World world)
    : record_(std::move(record)),
      terrain_(std::move(terrain)),
      editor_(std::move(editor)),
      pager_(std::move(pager)),
      objects_(std::move(objects)),
      world_(std::move(world)) {}

Result<Replay> Replay::create(RunRecord record, const Terrain& terrain, std::size_t memory_bytes) {
    const RunSettings& settings = record.settings();
    Terrain own = terrain;
    std::unique_ptr<GroundEditor> editor;
    if (!record.ground().is_empty()) {
        CommandResult<std::unique_ptr<GroundEditor>> made = GroundEditor::create(own, 0);
        if (!made) return fail(ErrorCode::invalid_argument, made.error().message);
        editor = *std::move(made);
    }
    TERRANE_TRY(Pager pager,
                Pager::create(own.source, {.memory_bytes = memory_bytes,
                                           .worker_count = 0,
                                           .horizon = kHorizonSteps * settings.dt,
                                           .contact_spacing = settings.contact_spacing}));
    TERRANE_TRY(ObjectBodies objects, ObjectBodies::create(own.source, own.objects.get()));
    TERRANE_TRY(World world, World::create({}));
    Replay replay(std::move(record), std::move(own), std::move(editor), std::move(pager),
                  std::move(objects), std::move(world));
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
    const std::size_t size = is_drop()   ? DropCamera::kStateSize
                             : is_view() ? kPoseNumbers
                                         : ChaseCamera::kStateSize;
    if (state.size() != size) {
        return fail(ErrorCode::bad_data,
                    fmt::format("the record '{}' has a camera of {} numbers, where {} belong",
                                record_.path(), state.size(), size));
    }
    if (is_drop()) {
        CameraState<DropCamera::kStateSize> numbers{};
        std::ranges::copy(state, numbers.begin());
        drop_camera_->restore(numbers);
    } else if (is_view()) {
        CameraState<kPoseNumbers> numbers{};
        std::ranges::copy(state, numbers.begin());
        pose_ = pose_of(numbers);
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
    if (is_view()) {
        const auto numbers = numbers_of(pose_);
        return {numbers.begin(), numbers.end()};
    }
    const auto state = chase_camera_->state();
    return {state.begin(), state.end()};
}

// Brings the ground to that of the current step. Returns bounds of the change.
Result<Aabb> Replay::change_ground() {
    ground_edits_ = record_.ground().at(step_count_);
    next_change_ = record_.ground().next_change(step_count_);
    TERRANE_TRY(editor_->set_edits(ground_edits_));
    return editor_->finish(pager_);
}

// Goes to the start of a block.
Result<void> Replay::enter(std::size_t block) {
    TERRANE_TRY(block_, record_.read(block));
    TERRANE_TRY(load(block_.start.world));
    const RunSettings& settings = record_.settings();
    const bool is_followed = !is_drop() && !is_view();
    if ((is_drop() && world_.states().empty()) ||
        (is_followed && !world_.contains(settings.traveller))) {
        return fail(ErrorCode::bad_data,
                    fmt::format("the record '{}' lacks the body that it follows", record_.path()));
    }
    gait_ = block_.start.gait;
    figures_ = block_.start.last;
    if (is_drop() && !drop_camera_) drop_camera_.emplace(terrain_.source, world_.states());
    if (is_followed && !chase_camera_)
        chase_camera_.emplace(*terrain_.source, target_pose(), settings.camera);
    TERRANE_TRY(set_camera(block_.start.camera));
    block_index_ = block;
    frame_ = record_.first_frame(block);
    step_count_ = record_.first_step(block);
    steps_in_block_ = 0;
    frames_of_state_ = 1;
    is_finished_ = false;
    if (editor_) TERRANE_TRY(change_ground());
    return {};
}

// Compares the hash of the current state with the recorded one. Fails with bad_data, naming the step, if they differ.
Result<void> Replay::check_start(std::size_t block) const {
    if (hash_of_state(world_.state_hash(), camera_state(), gait_) == record_.state_hash(block))
        return {};
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
    return pager_.ground(terrain_.surface);
}

Result<void> Replay::step(const RunStep& step) {
    const RunSettings& settings = record_.settings();
    clock_ += settings.dt;
    ++step_count_;
    const Ground ground = load_ground();
    TERRANE_TRY(objects_.follow(world_, ground));
    for (const RunAction& action : step.actions) TERRANE_TRY(apply(action, world_));
    figures_ = figures_of(world_.step(ground, settings.dt));
    for (const RunAction& action : step.actions) {
        const auto* const walk = std::get_if<WalkCharacter>(&action);
        const CharacterState* const character = walk ? world_.character(walk->character) : nullptr;
        if (character != nullptr) advance_gait(*walk, *character, settings.dt, gait_);
    }
    if (!step.world.empty()) {
        TERRANE_TRY(load(step.world));
        gait_ = step.gait;
    }
    if (chase_camera_)
        chase_camera_->follow(target_pose(), settings.dt, ground, world_, settings.traveller);
    if (!step.camera.empty()) TERRANE_TRY(set_camera(step.camera));
    if (step_count_ < next_change_) return {};
    TERRANE_TRY(const Aabb changed, change_ground());
    // in a stored world the bodies there are awake
    if (step.world.empty()) world_.wake(changed);
    return {};
}

View Replay::view(const View& view) const {
    if (is_view()) return view_at(view, pose_);
    return is_drop() ? drop_camera_->view(view) : chase_camera_->view(view);
}

const Eigen::Vector3d& Replay::camera_velocity() const {
    if (is_view()) return pose_.velocity;
    return is_drop() ? drop_camera_->velocity() : chase_camera_->velocity();
}

}  // namespace terrane::tools
