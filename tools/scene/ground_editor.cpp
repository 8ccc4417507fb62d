// SPDX-License-Identifier: MIT
#include "scene/ground_editor.h"

#include <terrane/volume/volume_editor.h>

#include <cstdint>
#include <deque>
#include <limits>
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

}  // namespace

struct GroundEditor::State {
    VolumeEditor editor;
    double spacing;  // of the finest level, metres
    struct Change {
        std::uint32_t number = 0;
        Aabb box;
    };
    std::vector<Aabb> done = {};      // of the digs and fills that undo() can undo, in order
    std::deque<Change> waiting = {};  // not applied yet, ascending

    void add(std::uint32_t number, const Aabb& box) { waiting.push_back({number, box}); }

    Aabb box_around(const WorldPos& from, const WorldPos& to, double radius) const {
        // the surface of the finest cells that the shape touches changes too
        const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius + spacing);
        return {from.cwiseMin(to) - reach, from.cwiseMax(to) + reach};
    }
};

GroundEditor::GroundEditor(std::unique_ptr<State> state) : state_(std::move(state)) {}
GroundEditor::~GroundEditor() = default;

CommandResult<std::unique_ptr<GroundEditor>> GroundEditor::create(Terrain& terrain,
                                                                  int worker_count) {
    TERRANE_TRY(const auto diggable, make_diggable(heightfield_of(terrain), terrain.volumes.get()));
    TERRANE_TRY(VolumeEditor editor,
                VolumeEditor::create(diggable, {.worker_count = worker_count}));
    terrain.source = diggable;
    const Lattice& lattice = diggable->lattice();
    return std::unique_ptr<GroundEditor>(new GroundEditor(std::make_unique<State>(
        State{std::move(editor), lattice.level_spacing(lattice.finest_level)})));
}

double GroundEditor::least_radius() const { return kLeastSpacings * state_->spacing; }

Result<void> GroundEditor::dig(const WorldPos& centre_world, double radius) {
    TERRANE_TRY(const std::uint32_t number,
                state_->editor.dig(VolumeSphere{radius}, {.translation = centre_world}));
    state_->done.push_back(state_->box_around(centre_world, centre_world, radius));
    state_->add(number, state_->done.back());
    return {};
}

Result<void> GroundEditor::dig(const WorldPos& from_world, const WorldPos& to_world,
                               double radius) {
    const VolumeTube tube{{WorldPos::Zero(), to_world - from_world}, radius};
    TERRANE_TRY(const std::uint32_t number, state_->editor.dig(tube, {.translation = from_world}));
    state_->done.push_back(state_->box_around(from_world, to_world, radius));
    state_->add(number, state_->done.back());
    return {};
}

Result<void> GroundEditor::fill(const WorldPos& centre_world, double radius) {
    TERRANE_TRY(const std::uint32_t number,
                state_->editor.fill(VolumeSphere{radius}, {.translation = centre_world}));
    state_->done.push_back(state_->box_around(centre_world, centre_world, radius));
    state_->add(number, state_->done.back());
    return {};
}

Result<void> GroundEditor::undo() {
    TERRANE_TRY(const std::uint32_t number, state_->editor.undo());
    state_->add(number, state_->done.back());
    state_->done.pop_back();
    return {};
}

Aabb GroundEditor::update(Pager& pager) {
    const std::uint32_t in_force = state_->editor.update(pager);
    Aabb changed = kEmptyBox;
    std::deque<State::Change>& waiting = state_->waiting;
    for (; !waiting.empty() && waiting.front().number <= in_force; waiting.pop_front())
        changed = joined(changed, waiting.front().box);
    return changed;
}

std::size_t GroundEditor::waiting() const { return state_->editor.stats().waiting; }

}  // namespace terrane::tools
