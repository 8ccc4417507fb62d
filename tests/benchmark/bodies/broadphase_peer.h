// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <memory>
#include <span>

namespace terrane::bench {

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
