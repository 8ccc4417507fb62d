// SPDX-License-Identifier: MIT
#pragma once

#include "flight/cameras.h"
#include "frames/body_nodes.h"
#include "record/run_record.h"
#include "scene/terrain_options.h"

#include <terrane/collision/world.h>

#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace terrane::tools {

/// The bodies of a drop as nodes of a scene.
class DropBodies {
public:
    /// Gives the bodies of the terrain's scene their nodes. The world has these bodies in the scene's order; if it was
    /// restored, other bodies may be between them. A node therefore goes to the next body, from `first_body` on, that
    /// has its body's shape.
    DropBodies(const Terrain& terrain, const World& world, std::size_t first_body,
               BodyNodes& nodes);

    /// Shows all bodies except the static objects of the scene, which are drawn themselves. Fails as BodyNodes::show()
    Result<void> show(const World& world, BodyNodes& nodes) const;

private:
    std::set<std::array<double, 3>> fixed_;  // positions of the static bodies of the scene
};

/// Columns of frames.csv of a drop, and their values.
std::vector<std::string> drop_columns();
std::vector<double> drop_figures(const StepFigures& last);

}  // namespace terrane::tools
