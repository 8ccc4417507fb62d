// SPDX-License-Identifier: MIT
#pragma once

#include "references/reference_maps.h"

#include <terrane/collision/world.h>

#include <memory>
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

}  // namespace terrane::bench
