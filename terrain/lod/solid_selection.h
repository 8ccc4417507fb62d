// SPDX-License-Identifier: MIT
#pragma once

#include "lod/frame_mesh.h"
#include "lod/screen_error.h"
#include "lod/selection.h"
#include "lod/solid_pins.h"

#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/triangulator.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Selects the chunks whose volumes a frame draws, and their levels of detail.
///
/// A chunk's volumes are drawn if omitting them would cause a screen error above a share of the target. Where volumes
/// replace the heightfield, it must be in the mesh at its finest level, so replaced triangles are pinned. If these
/// are not in the mesh (because of the budget, absent chunks or fades), all volumes of the chunk are omitted: the
/// heightfield closes over them, and caps close the volumes of the neighbours.
///
/// The level of detail is the coarsest one whose error is at most a share of the target. If volumes would then take
/// more than half of the budget, coarser levels are chosen; if that does not suffice, the volumes are omitted whose
/// omission causes the least error.
class SolidSelection {
public:
    explicit SolidSelection(const ChunkSource& source) : source_(&source) {}

    /// Selects for a view; the functions below refer to the last call.
    ///
    /// @param budget      triangles of heightfield and volumes together
    /// @param morph_ratio TriangulatorSettings::morph_ratio
    void begin(const std::shared_ptr<const ResidentSet>& resident, const ScreenError& screen,
               double target_px, double morph_ratio, std::size_t budget);

    /// If false, everything below is empty or 0.
    bool has_solids() const { return !solids_.empty() || !absent_.empty(); }
    const SolidPins& pins() const { return pins_; }
    /// Upper bound of triangle_count().
    std::size_t reserved_triangles() const { return reserved_; }
    /// Largest screen error of the volumes that are omitted within the target, pixels: the heightfield's error must be
    /// smaller than the target by this.
    double allowed_px() const { return allowed_px_; }

    /// Volumes of a chunk that may be drawn, and that replace triangles of its heightfield.
    struct Replacement {
        std::int32_t index = 0;  ///< of the chunk, in the resident set
        const ReplacedTriangles* triangles = nullptr;
        bool are_in_place = false;  ///< see are_in_place(); to be set before decide()
        bool is_drawn = false;      ///< set by decide()
    };
    /// One for each group of pins(), in the same order.
    std::span<Replacement> replacements() { return replacements_; }

    /// Decides which volumes are drawn.
    void decide(const Morph& morph, float threshold, const ScreenError& screen);

    std::span<const MeshSolid> drawn() const { return drawn_; }
    std::size_t triangle_count() const { return triangle_count_; }
    /// Triangles of the heightfield that drawn volumes replace.

    /// Bounds of the screen error, pixels: of drawn volumes; of volumes that are omitted because of the target or the
    /// budget; of volumes that are omitted because chunks are absent or fading.
    double drawn_px() const { return drawn_px_; }
    double left_out_px() const { return left_out_px_; }
    double absent_px() const { return absent_px_; }

private:
    struct Solid {
        std::int32_t index = 0;  // in the resident set
        const Chunk* chunk = nullptr;
        std::shared_ptr<const ReplacedTriangles> replaced;
        ScreenError::WorldBox box;  // contains its triangles and the triangles it replaces
        // per frame
        double hidden_px = 0.0;  // screen error if it is omitted
        double px_per_metre = 0.0;
        std::size_t level = 0;  // 0: the finest
        bool is_wanted = false;
        bool is_drawn = false;
        bool replaces() const { return is_wanted && replaced->count > 0; }
    };
    struct AbsentExtent {
        ScreenError::WorldBox box;
        double error_m = 0.0;
    };
    void follow(const std::shared_ptr<const ResidentSet>& resident);
    void list_absent(const ResidentSet& resident);
    std::size_t choose_levels(double allowed_px);
    void fit(double target_px, std::size_t budget);
    const Solid* find(std::int32_t index) const;
    bool is_drawn(std::int32_t index) const;
    void separate_corners();
    void draw(const Solid& solid);
    double drawn_error_px(const Solid& solid, const ScreenError& screen, double known_px) const;

    const ChunkSource* source_;
    std::shared_ptr<const ResidentSet> followed_;
    std::vector<Solid> solids_;         // in the order of the resident set
    std::vector<AbsentExtent> absent_;  // volumes over absent chunks

    SolidPins pins_;
    std::vector<Replacement> replacements_;
    std::vector<MeshSolid> drawn_;
    std::size_t reserved_ = 0, triangle_count_ = 0;
    double allowed_px_ = 0.0, drawn_px_ = 0.0, left_out_px_ = 0.0, absent_px_ = 0.0;
};

/// Whether all of a chunk's replaced triangles are in its mesh, with their corners at their final heights. Requires
/// mark_active() of all open chunks and, with morphing, their offsets.
bool are_in_place(const ReplacedTriangles& replaced, const OpenChunk& chunk, bool is_morphing);

}  // namespace terrane::internal
