// SPDX-License-Identifier: MIT
#include "edit/editor_state.h"

#include <terrane/terrain/number_text.h>
#include <terrane/volume/volume_editor.h>

#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

namespace terrane {

using internal::Edit;

namespace {

constexpr const char* kNoEdit =
    "a dig or fill is a sphere, capsule, box or tube, not a mesh or file";

bool can_be_edit(const VolumeShape& shape) {
    return !std::holds_alternative<VolumeMesh>(shape) && !std::holds_alternative<VolumeFile>(shape);
}

}  // namespace

VolumeEditor::State::State(std::shared_ptr<VolumeHeights> ground,
                           const VolumeEditorSettings& chosen)
    : source(std::move(ground)),
      settings(chosen),
      volumes(source->volumes()),
      edited(source->edited()) {}

VolumeEditor::State::~State() {
    worker.request_stop();
    if (worker.joinable()) worker.join();
    edited.keep_tiles(0, nullptr);
}

VolumeEditor::VolumeEditor(std::unique_ptr<State> state) : state_(std::move(state)) {}
VolumeEditor::VolumeEditor(VolumeEditor&&) noexcept = default;
VolumeEditor& VolumeEditor::operator=(VolumeEditor&&) noexcept = default;
VolumeEditor::~VolumeEditor() = default;

Result<VolumeEditor> VolumeEditor::create(std::shared_ptr<VolumeHeights> source,
                                          const VolumeEditorSettings& settings) {
    if (!source) return fail(ErrorCode::invalid_argument, "an editor needs a source");
    if (settings.worker_count < 0 || settings.worker_count > 1) {
        return fail(ErrorCode::invalid_argument,
                    "worker_count must be 0 or 1, got " + number_text(settings.worker_count));
    }
    if (settings.undo_depth < 0 || settings.undo_depth > 1024) {
        return fail(ErrorCode::invalid_argument,
                    "undo_depth must be 0 to 1024, got " + number_text(settings.undo_depth));
    }
    auto state = std::make_unique<State>(std::move(source), settings);
    if (!settings.folder.empty()) {
        std::error_code status;
        std::filesystem::create_directories(settings.folder, status);
        if (status) {
            return fail(ErrorCode::io,
                        "cannot make \"" + settings.folder + "\": " + status.message());
        }
        auto log =
            internal::DigLog::open(settings.folder + "/digs.log", state->volumes.fingerprint());
        if (!log) return tl::unexpected(log.error());
        state->log = std::move(*log);
        state->files = std::make_shared<internal::ChunkFiles>(settings.folder, state->volumes);
        if (auto ok = state->replay(); !ok) return tl::unexpected(ok.error());
    }
    state->edited.keep_tiles(settings.memory_bytes, state->files);
    if (settings.worker_count == 1) {
        State* const shared = state.get();
        state->worker = std::jthread([shared](const std::stop_token& stop) { shared->run(stop); });
    }
    return VolumeEditor(std::move(state));
}

// Brings the log into force; lists are made once for each chunk.
Result<void> VolumeEditor::State::replay() {
    std::map<ChunkKey, internal::ChunkEdits> chunks;
    for (std::size_t i = 0; i < log->records().size(); ++i) {
        const internal::LogRecord& record = log->records()[i];
        const auto bad = [&](const std::string& why) {
            return fail(ErrorCode::bad_data,
                        "change " + number_text(record.number) + " of the log: " + why);
        };
        if (record.operation) {
            if (!can_be_edit(record.operation->shape)) return bad(kNoEdit);
            auto placed =
                PlacedVolume::create(volumes.lattice(), volumes.level(), *record.operation);
            if (!placed) return bad(placed.error().message);
            done.push_back(
                std::make_shared<const Edit>(record.number, *record.operation, std::move(*placed)));
        } else if (done.empty() || done.back()->number != record.undone) {
            return bad("it undoes " + number_text(record.undone) + ", which is not the last edit");
        }
        for (const ChunkKey& key : done.back()->chunks(volumes.level())) {
            internal::ChunkEdits& edits = chunks[key];
            edits.changed = record.number;
            if (record.operation) {
                edits.edits.push_back(done.back());
            } else {
                edits.edits.pop_back();
                edits.undone.push_back({record.undone, record.number});
            }
        }
        if (!record.operation) done.pop_back();
        files->add_position(record.number, log->hashes()[i]);
        last_number = record.number;
    }
    std::vector<internal::EditedVolumes::NewVersion> versions;
    for (auto& [key, edits] : chunks) {
        edits.base_extent = edited.extent_of(key);
        edits.extent = internal::extent_with(source->heights(), volumes, key, edits);
        versions.push_back(
            {key, {std::make_shared<const internal::ChunkEdits>(std::move(edits)), nullptr, 0}, 0});
    }
    edited.switch_to(versions, last_number);
    counts.torn_bytes = log->torn_bytes();
    return {};
}

Result<std::uint32_t> VolumeEditor::dig(const VolumeShape& shape, const Pose& world_from_shape) {
    return edit(VolumeOp::remove, shape, world_from_shape);
}

Result<std::uint32_t> VolumeEditor::fill(const VolumeShape& shape, const Pose& world_from_shape) {
    return edit(VolumeOp::add, shape, world_from_shape);
}

Result<std::uint32_t> VolumeEditor::edit(VolumeOp op, const VolumeShape& shape,
                                         const Pose& world_from_shape) {
    State& state = *state_;
    if (!can_be_edit(shape)) return fail(ErrorCode::invalid_argument, kNoEdit);
    VolumeOperation operation{op, shape, world_from_shape, state.volumes.spacing()};
    auto placed = PlacedVolume::create(state.volumes.lattice(), state.volumes.level(), operation);
    if (!placed) return tl::unexpected(placed.error());
    auto made = std::make_shared<const Edit>(state.last_number + 1, std::move(operation),
                                             std::move(*placed));
    state.done.push_back(made);
    return state.submit({made->number, std::move(made), false});
}

Result<std::uint32_t> VolumeEditor::undo() {
    State& state = *state_;
    if (state.done.empty())
        return fail(ErrorCode::invalid_argument, "there is no dig or fill to undo");
    auto last = std::move(state.done.back());
    state.done.pop_back();
    return state.submit({state.last_number + 1, std::move(last), true});
}

std::uint32_t VolumeEditor::State::submit(internal::Change change) {
    last_number = change.number;
    submitted.push_back(std::move(change));
    return last_number;
}

std::uint32_t VolumeEditor::update(Pager& pager) { return state_->update(&pager); }
std::uint32_t VolumeEditor::update() { return state_->update(nullptr); }

void VolumeEditor::wait() {
    State& state = *state_;
    State::Lock lock(state.mutex);
    state.changed.wait(lock, [&] { return state.is_idle(); });
}

Result<void> VolumeEditor::save() {
    State& state = *state_;
    if (!state.log)
        return fail(ErrorCode::invalid_argument, "this editor has no folder to save to");
    if (auto ok = state.log->save(); !ok) return ok;
    for (auto chunk = state.unsaved.begin(); chunk != state.unsaved.end();) {
        const internal::ChunkVersion version = state.edited.version_of(chunk->first);
        if (!version.is_made()) {
            ++chunk;
            continue;
        }
        if (auto ok = state.files->write(chunk->first, *version.tiles, version.edits->changed); !ok)
            return ok;
        chunk = state.unsaved.erase(chunk);
    }
    return {};
}

VolumeEditorStats VolumeEditor::stats() const {
    const State& state = *state_;
    const State::Lock lock(state.mutex);
    VolumeEditorStats stats = state.counts;
    stats.waiting = state.submitted.size() + state.queue.size() + state.prepared.size() +
                    (state.is_working ? 1u : 0u);
    stats.in_force = state.edited.number();
    if (state.files) {
        const internal::ChunkFiles::Counts files = state.files->counts();
        stats.files_read = files.read;
        stats.files_refused = files.refused;
        stats.files_written = files.written;
    }
    return stats;
}

std::string VolumeEditor::last_failure() const {
    const State::Lock lock(state_->mutex);
    const std::string refusal = state_->files ? state_->files->counts().last_refusal : "";
    return state_->last_failure.empty() ? refusal : state_->last_failure;
}

}  // namespace terrane
