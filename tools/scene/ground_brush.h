// SPDX-License-Identifier: MIT
#pragma once

#include "scene/terrain_options.h"

#include <terrane/base/math.h>
#include <terrane/terrain/pager.h>

#include <cstddef>
#include <memory>

namespace terrane::tools {

/// A round brush that digs and fills while frames are made, by a VolumeEditor.
class GroundBrush {
public:
    /// Makes the terrain's source diggable: call before a pager is created.
    ///
    /// Fails: as make_diggable() and VolumeEditor::create(); exit_failed if the program was built without
    ///        terrane::volume
    static CommandResult<std::unique_ptr<GroundBrush>> create(Terrain& terrain);
    ~GroundBrush();

    /// Least radius that the ground's finest spacing can show, metres.
    double least_radius() const;

    /// Removes or adds a ball of ground. Fails as VolumeEditor::dig()
    Result<void> dig(const WorldPos& centre_world, double radius);
    Result<void> fill(const WorldPos& centre_world, double radius);
    /// Undoes the last of these. Fails with invalid_argument if there is none.
    Result<void> undo();

    /// Applies completed changes. Call once a frame, before Pager::update().
    ///
    /// Returns: bounds of the change, metres; empty (low > high) if nothing changed
    Aabb update(Pager& pager);

    /// Changes that are not in the ground yet.
    std::size_t waiting() const;

private:
    struct State;
    explicit GroundBrush(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
