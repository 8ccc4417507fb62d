// SPDX-License-Identifier: MIT
#pragma once

#include "scene/terrain_options.h"

#include <terrane/base/math.h>
#include <terrane/terrain/pager.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>

namespace terrane::tools {

/// A dig or fill of the ground: of a ball, or of a tube from one point to another.
struct GroundEdit {
    bool fills = false;  ///< adds ground; otherwise removes it
    WorldPos from_world = WorldPos::Zero(), to_world = WorldPos::Zero();  ///< equal: a ball
    double radius = 0.0;                                                  ///< metres
    friend bool operator==(const GroundEdit&, const GroundEdit&) = default;
};

/// Digs and fills the ground while frames are made, by a VolumeEditor, and tells where the ground has changed.
class GroundEditor {
public:
    /// Makes the terrain's source diggable: call before a pager is created.
    ///
    /// @param worker_count of the VolumeEditor: 0 or 1
    /// @param cache_bytes  VolumeEditorSettings::memory_bytes; absent: its default
    ///
    /// Fails: as make_diggable() and VolumeEditor::create(); exit_failed if the program was built without
    ///        terrane::volume
    static CommandResult<std::unique_ptr<GroundEditor>> create(
        Terrain& terrain, int worker_count, std::optional<std::size_t> cache_bytes = {});
    ~GroundEditor();

    /// Least radius of a ball that the ground's finest spacing can show, metres.
    double least_radius() const;

    /// Digs or fills. Fails as VolumeEditor::dig()
    Result<void> add(const GroundEdit& edit);
    /// Undoes the last dig or fill that has not been undone. Fails with invalid_argument if there is none.
    Result<void> undo();

    /// Undoes the edits, in force or not, from the first that differs from `edits` on, and adds those that are missing.
    ///
    /// Fails: as add()
    Result<void> set_edits(std::span<const GroundEdit> edits);

    /// Applies completed changes. Call once a frame, before Pager::update().
    ///
    /// Returns: bounds of the change, metres; empty (low > high) if nothing changed
    Aabb update(Pager& pager);
    /// As update(), but blocks until all changes are in force. Not for use in a frame that must not wait.
    ///
    /// Fails: out_of_memory if the changed ground does not fit below the pager's ceiling
    Result<Aabb> finish(Pager& pager);

    /// The edits in force from the pager's next update on, in order.
    std::span<const GroundEdit> edits_in_force() const;

    /// Changes that are not in the ground yet.
    std::size_t waiting() const;

private:
    struct State;
    explicit GroundEditor(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
