// SPDX-License-Identifier: MIT
#pragma once

#include "references/reference_maps.h"

#include <terrane/collision/world.h>

#include <Eigen/Core>

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace terrane::bench {

/// Bullet's dynamics world over a height field, sleeping off.
class BodiesPeer {
public:
    /// @param table outlives the world
    explicit BodiesPeer(const test::HeightTable& table);
    ~BodiesPeer();

    static std::string name();
    void add(const BodySettings& settings, const BodyState& state);
    /// One step of this length, seconds, without substeps.
    void step(double dt);
    Pose pose(std::size_t body) const;

private:
    struct World;
    std::unique_ptr<World> world_;
};

enum class PeerBroadphase {
    tree,        ///< dynamic bounding volume trees
    axis_sweep,  ///< sweep-and-prune along three axes
};

/// Bullet's collision world with spheres that are moved explicitly.
class BroadphasePeer {
public:
    BroadphasePeer(PeerBroadphase kind, double radius, std::span<const Eigen::Vector3d> centres);
    ~BroadphasePeer();

    /// Moves the spheres; returns the number of touching pairs.
    std::size_t step(std::span<const Eigen::Vector3d> centres);

private:
    struct World;
    std::unique_ptr<World> world_;
};

}  // namespace terrane::bench
