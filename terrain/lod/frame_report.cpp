// SPDX-License-Identifier: MIT
//
// The certified error of a frame: docs/triangulation.md, steps 6 to 9.
#include "base/vector_math.h"
#include "lod/frame_mesh.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {

double fading_error(const ResidentSet& resident, const Reaches& reaches, const ScreenError& screen,
                    const Morph& morph, float threshold,
                    const std::function<float(std::size_t index)>& least_key_of) {
    const double threshold_px = screen.error_px_of(threshold);
    const int finest = resident.lattice().finest_level;
    const auto fades = [&](std::size_t index) {
        const float fade = resident.fade(index);
        return resident.chunks()[index]->key.level > 0 && fade > 0.0f && fade < 1.0f;
    };
    double error_px = 0.0;
    for (std::size_t i = 0; i < resident.chunks().size(); ++i) {
        if (!fades(i)) continue;
        double most_px = 0.0;
        float factor = 1.0f;
        for (std::int32_t at = static_cast<std::int32_t>(i); at != ResidentSet::kNone;
             at = resident.links(static_cast<std::size_t>(at)).parent) {
            const auto above = static_cast<std::size_t>(at);
            // chunks without a vertex below the threshold do not count
            if (!fades(above) || !(least_key_of(above) < threshold)) continue;
            const Chunk& chunk = *resident.chunks()[above];
            const float fade = resident.fade(above);
            factor = std::max(factor, 1.0f / (fade * fade));
            const auto bound = static_cast<double>(chunk.max_vertex_bound);
            // the diamonds of vertices on the chunk's sides extend beyond the chunk
            const auto exponent = static_cast<std::size_t>(finest - chunk.key.level);
            ScreenError::WorldBox box = screen.reach_of(chunk, reaches.centre[exponent].half_width);
            box.low.z() -= bound;
            box.high.z() += bound;
            most_px = std::max(most_px, screen.error_in_view(box, bound));
        }
        if (most_px == 0.0) continue;
        const double fade = 1.0 / std::sqrt(static_cast<double>(factor));
        error_px =
            std::max(error_px, threshold_px * morph.error_with_fade(most_px / threshold_px, fade));
    }
    return error_px;
}

float target_key(const ScreenError& screen, double morph_ratio, double target_px) {
    const double factor = Morph(morph_ratio, 1.0f).error_factor();
    return screen.key_of(target_px / (factor * ScreenError::kRounding * ScreenError::kRounding));
}

std::size_t root_triangles(const Lattice& lattice) {
    return 2 * static_cast<std::size_t>(lattice.resident_root_count());
}

float first_floor(const ScreenError& screen, float target, float last_threshold) {
    constexpr double kFirst_px = 4096.0;
    constexpr float kMargin = 1.1f;  // for changes between frames
    return std::min(target,
                    last_threshold > 0.0f ? kMargin * last_threshold : screen.key_of(kFirst_px));
}

float next_floor(float floor, float target) {
    constexpr float kStep = 3.0f;
    return std::min(target, kStep * floor);
}

void find_demand_keys(const ScreenError& screen, std::span<const TriangleDemand> demands,
                      std::vector<WeightedKey>& keys_out) {
    keys_out.clear();
    for (const TriangleDemand& demand : demands) {
        const double threshold_px = demand.threshold_px > 0.0 ? demand.threshold_px : 0.0;
        keys_out.push_back({screen.key_of(threshold_px), demand.triangles});
    }
}

void grant_demands(std::span<const TriangleDemand> demands, std::span<const WeightedKey> keys,
                   float threshold, TerrainMesh& mesh_out) {
    mesh_out.demand_threshold_px = mesh_out.threshold_px;
    mesh_out.demand_triangles = 0;
    for (std::size_t i = 0; i < demands.size(); ++i) {
        if (keys[i].key < threshold) {
            mesh_out.demand_triangles += demands[i].triangles;
        } else {
            mesh_out.demand_threshold_px =
                std::max(mesh_out.demand_threshold_px, demands[i].threshold_px);
        }
    }
}

void report_error(const ScreenError& screen, const Morph& morph, float threshold, double target_px,
                  bool is_certified, const ErrorParts& parts, TerrainMesh& mesh_out) {
    const double threshold_px = screen.error_px_of(threshold);
    const auto displayed = [&](double missing_px) {
        return missing_px > 0.0 ? threshold_px * morph.error_with_missing(missing_px / threshold_px)
                                : 0.0;
    };
    // The terms of docs/triangulation.md, step 7, in pixels; `active` is step 6. The heightfield that closes over
    // omitted volumes has an error of its own.
    const double active = threshold_px * morph.error_factor();
    const double active_and_omitted = active + parts.left_out;
    const double absent =
        std::max({displayed(parts.residual.absent), parts.fading,
                  parts.absent_solids > 0.0 ? active + parts.absent_solids : 0.0});
    const double held = std::max(displayed(parts.residual.held), parts.drawn_solids);
    const double finest = std::max(displayed(parts.residual.finest), held);
    const double morphing = threshold_px * parts.residual.morphing;
    mesh_out.error_px =
        std::max({active_and_omitted, absent, finest, morphing}) * ScreenError::kRounding;
    mesh_out.refinable_error_px =
        std::max({active_and_omitted, absent, held, morphing}) * ScreenError::kRounding;
    mesh_out.finest_error_m = parts.residual.finest_m;
    mesh_out.threshold_px = threshold_px;
    if (mesh_out.error_px <= target_px) {
        mesh_out.status = MeshStatus::error_met;
    } else if (active_and_omitted * ScreenError::kRounding > target_px) {
        mesh_out.status = MeshStatus::budget_reached;
    } else if (absent * ScreenError::kRounding > target_px) {
        mesh_out.status = MeshStatus::not_resident;
    } else {
        mesh_out.status = MeshStatus::finest_reached;
    }
    if (is_certified) return;
    mesh_out.error_px = mesh_out.refinable_error_px = mesh_out.finest_error_m = kInfinity;
}

}  // namespace terrane::internal
