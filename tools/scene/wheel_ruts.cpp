// SPDX-License-Identifier: MIT
#include "scene/wheel_ruts.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kDepth = 0.15;       // metres, below the undisturbed ground
constexpr double kRadius = 0.5;       // metres, of the tube: wide enough for a tyre
constexpr double kStep = 0.5;         // metres of a wheel's path between digs
constexpr double kLeastSpeed = 0.3;   // m/s
constexpr double kLongestStep = 2.0;  // metres; a longer step means an airborne or teleported wheel

}  // namespace

struct WheelRuts::State {
    std::shared_ptr<const HeightSource> undisturbed;
    std::unique_ptr<GroundEditor> editor;
    /// For each wheel on the ground: where its last dig was or, before that, where it touched the ground; else absent.
    std::vector<std::optional<Eigen::Vector2d>> places = {};
    std::uint64_t digs = 0;

    WorldPos groove(const Eigen::Vector2d& p) const {
        return {p.x(), p.y(), undisturbed->height(p.x(), p.y()) - kDepth + kRadius};
    }
    bool is_rutted(const Eigen::Vector2d& p, const Ground& ground) const {
        const HeightAnswer now = ground.height(p.x(), p.y());
        return now.status == QueryStatus::ok &&
               now.height < undisturbed->height(p.x(), p.y()) - 0.5 * kDepth;
    }
};

WheelRuts::WheelRuts(std::unique_ptr<State> state) : state_(std::move(state)) {}
WheelRuts::~WheelRuts() = default;

CommandResult<std::unique_ptr<WheelRuts>> WheelRuts::create(Terrain& terrain, int worker_count) {
    const Lattice& lattice = terrain.source->lattice();
    const double spacing = lattice.level_spacing(lattice.finest_level);
    if (spacing > kMostRutSpacing) {
        return usage_error(fmt::format(
            "--ruts need a finest spacing of at most {} m, got {:.6g}: give --detail-m, or --seed "
            "for detail below a raster's cells",
            kMostRutSpacing, spacing));
    }
    const std::shared_ptr<const HeightSource> undisturbed = heightfield_of(terrain);
    TERRANE_TRY(auto editor, GroundEditor::create(terrain, worker_count));
    return std::unique_ptr<WheelRuts>(
        new WheelRuts(std::make_unique<State>(State{undisturbed, std::move(editor)})));
}

void WheelRuts::roll(const VehicleState& vehicle, double wheel_radius, const Ground& ground) {
    State& state = *state_;
    state.places.resize(vehicle.wheels.size());
    const Eigen::Vector2d velocity = vehicle.chassis.velocity.head<2>();
    const double speed = velocity.norm();
    const Eigen::Vector3d up = vehicle.chassis.pose.rotation.col(2);
    for (std::size_t i = 0; i < vehicle.wheels.size(); ++i) {
        const WheelState& wheel = vehicle.wheels[i];
        std::optional<Eigen::Vector2d>& place = state.places[i];
        if (!wheel.in_contact || wheel.body.is_valid()) {
            place.reset();
            continue;
        }
        // below the wheel's centre, because the contact point is not continuous in time
        const Eigen::Vector2d now = (wheel.centre_world - wheel_radius * up).head<2>();
        if (!place) place = now;
        const double travelled = (now - *place).norm();
        if (travelled < kStep || !(speed > kLeastSpeed)) continue;
        const Eigen::Vector2d from = *std::exchange(place, now);
        // the end of the groove, ahead of the wheel, so that the wheel does not roll over it
        const Eigen::Vector2d next = now + (wheel_radius + kStep) / speed * velocity;
        const double below =
            state.undisturbed->height(wheel.point_world.x(), wheel.point_world.y()) -
            wheel.point_world.z();
        const bool is_on_heightfield = std::abs(below) < 2.0 * kDepth;
        if (travelled > kLongestStep || !is_on_heightfield || state.is_rutted(next, ground))
            continue;
        // digging fails only at the world's border, where there is nothing to dig
        if (state.editor->add({.from_world = state.groove(from),
                               .to_world = state.groove(next),
                               .radius = kRadius}))
            ++state.digs;
    }
}

Aabb WheelRuts::update(Pager& pager) { return state_->editor->update(pager); }

std::span<const GroundEdit> WheelRuts::edits_in_force() const {
    return state_->editor->edits_in_force();
}

std::uint64_t WheelRuts::digs() const { return state_->digs; }

}  // namespace terrane::tools
