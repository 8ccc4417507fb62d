// SPDX-License-Identifier: MIT
#pragma once

#include "scene/terrain_options.h"

#include <terrane/base/math.h>
#include <terrane/terrain/pager.h>

#include <cstddef>
#include <memory>

namespace terrane::tools {

/// Digs and fills the ground while frames are made, by a VolumeEditor, and tells where the ground has changed.
class GroundEditor {
public:
    /// Makes the terrain's source diggable: call before a pager is created.
    ///
    /// @param worker_count of the VolumeEditor: 0 or 1
    ///
    /// Fails: as make_diggable() and VolumeEditor::create(); exit_failed if the program was built without
    ///        terrane::volume
    static CommandResult<std::unique_ptr<GroundEditor>> create(Terrain& terrain, int worker_count);
    ~GroundEditor();

    /// Least radius of a ball that the ground's finest spacing can show, metres.
    double least_radius() const;

    /// Removes a ball of ground, or the ground in a tube from one point to another. Fails as VolumeEditor::dig()
    ///
    /// @param radius metres
    Result<void> dig(const WorldPos& centre_world, double radius);
    Result<void> dig(const WorldPos& from_world, const WorldPos& to_world, double radius);
    /// Adds a ball of ground. Fails as VolumeEditor::fill()
    Result<void> fill(const WorldPos& centre_world, double radius);
    /// Undoes the last dig or fill that has not been undone. Fails with invalid_argument if there is none.
    Result<void> undo();

    /// Applies completed changes. Call once a frame, before Pager::update().
    ///
    /// Returns: bounds of the change, metres; empty (low > high) if nothing changed
    Aabb update(Pager& pager);

    /// Changes that are not in the ground yet.
    std::size_t waiting() const;

private:
    struct State;
    explicit GroundEditor(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
