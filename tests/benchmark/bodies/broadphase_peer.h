// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <memory>
#include <span>

namespace terrane::bench {

enum class PeerBroadphase {
    tree,        ///< dynamic trees of boxes
    axis_sweep,  ///< sweep-and-prune along three axes
};

/// Bullet's collision world with spheres that are moved by hand.
class BroadphasePeer {
public:
    BroadphasePeer(PeerBroadphase kind, double radius, std::span<const Eigen::Vector3d> centres);
    ~BroadphasePeer();

    /// Moves the spheres; how many pairs of them touch.
    std::size_t step(std::span<const Eigen::Vector3d> centres);

private:
    struct World;
    std::unique_ptr<World> world_;
};

}  // namespace terrane::bench
