// SPDX-License-Identifier: MIT
//
// Sources:
//   L. Velho, D. Gomes. Variable Resolution 4-k Meshes. Computer Graphics Forum 19(4), 2000. (the mesh)
//   P. Lindstrom, V. Pascucci. Visualization of Large Terrains Made Easy. IEEE Visualization 2001.
//   M. Duchaineau et al. ROAMing Terrain. IEEE Visualization 1997. (a budget by priorities)
// Deviations: no queues and no incremental splits: the budget is met by an exact order statistic of
// all priorities. Closure only trims: a vertex has at most the priority of its parents, and none
// where a parent is not resident, so that every threshold gives a conforming mesh, whatever is loaded.
//
// A chunk owns the vertices of its own spacing (roots own all coarser ones too), and draws the
// triangles that its vertices make; each of its centres makes four sides' worth.
#include "screen_error.h"
#include "selection.h"
#include "vertex_priorities.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/triangulator.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace terrane {
namespace {

using internal::Candidate;
using internal::ChunkPriorities;
using internal::ScreenError;
using internal::VertexPriorities;

constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;

// Sides of the square around a centre, counter-clockwise from the south: the offsets of the corner
// where the side begins and of its midpoint.
struct SquareSide {
    int corner_x, corner_y;
    int middle_x, middle_y;
};
constexpr std::array<SquareSide, 4> kSides{SquareSide{-1, -1, 0, -1}, SquareSide{1, -1, 1, 0},
                                           SquareSide{1, 1, 0, 1}, SquareSide{-1, 1, -1, 0}};

}  // namespace

struct Triangulator::State {
    State(const HeightSource& source, const TriangulatorSettings& chosen)
        : lattice(source.lattice()), settings(chosen), priorities(source) {}

    Lattice lattice;
    TriangulatorSettings settings;

    // of the frame
    std::shared_ptr<const ResidentSet> resident;
    VertexPriorities priorities;
    std::vector<Candidate> candidates;
    std::vector<MeshChunk> mesh_chunks;
    std::vector<std::uint16_t> indices;
    float last_threshold = 0.0f;  // only guides the search: results do not depend on it
    float threshold = 0.0f;

    // largest errors left, in view, by what stopped refinement there
    struct ErrorLeft {
        float chosen = 0.0f;  // the threshold
        float absent = 0.0f;  // a chunk that is not resident
        float finest = 0.0f;  // the lattice ends
        float largest() const { return std::max({chosen, absent, finest}); }
    };
    ErrorLeft left;
    TerrainMesh mesh;

    const ChunkPriorities& priorities_of(std::size_t index) const {
        return *priorities.find(static_cast<std::int32_t>(index));
    }
    // A little less than asked for, so that what is reported after rounding outward meets it.
    float target_px() const {
        return static_cast<float>(settings.max_error_px / (2.0 * ScreenError::kRounding - 1.0));
    }
    void select(const ScreenError& screen);
    void emit(const ScreenError& screen);
    void emit_chunk(const ScreenError& screen, std::size_t index);
    void emit_stride(const ScreenError& screen, std::size_t index, int stride);
    void emit_undivided_root(std::size_t index);
};

// Finds the threshold: the target, or as low as the budget allows.
void Triangulator::State::select(const ScreenError& screen) {
    const float target = target_px();
    const std::size_t root_triangles = 2 * static_cast<std::size_t>(lattice.root_count_x) *
                                       static_cast<std::size_t>(lattice.root_count_y);
    const std::size_t budget = settings.triangle_budget - root_triangles;
    // where the last frame ended is a good guess; too high a floor is found out and lowered
    float floor = std::max(target, 0.9f * last_threshold);
    for (;;) {
        priorities.compute(resident, screen, floor);
        candidates.clear();
        const std::size_t weight = priorities.gather(floor, candidates);
        if (weight > budget || floor == target) break;
        floor = std::max(target, 0.7f * floor);
    }
    threshold = internal::select_threshold(candidates, budget, floor);
    last_threshold = threshold;
}

void Triangulator::State::emit_undivided_root(std::size_t index) {
    const Chunk& chunk = *resident->chunks()[index];
    constexpr std::uint16_t south_west = 0;
    constexpr auto south_east = static_cast<std::uint16_t>(kChunkCells);
    constexpr auto north_west = static_cast<std::uint16_t>(kChunkCells * kChunkSamples);
    constexpr auto north_east = static_cast<std::uint16_t>(kSamples - 1);
    if (cut_to_north_east(chunk.key.x, chunk.key.y)) {
        indices.insert(indices.end(),
                       {south_west, south_east, north_east, south_west, north_east, north_west});
    } else {
        indices.insert(indices.end(),
                       {south_west, south_east, north_west, south_east, north_east, north_west});
    }
    const ChunkPriorities& mine = priorities_of(index);
    left.chosen = std::max(left.chosen, mine.own[sample_index(kChunkCells / 2, kChunkCells / 2)]);
}

// The triangles that the centres of one spacing make, but for those that finer centres divide.
void Triangulator::State::emit_stride(const ScreenError& screen, std::size_t index, int stride) {
    const Chunk& chunk = *resident->chunks()[index];
    const ResidentSet::Links& links = resident->links(index);
    const ChunkPriorities& mine = priorities_of(index);
    const bool is_finest = chunk.key.level == lattice.finest_level;
    const auto vertex = [](int column, int row) {
        return static_cast<std::uint16_t>(sample_index(column, row));
    };

    // whether a quarter of the square is divided further; if not, what error it leaves
    const auto is_divided = [&](int west_x, int south_y) {
        if (stride > 1) {
            const std::size_t finer = sample_index(west_x + stride / 2, south_y + stride / 2);
            if (mine.trimmed[finer] > threshold) return true;
            float& kind = mine.own[finer] > threshold ? left.absent : left.chosen;
            kind = std::max(kind, mine.own[finer]);
            return false;
        }
        const int quadrant =
            (west_x >= kChunkCells / 2 ? 1 : 0) + (south_y >= kChunkCells / 2 ? 2 : 0);
        const std::int32_t child_index = links.child[static_cast<std::size_t>(quadrant)];
        const ChunkPriorities* child = priorities.find(child_index);
        float own = threshold;  // a resident child that was not opened has nothing above it
        if (child != nullptr) {
            const std::size_t finer = sample_index(2 * (west_x % (kChunkCells / 2)) + 1,
                                                   2 * (south_y % (kChunkCells / 2)) + 1);
            if (child->trimmed[finer] > threshold) return true;
            // 0: in an area that was not looked at, so not above the threshold either
            if (child->own[finer] > 0.0f) own = child->own[finer];
        }
        // the cell's own bound: the true surface is that near to its two triangles
        const std::size_t corner = sample_index(west_x, south_y);
        const auto [low, high] = std::minmax({chunk.heights[corner], chunk.heights[corner + 1],
                                              chunk.heights[corner + kChunkSamples],
                                              chunk.heights[corner + kChunkSamples + 1]});
        const auto bound = static_cast<double>(chunk.cell_bounds[cell_index(west_x, south_y)]);
        const std::int64_t x = chunk.corner.x + west_x * chunk.step;
        const std::int64_t y = chunk.corner.y + south_y * chunk.step;
        const float error =
            screen.error_in_view({{lattice.x(x), lattice.y(y), lattice.quantum * low - bound},
                                  {lattice.x(x + chunk.step), lattice.y(y + chunk.step),
                                   lattice.quantum * high + bound}},
                                 bound);
        if (is_finest) {
            left.finest = std::max(left.finest, error);
        } else if (child_index == ResidentSet::kNone || own > threshold) {
            left.absent = std::max(left.absent, std::min(error, child == nullptr ? error : own));
        } else {
            left.chosen = std::max(left.chosen, std::min(error, own));
        }
        return false;
    };

    for (const internal::SampleRange& range : mine.ranges) {
        for (int row = range.south + stride; row < range.north; row += 2 * stride) {
            for (int column = range.west + stride; column < range.east; column += 2 * stride) {
                if (!(mine.trimmed[sample_index(column, row)] > threshold)) continue;
                const std::uint16_t centre = vertex(column, row);
                std::array<bool, 4>
                    divided{};  // quarters: south-west, south-east, north-west, north-east
                std::array<bool, 4> known{};
                const auto quarter_divided = [&](int corner_x, int corner_y) {
                    const auto quarter =
                        static_cast<std::size_t>((corner_x > 0 ? 1 : 0) + (corner_y > 0 ? 2 : 0));
                    if (!known[quarter]) {
                        known[quarter] = true;
                        divided[quarter] = is_divided(column + (corner_x > 0 ? 0 : -stride),
                                                      row + (corner_y > 0 ? 0 : -stride));
                    }
                    return divided[quarter];
                };
                for (std::size_t side = 0; side < 4; ++side) {
                    const SquareSide& begin = kSides[side];
                    const SquareSide& end = kSides[(side + 1) % 4];
                    const int middle_x = column + begin.middle_x * stride;
                    const int middle_y = row + begin.middle_y * stride;
                    const std::size_t middle_index = sample_index(middle_x, middle_y);
                    const std::uint16_t first =
                        vertex(column + begin.corner_x * stride, row + begin.corner_y * stride);
                    const std::uint16_t last =
                        vertex(column + end.corner_x * stride, row + end.corner_y * stride);
                    if (!(mine.trimmed[middle_index] > threshold)) {
                        indices.insert(indices.end(), {first, last, centre});
                        float& kind =
                            mine.own[middle_index] > threshold ? left.absent : left.chosen;
                        kind = std::max(kind, mine.own[middle_index]);
                        continue;
                    }
                    const auto middle = static_cast<std::uint16_t>(middle_index);
                    if (!quarter_divided(begin.corner_x, begin.corner_y)) {
                        indices.insert(indices.end(), {first, middle, centre});
                    }
                    if (!quarter_divided(end.corner_x, end.corner_y)) {
                        indices.insert(indices.end(), {middle, last, centre});
                    }
                }
            }
        }
    }
}

void Triangulator::State::emit_chunk(const ScreenError& screen, std::size_t index) {
    const Chunk& chunk = *resident->chunks()[index];
    const std::size_t first = indices.size();
    const ChunkPriorities& mine = priorities_of(index);
    if (chunk.key.level == 0 &&
        !(mine.trimmed[sample_index(kChunkCells / 2, kChunkCells / 2)] > threshold)) {
        emit_undivided_root(index);
    }
    for (int stride = VertexPriorities::coarsest_stride(chunk); stride >= 1; stride /= 2) {
        emit_stride(screen, index, stride);
    }
    if (indices.size() == first) return;
    mesh_chunks.push_back({&chunk, static_cast<std::uint32_t>(first),
                           static_cast<std::uint32_t>(indices.size() - first)});
}

void Triangulator::State::emit(const ScreenError& screen) {
    indices.clear();
    mesh_chunks.clear();
    left = {};
    // the largest that stayed out is the threshold itself, unless the target set it
    if (threshold > target_px()) left.chosen = threshold;
    for (std::size_t i = 0; i < resident->chunks().size(); ++i) {
        if (priorities.find(static_cast<std::int32_t>(i)) != nullptr) emit_chunk(screen, i);
    }
    TERRANE_ASSERT(indices.size() <= 3 * settings.triangle_budget, "the budget must hold");
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
    if (const Result<void> good = check(source.lattice()); !good)
        return tl::unexpected(good.error());
    const Lattice& lattice = source.lattice();
    const std::size_t least = 2 * static_cast<std::size_t>(lattice.root_count_x) *
                              static_cast<std::size_t>(lattice.root_count_y);
    if (settings.triangle_budget < least || settings.triangle_budget > 1'000'000'000) {
        return fail(ErrorCode::invalid_argument,
                    "triangle_budget must be " + std::to_string(least) +
                        " (2 for each root square) to 1000000000, got " +
                        std::to_string(settings.triangle_budget));
    }
    if (!(settings.max_error_px > 0.0) || !std::isfinite(settings.max_error_px)) {
        return fail(ErrorCode::invalid_argument,
                    "max_error_px must be > 0, got " + std::to_string(settings.max_error_px));
    }
    return Triangulator(std::make_unique<State>(source, settings));
}

Triangulator::Triangulator(std::unique_ptr<State> state) : state_(std::move(state)) {}
Triangulator::Triangulator(Triangulator&&) noexcept = default;
Triangulator& Triangulator::operator=(Triangulator&&) noexcept = default;
Triangulator::~Triangulator() = default;

TerrainMesh Triangulator::update(std::shared_ptr<const ResidentSet> resident, const View& view) {
    State& state = *state_;
    TERRANE_ASSERT(resident != nullptr && resident->lattice() == state.lattice,
                   "the resident set must be of the triangulator's source");
    if (!check(view)) {
        ++state.mesh.refused_views;
        state.mesh.status = MeshStatus::invalid_view;
        return state.mesh;
    }
    state.resident = std::move(resident);
    TerrainMesh& mesh = state.mesh;
    mesh.resident = state.resident;
    mesh.chunks = {};
    mesh.indices = {};
    mesh.triangle_count = 0;
    mesh.error_px = 0.0;
    mesh.threshold_px = state.settings.max_error_px;
    mesh.status = MeshStatus::not_resident;
    if (!state.resident->has_roots()) return mesh;

    const ScreenError screen(view, state.lattice);
    state.select(screen);
    state.emit(screen);
    mesh.chunks = state.mesh_chunks;
    mesh.indices = state.indices;
    mesh.triangle_count = state.indices.size() / 3;
    mesh.error_px = static_cast<double>(state.left.largest()) * ScreenError::kRounding;
    mesh.threshold_px = std::max(static_cast<double>(state.threshold), state.settings.max_error_px);
    if (mesh.error_px <= state.settings.max_error_px) {
        mesh.status = MeshStatus::error_met;
    } else if (state.left.chosen * ScreenError::kRounding > state.settings.max_error_px) {
        mesh.status = MeshStatus::budget_reached;
    } else if (static_cast<double>(state.left.absent) * ScreenError::kRounding >
               state.settings.max_error_px) {
        mesh.status = MeshStatus::not_resident;
    } else {
        mesh.status = MeshStatus::finest_reached;
    }
    return mesh;
}

}  // namespace terrane
