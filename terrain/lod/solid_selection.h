// SPDX-License-Identifier: MIT
#pragma once

#include "lod/frame_mesh.h"
#include "lod/screen_error.h"
#include "lod/selection.h"
#include "lod/solid_pins.h"

#include <terrane/terrain/triangulator.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Which chunks' volumes a frame draws, and at which level of detail.
///
/// Volumes of a chunk are drawn where leaving them out would be seen: where the distance that is hidden then is more
/// than a share of the target. The heightfield must be in the mesh at its finest level where they replace it, so these
/// triangles are pinned. Where it is not (the budget, absent chunks, fades), the heightfield closes over the volumes of
/// the whole chunk, and caps close those of its neighbours.
///
/// The level of detail is the coarsest whose error is at most a share of the target; coarser where volumes would take
/// more than half of the budget, and where that does not suffice, those are left out that hide the least.
class SolidSelection {
public:
    explicit SolidSelection(const HeightSource& source) : source_(&source) {}

    /// Chooses for a view; everything below is of the last call.
    ///
    /// @param budget      triangles for heightfield and volumes
    /// @param morph_ratio TriangulatorSettings
    void begin(const std::shared_ptr<const ResidentSet>& resident, const ScreenError& screen,
               double target_px, double morph_ratio, std::size_t budget);

    /// False: everything below is empty or 0.
    bool has_solids() const { return !solids_.empty() || !absent_.empty(); }
    const SolidPins& pins() const { return pins_; }
    /// Upper bound of triangle_count().
    std::size_t reserved_triangles() const { return reserved_; }
    /// Screen error of what is left out because the target allows it, pixels: what it leaves for the heightfield.
    double allowed_px() const { return allowed_px_; }

    /// Decides what is drawn, and tells the chunks which triangles of the heightfield are not. Requires mark_active()
    /// of all open chunks and, with morphing, their offsets.
    void decide(const VertexKeys& keys, const Morph& morph, float threshold,
                const ScreenError& screen);

    std::span<const MeshSolid> drawn() const { return drawn_; }
    std::size_t triangle_count() const { return triangle_count_; }
    /// Triangles of the heightfield that drawn volumes replace.
    std::size_t replaced_count() const { return replaced_count_; }

    /// Bounds of the screen error of volumes, pixels: of those drawn, of those left out, and of those not resident.
    double drawn_px() const { return drawn_px_; }
    double left_out_px() const { return left_out_px_; }
    double absent_px() const { return absent_px_; }

private:
    struct Solid {
        std::int32_t index = 0;  // in the resident set
        const Chunk* chunk = nullptr;
        std::shared_ptr<const ReplacedTriangles> replaced;
        ScreenError::WorldBox box;  // of its triangles and those that they replace
        // of the frame
        double hidden_px = 0.0;  // where it is left out
        double px_per_metre = 0.0;
        std::size_t level = 0;  // 0: the finest
        bool is_wanted = false;
        bool is_drawn = false;
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

    const HeightSource* source_;
    std::shared_ptr<const ResidentSet> followed_;
    std::vector<Solid> solids_;         // in the order of the resident set
    std::vector<AbsentExtent> absent_;  // volumes over absent chunks

    SolidPins pins_;
    std::vector<MeshSolid> drawn_;
    std::size_t reserved_ = 0, triangle_count_ = 0, replaced_count_ = 0;
    double allowed_px_ = 0.0, drawn_px_ = 0.0, left_out_px_ = 0.0, absent_px_ = 0.0;
};

}  // namespace terrane::internal
