// SPDX-License-Identifier: MIT
#include "batch/horizon_profile.h"

#include <terrane/terrain/ray_fan.h>

#include <cmath>

namespace terrane {

struct RayFan::State {
    const Ground* ground = nullptr;
    WorldPos origin_world = WorldPos::Zero();
    internal::HorizonProfile horizon;
};

RayFan::RayFan() : state_(std::make_unique<State>()) {}
RayFan::RayFan(RayFan&&) noexcept = default;
RayFan& RayFan::operator=(RayFan&&) noexcept = default;
RayFan::~RayFan() = default;

void RayFan::reset(const Ground& ground, const WorldPos& origin_world, double reach) {
    state_->ground = &ground;
    state_->origin_world = origin_world;
    state_->horizon.build(ground, origin_world, std::max(0.0, reach));
}

const Ground* RayFan::ground() const { return state_->ground; }

RayAnswer RayFan::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    if (state_->ground == nullptr) return {};
    const Ground& ground = *state_->ground;
    const Eigen::Vector3d displacement = to_world - from_world;
    // The cell that is hit gives the same bits where the walk begins in another one, so it begins a diagonal earlier.
    // A ray that is nearly parallel to the lines may be given to the column beside by rounding where its walk begins:
    // it begins at its own start.
    constexpr double kSlowest = 1e-6, kEarlierCells = 1.5;
    const double spacing = ground.spacing();
    const auto is_slow = [&](double d) { return d != 0.0 && std::abs(d) < kSlowest * spacing; };
    const double length =
        std::sqrt(displacement.x() * displacement.x() + displacement.y() * displacement.y());
    if (!(length > 0.0) || is_slow(displacement.x()) || is_slow(displacement.y()))
        return ground.ray(from_world, to_world);
    const Eigen::Vector3d to_from = from_world - state_->origin_world;
    const double passed = std::sqrt(to_from.x() * to_from.x() + to_from.y() * to_from.y());
    const double clear =
        state_->horizon.clear_distance(to_world - state_->origin_world) - kEarlierCells * spacing;
    return ground.ray_after((clear - passed) / length, from_world, to_world);
}

}  // namespace terrane
