// SPDX-License-Identifier: MIT
#include "lod/solid_selection.h"

#include "lod/frame_mesh.h"

#include <algorithm>
#include <array>

namespace terrane::internal {
namespace {

/// Share of the target that omitted volumes may use.
constexpr double kHiddenShare = 0.2;
/// Share of the target that the error of the volumes' level of detail may use.
constexpr double kLevelShare = 0.5;
/// Share of the budget that volumes may use.
constexpr double kBudgetShare = 0.5;
/// While volumes exceed their share of the budget, the allowed error grows by kCoarser, at most kMostTries times.
constexpr double kCoarser = 1.2;
constexpr int kMostTries = 100;
/// Pinned vertices must not morph: their priority exceeds the one at which morphing ends by this factor.
constexpr double kPinMargin = 1.1;

std::size_t level_triangles(const SolidTriangles& solid, std::size_t level) {
    return level == 0 ? solid.triangles.size() : solid.levels[level - 1].triangles.size();
}

double level_error(const SolidTriangles& solid, std::size_t level) {
    return level == 0 ? 0.0 : solid.levels[level - 1].error_m;
}

std::size_t cap_triangles(const SolidTriangles& solid) {
    std::size_t count = 0;
    for (const auto& cap : solid.caps) count += cap.size();
    return count;
}

// Corner and midpoint of a square's triangles, in samples from the square's south-western corner; its centre is (1, 1).
struct Sample {
    int column, row;
};
constexpr std::array<Sample, 4> kCorners{{{0, 0}, {2, 0}, {2, 2}, {0, 2}}};
constexpr std::array<Sample, 4> kMiddles{{{1, 0}, {2, 1}, {1, 2}, {0, 1}}};

// Box that contains a part of a chunk's triangles and the true surface near it.
ScreenError::WorldBox widened(const SolidErrorBox& part, double error_m) {
    return {part.box_world.low - Eigen::Vector3d::Constant(error_m),
            part.box_world.high + Eigen::Vector3d::Constant(error_m)};
}

// Upper bound of the screen error, pixels per metre, over a chunk's volumes: from the box around all of them, or, if
// that is so near that no coarser level is within `allowed_px`, from the boxes of their parts.
double nearest_px_per_metre(const SolidTriangles& solid, double in_box, double allowed_px,
                            const ScreenError& screen) {
    if (solid.levels.empty() || solid.error_boxes.empty()) return in_box;
    if (solid.levels.front().error_m * in_box <= allowed_px) return in_box;
    double px = 0.0;
    for (const SolidErrorBox& part : solid.error_boxes)
        px = std::max(px, screen.error_in_view(widened(part, part.error_m), 1.0));
    return px;
}

}  // namespace

bool are_in_place(const ReplacedTriangles& replaced, const OpenChunk& chunk, bool is_morphing) {
    for (const ReplacedTriangles::OfArea& of_area : replaced.areas) {
        const AreaBits bits = area_bits(chunk, of_area.area);
        for (std::size_t i = 0; i < kSquareTriangles; ++i) {
            if ((of_area.squares[i] & ~(bits.centre & bits.split[i / 2])) != 0) return false;
        }
        if (!is_morphing) continue;
        const int west = of_area.area % kChunkAreas * kAreaCells;
        const int south = of_area.area / kChunkAreas * kAreaCells;
        for (std::size_t i = 0; i < kSquareTriangles; ++i) {
            const Sample corner = kCorners[(i + 1) / 2 % 4], middle = kMiddles[i / 2];
            bool is_in_place = true;
            for_each_bit(of_area.squares[i], [&](int square) {
                const int column = west + 2 * (square % kAreaSquares);
                const int row = south + 2 * (square / kAreaSquares);
                for (const Sample& sample : {corner, middle, Sample{1, 1}}) {
                    is_in_place =
                        is_in_place &&
                        chunk.offsets[sample_index(column + sample.column, row + sample.row)] ==
                            0.0f;
                }
            });
            if (!is_in_place) return false;
        }
    }
    return true;
}

void SolidSelection::follow(const std::shared_ptr<const ResidentSet>& resident) {
    if (followed_ != nullptr && resident->has_same_chunks(*followed_)) {
        followed_ = resident;
        return;
    }
    const std::vector<Solid> before = std::move(solids_);
    solids_.clear();
    for (const std::int32_t index : resident->solids()) {
        const Chunk& chunk = *resident->chunks()[static_cast<std::size_t>(index)];
        Solid& made = solids_.emplace_back();
        made.index = index;
        made.chunk = &chunk;
        // followed_ keeps the previous chunks alive, so no address was reused: equal pointers mean the same surface
        const auto known = std::ranges::find(
            before, chunk.solid.get(), [](const Solid& solid) { return solid.chunk->solid.get(); });
        made.replaced = known != before.end()
                            ? known->replaced
                            : std::make_shared<const ReplacedTriangles>(*chunk.solid);
        const Aabb& bounds = chunk.solid->bounds();
        made.box = {bounds.low, bounds.high};
        if (made.replaced->count > 0) {
            // replaced triangles are within hidden_error_m of the others
            made.box.low.array() -= chunk.solid->triangles().hidden_error_m;
            made.box.high.array() += chunk.solid->triangles().hidden_error_m;
        }
    }
    list_absent(*resident);
    followed_ = resident;
}

void SolidSelection::list_absent(const ResidentSet& resident) {
    absent_.clear();
    const Lattice& lattice = resident.lattice();
    bool has_any = false;
    for (std::size_t i = 0; i < resident.chunks().size(); ++i) {
        const Chunk& chunk = *resident.chunks()[i];
        if (chunk.key.level > 0 && !has_any) return;  // roots come first
        if (chunk.key.level == lattice.finest_level || !source_->solid_extent(chunk.key)) continue;
        has_any = true;
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            if (resident.links(i).child[static_cast<std::size_t>(quadrant)] != ResidentSet::kNone)
                continue;
            const ChunkKey child = chunk.key.child(quadrant);
            const auto extent = source_->solid_extent(child);
            if (!extent) continue;
            const LatticePoint corner = lattice.corner(child);
            const std::int64_t side = lattice.chunk_side(child.level);
            AbsentExtent absent;
            absent.error_m = extent->error_m;
            absent.box = {
                {lattice.x(corner.x), lattice.y(corner.y), extent->heights.low},
                {lattice.x(corner.x + side), lattice.y(corner.y + side), extent->heights.high}};
            absent_.push_back(absent);
        }
    }
}

// Chooses levels whose errors are at most allowed_px; returns the number of triangles.
std::size_t SolidSelection::choose_levels(double allowed_px) {
    std::size_t count = 0;
    for (Solid& solid : solids_) {
        if (!solid.is_wanted) continue;
        const SolidTriangles& triangles = solid.chunk->solid->triangles();
        solid.level = 0;
        while (solid.level < triangles.levels.size() &&
               level_error(triangles, solid.level + 1) * solid.px_per_metre <= allowed_px) {
            ++solid.level;
        }
        count += level_triangles(triangles, solid.level) + cap_triangles(triangles);
    }
    return count;
}

// Chooses levels that fit into the volumes' share of the budget.
void SolidSelection::fit(double target_px, std::size_t budget) {
    const auto most = static_cast<std::size_t>(kBudgetShare * static_cast<double>(budget));
    double allowed_px = kLevelShare * target_px;
    reserved_ = choose_levels(allowed_px);
    for (int i = 0; i < kMostTries && reserved_ > most; ++i) {
        allowed_px *= kCoarser;
        reserved_ = choose_levels(allowed_px);
    }
    while (reserved_ > most) {
        Solid* least = nullptr;
        for (Solid& solid : solids_) {
            if (solid.is_wanted && (least == nullptr || solid.hidden_px < least->hidden_px))
                least = &solid;
        }
        const SolidTriangles& triangles = least->chunk->solid->triangles();
        reserved_ -= level_triangles(triangles, least->level) + cap_triangles(triangles);
        least->is_wanted = false;
    }
}

void SolidSelection::begin(const std::shared_ptr<const ResidentSet>& resident,
                           const ScreenError& screen, double target_px, double morph_ratio,
                           std::size_t budget) {
    follow(resident);
    pins_.clear();
    replacements_.clear();
    drawn_.clear();
    reserved_ = triangle_count_ = 0;
    allowed_px_ = drawn_px_ = left_out_px_ = absent_px_ = 0.0;
    for (const AbsentExtent& absent : absent_) {
        absent_px_ = std::max(absent_px_, screen.error_in_view(absent.box, absent.error_m));
    }
    for (Solid& solid : solids_) {
        const SolidTriangles& triangles = solid.chunk->solid->triangles();
        const double in_box = screen.error_in_view(solid.box, 1.0);
        solid.hidden_px = in_box * triangles.hidden_error_m;
        solid.is_wanted = solid.hidden_px > kHiddenShare * target_px;
        solid.px_per_metre = solid.is_wanted ? nearest_px_per_metre(triangles, in_box,
                                                                    kLevelShare * target_px, screen)
                                             : in_box;
        solid.is_drawn = false;
        if (!solid.is_wanted) allowed_px_ = std::max(allowed_px_, solid.hidden_px);
    }
    fit(target_px, budget);
    // volumes whose omission costs kHiddenShare of the target are just in place at the target's threshold
    const double per_hidden_px = kPinMargin * 0.5 * (morph_ratio + 1.0) / kHiddenShare;
    for (const Solid& solid : solids_) {
        if (!solid.replaces()) continue;
        pins_.add(*solid.chunk, *solid.replaced, screen.key_of(per_hidden_px * solid.hidden_px));
        replacements_.push_back({solid.index, solid.replaced.get()});
    }
}

const SolidSelection::Solid* SolidSelection::find(std::int32_t index) const {
    const auto found = std::ranges::lower_bound(solids_, index, {}, &Solid::index);
    return found != solids_.end() && found->index == index ? &*found : nullptr;
}

bool SolidSelection::is_drawn(std::int32_t index) const {
    const Solid* solid = index == ResidentSet::kNone ? nullptr : find(index);
    return solid != nullptr && solid->is_drawn;
}

// If two chunks that share only a corner are drawn and the other two chunks there are not, four caps would share the
// vertical line at the corner: one of the two is then not drawn either.
void SolidSelection::separate_corners() {
    const ResidentSet& resident = *followed_;
    const auto neighbour = [&](std::int32_t index, Side side) {
        return resident.links(static_cast<std::size_t>(index)).neighbour[side];
    };
    const auto has_diagonal = [&](const Solid& solid) {
        for (const Side along : {west, east}) {
            for (const Side across : {south, north}) {
                const SolidTriangles& triangles = solid.chunk->solid->triangles();
                if (triangles.caps[along].empty() || triangles.caps[across].empty()) continue;
                const ChunkKey& key = solid.chunk->key;
                const ChunkKey diagonal{key.x + (along == east ? 1 : -1),
                                        key.y + (across == north ? 1 : -1), key.level};
                // the chunks between the two may be absent
                if (!is_drawn(neighbour(solid.index, along)) &&
                    !is_drawn(neighbour(solid.index, across)) && is_drawn(resident.find(diagonal)))
                    return true;
            }
        }
        return false;
    };
    for (bool has_changed = true; has_changed;) {
        has_changed = false;
        for (Solid& solid : solids_) {
            if (!solid.is_drawn || !has_diagonal(solid)) continue;
            solid.is_drawn = false;
            has_changed = true;
        }
    }
}

void SolidSelection::draw(const Solid& solid) {
    const SolidTriangles& triangles = solid.chunk->solid->triangles();
    MeshSolid made;
    made.chunk = solid.chunk;
    made.triangles = solid.level == 0
                         ? MeshSolid::Triangles(triangles.triangles)
                         : MeshSolid::Triangles(triangles.levels[solid.level - 1].triangles);
    const ResidentSet& resident = *followed_;
    const Lattice& window = resident.window();
    const ChunkKey& key = solid.chunk->key;
    const std::array<ChunkKey, 4> beyond{
        ChunkKey{key.x - 1, key.y, key.level}, ChunkKey{key.x + 1, key.y, key.level},
        ChunkKey{key.x, key.y - 1, key.level}, ChunkKey{key.x, key.y + 1, key.level}};
    for (std::size_t side = 0; side < 4; ++side) {
        if (!window.contains(beyond[side])) continue;
        if (is_drawn(resident.links(static_cast<std::size_t>(solid.index)).neighbour[side]))
            continue;
        made.caps[side] = triangles.caps[side];
    }
    triangle_count_ += made.triangle_count();
    drawn_.push_back(made);
}

// Screen error of drawn volumes: from the box around them if the result is at most `known_px`, else from error boxes.
double SolidSelection::drawn_error_px(const Solid& solid, const ScreenError& screen,
                                      double known_px) const {
    const SolidTriangles& triangles = solid.chunk->solid->triangles();
    const double of_level = level_error(triangles, solid.level);
    const double at_most = screen.error_in_view(solid.box, triangles.error_m + of_level);
    if (at_most <= known_px || triangles.error_boxes.empty()) return at_most;
    double px = 0.0;
    for (const SolidErrorBox& part : triangles.error_boxes) {
        const double error_m = part.error_m + of_level;
        px = std::max(px, screen.error_in_view(widened(part, error_m), error_m));
    }
    return px;
}

void SolidSelection::decide(const Morph& morph, float threshold, const ScreenError& screen) {
    const ResidentSet& resident = *followed_;
    std::size_t number = 0;
    for (Solid& solid : solids_) {
        if (!solid.is_wanted) continue;
        solid.is_drawn = resident.fade(static_cast<std::size_t>(solid.index)) == 1.0f;
        if (!solid.replaces()) continue;
        solid.is_drawn = solid.is_drawn && replacements_[number].are_in_place;
        ++number;
    }
    separate_corners();
    number = 0;
    for (const Solid& solid : solids_) {
        if (solid.replaces()) replacements_[number++].is_drawn = solid.is_drawn;
        if (solid.is_drawn) {
            draw(solid);
            drawn_px_ = std::max(drawn_px_, drawn_error_px(solid, screen, drawn_px_));
            continue;
        }
        // Omitted because of the target or the budget if not wanted, or if a vertex with the same screen error would
        // not be in place at this threshold; else because chunks are absent or fading, or by separate_corners().
        const float pin = screen.key_of(solid.hidden_px);
        const bool is_chosen = !solid.is_wanted || !(pin < morph.in_place(threshold));
        double& px = is_chosen ? left_out_px_ : absent_px_;
        px = std::max(px, solid.hidden_px);
    }
}

}  // namespace terrane::internal
