// SPDX-License-Identifier: MIT
#include "scene/ground_editor.h"

#include <terrane/volume/volume_editor.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kLeastSpacings = 2.0;  // of the finest spacing, in the least radius
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Aabb kEmptyBox{Eigen::Vector3d::Constant(kInfinity), Eigen::Vector3d::Constant(-kInfinity)};

Aabb joined(const Aabb& a, const Aabb& b) {
    return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
}

VolumeShape shape_of(const GroundEdit& edit) {
    if (edit.from_world == edit.to_world) return VolumeSphere{edit.radius};
    return VolumeTube{{WorldPos::Zero(), edit.to_world - edit.from_world}, edit.radius};
}

}  // namespace

struct GroundEditor::State {
    VolumeEditor editor;
    double spacing;  // of the finest level, metres
    struct Change {
        std::uint32_t number = 0;
        std::optional<GroundEdit> added = {};  // none: undoes the last
        Aabb box = {};
    };
    std::vector<GroundEdit> edits = {};     // that undo() can undo, in order
    std::vector<GroundEdit> in_force = {};  // in order
    std::deque<Change> waiting = {};        // not applied yet, ascending

    Aabb box_of(const GroundEdit& edit) const {
        // the surface of the finest cells that the shape touches changes too
        const Eigen::Vector3d reach = Eigen::Vector3d::Constant(edit.radius + spacing);
        return {edit.from_world.cwiseMin(edit.to_world) - reach,
                edit.from_world.cwiseMax(edit.to_world) + reach};
    }
};

GroundEditor::GroundEditor(std::unique_ptr<State> state) : state_(std::move(state)) {}
GroundEditor::~GroundEditor() = default;

CommandResult<std::unique_ptr<GroundEditor>> GroundEditor::create(
    Terrain& terrain, int worker_count, std::optional<std::size_t> cache_bytes) {
    TERRANE_TRY(const auto diggable, make_diggable(heightfield_of(terrain), terrain.volumes.get()));
    VolumeEditorSettings settings{.worker_count = worker_count};
    settings.memory_bytes = cache_bytes.value_or(settings.memory_bytes);
    TERRANE_TRY(VolumeEditor editor, VolumeEditor::create(diggable, settings));
    terrain.heightfield = heightfield_of(terrain);
    terrain.source = diggable;
    const Lattice& lattice = diggable->lattice();
    return std::unique_ptr<GroundEditor>(new GroundEditor(std::make_unique<State>(
        State{std::move(editor), lattice.level_spacing(lattice.finest_level)})));
}

double GroundEditor::least_radius() const { return kLeastSpacings * state_->spacing; }

Result<void> GroundEditor::add(const GroundEdit& edit) {
    const Pose world_from_shape{.translation = edit.from_world};
    TERRANE_TRY(const std::uint32_t number,
                edit.fills ? state_->editor.fill(shape_of(edit), world_from_shape)
                           : state_->editor.dig(shape_of(edit), world_from_shape));
    state_->edits.push_back(edit);
    state_->waiting.push_back({number, edit, state_->box_of(edit)});
    return {};
}

Result<void> GroundEditor::undo() {
    TERRANE_TRY(const std::uint32_t number, state_->editor.undo());
    state_->waiting.push_back({number, std::nullopt, state_->box_of(state_->edits.back())});
    state_->edits.pop_back();
    return {};
}

Result<void> GroundEditor::set_edits(std::span<const GroundEdit> edits) {
    const auto differ = std::ranges::mismatch(state_->edits, edits);
    const auto kept = static_cast<std::size_t>(differ.in1 - state_->edits.begin());
    while (state_->edits.size() > kept) TERRANE_TRY(undo());
    for (const GroundEdit& edit : edits.subspan(kept)) TERRANE_TRY(add(edit));
    return {};
}

Aabb GroundEditor::update(Pager& pager) {
    const std::uint32_t number = state_->editor.update(pager);
    Aabb changed = kEmptyBox;
    std::deque<State::Change>& waiting = state_->waiting;
    for (; !waiting.empty() && waiting.front().number <= number; waiting.pop_front()) {
        const State::Change& change = waiting.front();
        changed = joined(changed, change.box);
        if (change.added) {
            state_->in_force.push_back(*change.added);
        } else {
            state_->in_force.pop_back();
        }
    }
    return changed;
}

Result<Aabb> GroundEditor::finish(Pager& pager) {
    constexpr int kMostTries = 32;  // more only if the ground does not fit
    Aabb changed = update(pager);
    for (int tries = 0; waiting() > 0; ++tries) {
        if (tries == kMostTries) {
            return fail(ErrorCode::out_of_memory,
                        fmt::format("{} changes of the ground do not fit into the memory of chunks",
                                    waiting()));
        }
        state_->editor.wait();
        changed = joined(changed, update(pager));
    }
    return changed;
}

std::span<const GroundEdit> GroundEditor::edits_in_force() const { return state_->in_force; }

std::size_t GroundEditor::waiting() const { return state_->editor.stats().waiting; }

}  // namespace terrane::tools
