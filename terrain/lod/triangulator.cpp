// SPDX-License-Identifier: MIT
//
// Sources:
//   L. Velho, D. Gomes. Variable Resolution 4-k Meshes. Computer Graphics Forum 19(4), 2000. (the mesh)
//   P. Lindstrom, V. Pascucci. Visualization of Large Terrains Made Easy. IEEE Visualization 2001. (nested errors)
//   M. Duchaineau et al. ROAMing Terrain. IEEE Visualization 1997. (a triangle budget by priorities)
// Deviations: no queues and no incremental splits: the threshold is an exact order statistic of all keys. Keys are
//             raised to their parents' keys, and infinite if a parent is not resident, so that every threshold gives a
//             conforming mesh, whatever is loaded.
//
// A chunk owns the vertices of its own spacing (a root also those of coarser spacings), and draws their triangles. Only
// the start value of the search is kept between frames: a frame is a function of resident set, settings and view.
#include "base/vector_math.h"
#include "base/worker_team.h"
#include "lod/frame_mesh.h"
#include "lod/screen_error.h"
#include "lod/selection.h"
#include "lod/solid_selection.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/triangulator.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace terrane {
namespace {

using internal::Morph;
using internal::OpenChunk;
using internal::ResidualError;
using internal::root_triangles;
using internal::ScreenError;
using internal::Selection;
using internal::SolidSelection;
using internal::VertexKeys;
using internal::WorkerTeam;

constexpr int kMostWorkers = 64;
constexpr double kMostMorphRatio = 16.0;

}  // namespace

struct Triangulator::State {
    State(const HeightSource& ground, const TriangulatorSettings& chosen)
        : source(&ground),
          lattice(ground.lattice()),
          settings(chosen),
          team(std::max(1, chosen.worker_count)),
          keys(ground, internal::best_simd_level(), chosen.open_chunks),
          selection(team.size()),
          solids(chunks_of(ground)),
          residual_errors(static_cast<std::size_t>(team.size())),
          // reserves the memory without touching its pages
          indices(std::make_unique_for_overwrite<std::uint16_t[]>(3 * chosen.triangle_budget)) {
        mesh_chunks.reserve(chosen.open_chunks);
    }

    const HeightSource* source;
    Lattice lattice;
    TriangulatorSettings settings;
    WorkerTeam team;
    VertexKeys keys;
    Selection selection;
    SolidSelection solids;
    float last_threshold = 0.0f;  // start value of the search; does not affect results

    // per frame
    float threshold = 0.0f;
    std::vector<internal::WeightedKey> others;
    std::vector<ResidualError> residual_errors;  // by worker
    std::vector<MeshChunk> mesh_chunks;
    std::unique_ptr<std::uint16_t[]> indices;  // [3 * triangle_budget]
    std::size_t triangle_count = 0;
    TerrainMesh mesh;

    void select(const ResidentSet& resident, const ScreenError& screen);
    void activate_and_morph(const Morph& morph);
    void decide_solids(const ScreenError& screen, const Morph& morph);
    void emit(const ScreenError& screen, const Morph& morph);
    void report(const ScreenError& screen, const Morph& morph);
};

// Finds the threshold: the key of the target, or a smaller key if the budget does not suffice.
void Triangulator::State::select(const ResidentSet& resident, const ScreenError& screen) {
    const float target = internal::target_key(screen, settings.morph_ratio,
                                              settings.max_error_px - solids.allowed_px());
    const std::size_t budget =
        settings.triangle_budget - root_triangles(lattice) - solids.reserved_triangles();
    float floor = internal::first_floor(screen, target, last_threshold);
    for (;;) {
        selection.begin(floor, std::min(last_threshold, floor));
        keys.compute(resident, screen, solids.pins(), floor, selection, team);
        threshold = selection.find(keys.open(), keys.kernels(), budget, team);
        if (threshold < floor || floor == target) break;
        floor = internal::next_floor(floor, target);
    }
    last_threshold = threshold;
}

// Marks active vertices and computes offsets, level by level, because offsets depend on those of coarser vertices.
void Triangulator::State::activate_and_morph(const Morph& morph) {
    const std::span<OpenChunk* const> open = keys.open();
    team.run(open.size(), [&](std::size_t i, int) {
        internal::mark_active(*open[i], keys.kernels(), threshold);
    });
    if (!morph.is_on()) return;
    const auto quantum = static_cast<float>(lattice.quantum);
    std::span<OpenChunk* const> rest = open;
    while (!rest.empty()) {
        const auto level = rest.front()->chunk->key.level;
        const auto end = std::find_if(rest.begin(), rest.end(), [&](const OpenChunk* chunk) {
            return chunk->chunk->key.level != level;
        });
        const auto count = static_cast<std::size_t>(end - rest.begin());
        team.run(count, [&](std::size_t i, int) {
            morph.compute_offsets(*rest[i], keys.kernels(), threshold, quantum);
        });
        rest = rest.subspan(count);
    }
}

// Decides which volumes are drawn, and which triangles they replace.
void Triangulator::State::decide_solids(const ScreenError& screen, const Morph& morph) {
    for (SolidSelection::Replacement& replacement : solids.replacements()) {
        const OpenChunk* const chunk = keys.find(replacement.index);
        replacement.are_in_place =
            chunk != nullptr &&
            internal::are_in_place(*replacement.triangles, *chunk, morph.is_on());
    }
    solids.decide(morph, threshold, screen);
    for (const SolidSelection::Replacement& replacement : solids.replacements()) {
        if (replacement.is_drawn) keys.find(replacement.index)->replaced = replacement.triangles;
    }
}

void Triangulator::State::emit(const ScreenError& screen, const Morph& morph) {
    const std::span<OpenChunk* const> open = keys.open();
    team.run(open.size(), [&](std::size_t i, int) {
        open[i]->triangle_count = internal::count_triangles(*open[i], threshold);
    });
    triangle_count = 0;
    mesh_chunks.clear();
    for (OpenChunk* chunk : open) {
        chunk->first_triangle = triangle_count;
        triangle_count += chunk->triangle_count;
        if (chunk->triangle_count == 0) continue;
        mesh_chunks.push_back({chunk->chunk, static_cast<std::uint32_t>(3 * chunk->first_triangle),
                               static_cast<std::uint32_t>(3 * chunk->triangle_count),
                               morph.is_on() ? chunk->offsets.data() : nullptr});
    }
    TERRANE_ASSERT(triangle_count + solids.triangle_count() <= settings.triangle_budget,
                   "the budget must hold");
    std::fill(residual_errors.begin(), residual_errors.end(), ResidualError{});
    team.run(open.size(), [&](std::size_t i, int worker) {
        const OpenChunk& chunk = *open[i];
        if (chunk.triangle_count > 0) {
            internal::emit_triangles(chunk, threshold, indices.get() + 3 * chunk.first_triangle);
        }
        // also for chunks without triangles: their vertices may be missing in triangles of a neighbour
        internal::find_residual_error(chunk, keys, screen, threshold, morph,
                                      residual_errors[static_cast<std::size_t>(worker)]);
    });
}

void Triangulator::State::report(const ScreenError& screen, const Morph& morph) {
    internal::ErrorParts parts;
    for (const ResidualError& of_worker : residual_errors) parts.residual.merge(of_worker);
    parts.fading = internal::fading_error(
        *mesh.resident, keys.reaches(), screen, morph, threshold, [&](std::size_t index) {
            const Chunk& chunk = *mesh.resident->chunks()[index];
            return screen.least_key(keys.reach_of(screen, chunk), chunk.max_vertex_bound);
        });
    parts.left_out = solids.left_out_px();
    parts.absent_solids = solids.absent_px();
    parts.drawn_solids = solids.drawn_px();
    internal::report_error(screen, morph, threshold, settings.max_error_px, source->is_certified(),
                           parts, mesh);
}

const char* name_of(MeshStatus status) {
    switch (status) {
        case MeshStatus::error_met:
            return "error_met";
        case MeshStatus::budget_reached:
            return "budget_reached";
        case MeshStatus::finest_reached:
            return "finest_reached";
        case MeshStatus::not_resident:
            return "not_resident";
        case MeshStatus::invalid_view:
            return "invalid_view";
    }
    return "";
}

Result<Triangulator> Triangulator::create(const HeightSource& source,
                                          const TriangulatorSettings& settings) {
    TERRANE_TRY(source.lattice().validate());
    const Lattice& lattice = source.lattice();
    const std::size_t least = root_triangles(lattice);
    if (settings.triangle_budget < least || settings.triangle_budget > 1'000'000'000) {
        return fail(ErrorCode::invalid_argument,
                    "triangle_budget must be " + std::to_string(least) +
                        " (2 for each root square) to 1000000000, got " +
                        std::to_string(settings.triangle_budget));
    }
    if (!(settings.max_error_px > 0.0) || !std::isfinite(settings.max_error_px)) {
        return fail(ErrorCode::invalid_argument,
                    "max_error_px must be > 0, got " + number_text(settings.max_error_px));
    }
    if (!(settings.morph_ratio >= 1.0 && settings.morph_ratio <= kMostMorphRatio)) {
        return fail(ErrorCode::invalid_argument,
                    "morph_ratio must be 1 to 16, got " + number_text(settings.morph_ratio));
    }
    if (settings.worker_count < 1 || settings.worker_count > kMostWorkers) {
        return fail(ErrorCode::invalid_argument,
                    "worker_count must be 1 to 64, got " + std::to_string(settings.worker_count));
    }
    return Triangulator(std::make_unique<State>(source, settings));
}

Triangulator::Triangulator(std::unique_ptr<State> state) : state_(std::move(state)) {}
Triangulator::Triangulator(Triangulator&&) noexcept = default;
Triangulator& Triangulator::operator=(Triangulator&&) noexcept = default;
Triangulator::~Triangulator() = default;

TerrainMesh Triangulator::update(std::shared_ptr<const ResidentSet> resident, const View& view,
                                 std::span<const TriangleDemand> others) {
    State& state = *state_;
    TERRANE_ASSERT(resident != nullptr && resident->lattice() == state.lattice,
                   "the resident set must be of the triangulator's source");
    TerrainMesh& mesh = state.mesh;
    if (!view.validate()) {
        ++mesh.refused_views;
        mesh.status = MeshStatus::invalid_view;
        return mesh;
    }
    mesh.resident = std::move(resident);
    mesh.chunks = {};
    mesh.indices = {};
    mesh.solids = {};
    mesh.triangle_count = 0;
    mesh.error_px = mesh.refinable_error_px = mesh.finest_error_m = 0.0;
    mesh.threshold_px = state.settings.max_error_px;
    mesh.demand_threshold_px = internal::kInfinity;
    mesh.demand_triangles = 0;
    mesh.status = MeshStatus::not_resident;
    if (!mesh.resident->has_roots()) return mesh;

    const ScreenError screen(view, *state.source,
                             internal::clearance_of(*state.source, view.eye_world));
    state.solids.begin(mesh.resident, screen, state.settings.max_error_px,
                       state.settings.morph_ratio,
                       state.settings.triangle_budget - root_triangles(state.lattice));
    internal::find_demand_keys(screen, others, state.others);
    state.selection.set_others(state.others);
    state.select(*mesh.resident, screen);
    const Morph morph(state.settings.morph_ratio, state.threshold);
    state.activate_and_morph(morph);
    state.decide_solids(screen, morph);
    state.emit(screen, morph);
    mesh.chunks = state.mesh_chunks;
    mesh.indices = {state.indices.get(), 3 * state.triangle_count};
    mesh.solids = state.solids.drawn();
    mesh.triangle_count = state.triangle_count + state.solids.triangle_count();
    state.report(screen, morph);
    internal::grant_demands(others, state.others, state.threshold, mesh);
    return mesh;
}

}  // namespace terrane
