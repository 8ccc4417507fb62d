// SPDX-License-Identifier: MIT
#include "scene/ground_brush.h"

#include <terrane/volume/volume_editor.h>

#include <deque>
#include <limits>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kLeastSpacings = 2.0;  // of the finest spacing, in the least radius of a brush
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Aabb kEmptyBox{Eigen::Vector3d::Constant(kInfinity), Eigen::Vector3d::Constant(-kInfinity)};

Aabb joined(const Aabb& a, const Aabb& b) {
    return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
}

}  // namespace

struct GroundBrush::State {
    VolumeEditor editor;
    double least_radius;
    std::vector<Aabb> done = {};  // boxes of the digs and fills that undo() can undo, in order
    struct Waiting {
        std::uint32_t change;
        Aabb box;
    };
    std::deque<Waiting> waiting = {};  // changes not applied yet, ascending

    Result<void> edit(bool digs, const WorldPos& centre, double radius) {
        const VolumeSphere ball{radius};
        const Pose pose{.translation = centre};
        TERRANE_TRY(const std::uint32_t change,
                    digs ? editor.dig(ball, pose) : editor.fill(ball, pose));
        const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius + least_radius);
        done.push_back({centre - reach, centre + reach});
        waiting.push_back({change, done.back()});
        return {};
    }
};

GroundBrush::GroundBrush(std::unique_ptr<State> state) : state_(std::move(state)) {}
GroundBrush::~GroundBrush() = default;

CommandResult<std::unique_ptr<GroundBrush>> GroundBrush::create(Terrain& terrain) {
    TERRANE_TRY(const auto diggable, make_diggable(heightfield_of(terrain), terrain.volumes.get()));
    TERRANE_TRY(VolumeEditor editor, VolumeEditor::create(diggable, {}));
    terrain.source = diggable;
    const Lattice& lattice = diggable->lattice();
    return std::unique_ptr<GroundBrush>(new GroundBrush(std::make_unique<State>(
        State{std::move(editor), kLeastSpacings * lattice.level_spacing(lattice.finest_level)})));
}

double GroundBrush::least_radius() const { return state_->least_radius; }

Result<void> GroundBrush::dig(const WorldPos& centre_world, double radius) {
    return state_->edit(true, centre_world, radius);
}

Result<void> GroundBrush::fill(const WorldPos& centre_world, double radius) {
    return state_->edit(false, centre_world, radius);
}

Result<void> GroundBrush::undo() {
    TERRANE_TRY(const std::uint32_t change, state_->editor.undo());
    if (state_->done.empty()) return {};
    state_->waiting.push_back({change, state_->done.back()});
    state_->done.pop_back();
    return {};
}

Aabb GroundBrush::update(Pager& pager) {
    const std::uint32_t in_force = state_->editor.update(pager);
    Aabb changed = kEmptyBox;
    std::deque<State::Waiting>& waiting = state_->waiting;
    for (; !waiting.empty() && waiting.front().change <= in_force; waiting.pop_front())
        changed = joined(changed, waiting.front().box);
    return changed;
}

std::size_t GroundBrush::waiting() const { return state_->editor.stats().waiting; }

}  // namespace terrane::tools
