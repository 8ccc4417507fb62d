// SPDX-License-Identifier: MIT
#pragma once

#include "flight/cameras.h"
#include "frames/body_nodes.h"
#include "record/replay.h"
#include "record/run_record.h"
#include "scene/terrain_options.h"

#include <terrane/collision/world.h>

#include <array>
#include <cstddef>
#include <optional>
#include <set>
#include <span>
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

/// The index of the first crate in the world of a journey, and of the first body of its scene.
std::size_t first_crate(BodyId traveller);
std::size_t first_scene_body(BodyId traveller, std::size_t crate_count);

/// Gives the bodies of a scene, which have consecutive indices in a world, their nodes.
void set_nodes(std::span<const PlacedBody> of_scene, std::size_t first, BodyNodes& nodes);
/// Shows the crates of a journey and the bodies of its scene. Fails as BodyNodes::show()
Result<void> show_bodies(const World& world, BodyId traveller, std::size_t crate_count,
                         std::size_t scene_count, BodyNodes& nodes);

/// Shows the vehicle and the character of a view, if it has them, its crates and the bodies of its scene, which are the
/// first ones; not the static objects of the scene, which are drawn themselves. Fails as BodyNodes::show()
Result<void> show_view(const World& world, const CharacterGait& gait, std::size_t scene_count,
                       BodyNodes& nodes);

/// The bodies of a replay as nodes of a scene.
class ReplayBodies {
public:
    ReplayBodies(const Replay& replay, const Terrain& terrain, BodyNodes nodes);

    /// Shows the bodies of the replay's frame. Fails as BodyNodes::show()
    Result<void> show(const Replay& replay);

private:
    BodyNodes nodes_;
    std::optional<DropBodies> drop_;
    std::size_t scene_count_ = 0;
};

/// Columns of frames.csv of a drop, and their values.
std::vector<std::string> drop_columns();
std::vector<double> drop_figures(const StepFigures& last);

}  // namespace terrane::tools
