// SPDX-License-Identifier: MIT
//
// Sources:
//   M. Harris, S. Sengupta, J. D. Owens. Parallel Prefix Sum (Scan) with CUDA. GPU Gems 3, 2007.
//   D. Merrill, A. Grimshaw. High Performance and Scalable Radix Sorting. Parallel Processing Letters 21(2), 2011.
// Deviations: only the k-th key is needed, so the keys are not sorted: each of three digits is counted, and the digit
//             in which the budget ends is chosen.
//
// The shaders lod_*.comp repeat terrain/lod for one area, square or vertex in an invocation.
#include "base/vector_math.h"
#include "chunk/chunk_vertices.h"
#include "gl/gl_object.h"
#include "gl/shader.h"
#include "light/frame_uniforms.h"
#include "lod/frame_mesh.h"
#include "lod/screen_error.h"
#include "triangulation/device_mesh.h"

#include <terrane/render/gpu_triangulator.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <unordered_map>
#include <vector>

namespace terrane {
namespace {

using internal::AreaVertices;
using internal::GlBuffer;
using internal::GlProgram;
using internal::ScreenError;

// Layouts of lod.glsl
constexpr std::size_t kTableWords = 12, kFrameWords = 4;
constexpr std::size_t kAreaCount = std::size_t{kChunkAreas} * kChunkAreas;
constexpr std::size_t kAreaWords = sizeof(AreaVertices) / 4;
constexpr std::size_t kBoundsWord = kAreaCount * kAreaWords, kReachesWord = kBoundsWord + 64;
constexpr std::size_t kSideWords = 96;
constexpr std::size_t kEastWord = kReachesWord + 64, kNorthWord = kEastWord + kSideWords;
constexpr std::size_t kHeaderWord = kNorthWord + kSideWords;
constexpr std::size_t kAreaHeightsWord = kHeaderWord + 16;
constexpr std::size_t kCellBoundsWord = kAreaHeightsWord + 128, kSlotWords = kCellBoundsWord + 64;
static_assert(kAreaWords == 400 && kHeaderWord == 25920 && kSlotWords == 26128);
static_assert(sizeof(internal::SideVertices) == 4 * kSideWords);
constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;
constexpr std::size_t kHeightWords = kSamples + std::size_t{kChunkCells} * kChunkCells;
constexpr std::size_t kAreaKeys = AreaVertices::kKinds * AreaVertices::kSquares;
constexpr std::size_t kAreaSide = kAreaCells + 1, kAreaOffsets = kAreaSide * kAreaSide;
constexpr std::size_t kCoarseSide = internal::kChunkSquares + 1;
constexpr std::size_t kCoarse = kCoarseSide * kCoarseSide;
constexpr std::size_t kMostRoots = 4096;
constexpr std::uint32_t kRootVertex = 0x80000000u;  // first number of the roots' vertices
constexpr int kMostLevels = 25;
constexpr std::uint32_t kNone = 0xffffffffu;

// Words of state[]
constexpr std::size_t kAreaTotal = 0, kThreshold = 1, kTriangles = 5, kDraw = 8, kResiduals = 160;
constexpr std::size_t kLevelGroups = 20, kAllGroups = 96;
constexpr std::size_t kSearchGroups = 128, kPickGroups = 144;
constexpr std::size_t kErrorGroups = 169, kHeldGroups = 172, kCellGroups = 175;
constexpr std::size_t kRootTriangles = 184 + 2048, kStateWords = kRootTriangles + kMostRoots;

// As in Triangulator
constexpr double kFirstFloor_px = 4096.0;
constexpr float kFloorMargin = 1.1f, kFloorStep = 3.0f;

constexpr std::uint32_t kSearchSteps = 5;  // at most; see lod_pick.comp

struct FrameBlock {
    std::array<double, 4> eye_spacing, origin_quantum;
    std::array<std::array<double, 4>, 4> normals;
    std::array<double, 4> eye_lattice, distances;
    std::array<std::array<float, 4>, 4> planes;
    std::array<float, 4> scalars, guess;
    std::array<std::uint32_t, 4> counts, bases, more_bases, options, last_bases, capacity;
    std::array<std::uint32_t, 32> level_first;
    std::array<std::array<float, 4>, 33> reaches;
};
static_assert(sizeof(FrameBlock) == 64 + 192 + 64 + 32 + 96 + 128 + 528);

std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }

// A buffer of the device that grows.
struct DeviceArray {
    GlBuffer buffer;
    std::size_t bytes = 0;

    // Makes room; keeps the content if `keeps`.
    void reserve(std::size_t wanted, bool keeps) {
        if (wanted <= bytes) return;
        const std::size_t grown = std::max(wanted, bytes + bytes / 2);
        GlBuffer made = internal::make_buffer();
        glNamedBufferStorage(made.name(), static_cast<GLsizeiptr>(grown), nullptr,
                             GL_DYNAMIC_STORAGE_BIT);
        if (keeps && bytes > 0) {
            glCopyNamedBufferSubData(buffer.name(), made.name(), 0, 0,
                                     static_cast<GLsizeiptr>(bytes));
        }
        buffer = std::move(made);
        bytes = grown;
    }
    void write(std::size_t first_byte, const void* from, std::size_t count) const {
        glNamedBufferSubData(buffer.name(), static_cast<GLintptr>(first_byte),
                             static_cast<GLsizeiptr>(count), from);
    }
    template <typename Value>
    std::vector<Value> read(std::size_t first, std::size_t count) const {
        std::vector<Value> values(count);
        glGetNamedBufferSubData(buffer.name(), static_cast<GLintptr>(first * sizeof(Value)),
                                static_cast<GLsizeiptr>(count * sizeof(Value)), values.data());
        return values;
    }
};

}  // namespace

struct GpuTriangulator::State {
    State(const HeightSource& ground, const TriangulatorSettings& chosen)
        : source(&ground),
          lattice(ground.lattice()),
          settings(chosen),
          reaches(internal::make_reaches(ground)) {}

    const HeightSource* source;
    Lattice lattice;
    TriangulatorSettings settings;
    internal::Reaches reaches;
    std::shared_ptr<const void> context;

    GlProgram open, scan, list, coarse, coarse_trim, centres, midpoints, count_keys, pick, masks,
        coarse_morph, morph, tally, coarse_mesh, sum, emit, slope, error_least, cell_candidates,
        held_candidates, coarse_candidates, error;
    DeviceArray frame, chunks, vertices, heights, state, work, keys, offsets, indices;

    // chunks on the device
    std::shared_ptr<const ResidentSet> resident;
    std::unordered_map<const Chunk*, std::uint32_t> slots;
    std::vector<std::uint32_t> free_slots;
    std::size_t slot_count = 0, coarse_bounds_at = 0;
    std::size_t root_count = 0;
    std::vector<std::uint32_t> slot_of;  // by index in the resident set; kNone
    std::vector<std::uint32_t> staging;

    // per frame
    FrameBlock block{};
    std::vector<std::uint32_t> frame_words;
    std::vector<float> least;
    std::vector<std::pair<float, std::uint32_t>> demands;
    std::size_t area_capacity = 0;
    float last_threshold = 0.0f, threshold = 0.0f;
    std::size_t uploaded = 0, area_count = 0;
    internal::EyeFrame eye_frame;
    DeviceMesh device;
    double clearance = 0.0;  // from the eye to the true surface at least, metres

    // of read()
    std::vector<std::uint16_t> read_indices;
    std::vector<std::vector<float>> read_offsets;
    std::vector<MeshChunk> read_chunks;
    TerrainMesh mesh;

    Result<void> compile();
    void follow(std::shared_ptr<const ResidentSet> next);
    void upload(const Chunk& chunk, std::uint32_t slot);
    void upload_table();
    void prepare(const ScreenError& screen, const View& view, float floor,
                 std::span<const TriangleDemand> others);
    static void run(const GlProgram& program, std::size_t groups);
    void run_indirect(const GlProgram& program, std::size_t word) const;
    void select();
    void triangulate();
    void report(const ScreenError& screen, std::span<const TriangleDemand> others);
};

Result<void> GpuTriangulator::State::compile() {
    using namespace internal;
    const auto make = [](const char* name, std::initializer_list<std::string_view> parts) {
        std::string text;
        for (const std::string_view part : parts) text += part;
        return make_compute_program(name, text);
    };
    TERRANE_TRY(open, make("lod_open", {lod_glsl, lod_keys_glsl, lod_open_comp}));
    TERRANE_TRY(scan, make("lod_scan", {lod_glsl, lod_scan_comp}));
    TERRANE_TRY(list, make("lod_list", {lod_glsl, lod_keys_glsl, lod_list_comp}));
    TERRANE_TRY(coarse,
                make("lod_coarse", {lod_glsl, lod_keys_glsl, lod_coarse_glsl, lod_coarse_comp}));
    TERRANE_TRY(coarse_trim, make("lod_coarse_trim", {lod_glsl, lod_coarse_trim_comp}));
    TERRANE_TRY(centres, make("lod_centres", {lod_glsl, lod_keys_glsl, lod_centres_comp}));
    TERRANE_TRY(midpoints, make("lod_midpoints", {lod_glsl, lod_keys_glsl, lod_midpoints_comp}));
    TERRANE_TRY(count_keys, make("lod_count_keys", {lod_glsl, lod_count_keys_comp}));
    TERRANE_TRY(pick, make("lod_pick", {lod_glsl, lod_pick_comp}));
    TERRANE_TRY(masks, make("lod_masks", {lod_glsl, lod_masks_comp}));
    TERRANE_TRY(coarse_morph, make("lod_coarse_morph", {lod_glsl, lod_keys_glsl, lod_morph_glsl,
                                                        lod_coarse_morph_comp}));
    TERRANE_TRY(morph,
                make("lod_morph", {lod_glsl, lod_keys_glsl, lod_morph_glsl, lod_morph_comp}));
    TERRANE_TRY(tally, make("lod_count", {lod_glsl, lod_squares_glsl, lod_count_comp}));
    TERRANE_TRY(coarse_mesh,
                make("lod_coarse_mesh", {lod_glsl, lod_squares_glsl, lod_coarse_mesh_comp}));
    TERRANE_TRY(sum, make("lod_sum", {lod_glsl, lod_sum_comp}));
    TERRANE_TRY(emit, make("lod_emit", {lod_glsl, lod_squares_glsl, lod_emit_comp}));
    TERRANE_TRY(error_least, make("lod_error_least", {lod_glsl, lod_squares_glsl, lod_error_glsl,
                                                      lod_cells_glsl, lod_error_least_comp}));
    TERRANE_TRY(cell_candidates,
                make("lod_cell_candidates", {lod_glsl, lod_squares_glsl, lod_error_glsl,
                                             lod_cells_glsl, lod_cell_candidates_comp}));
    TERRANE_TRY(held_candidates,
                make("lod_held_candidates",
                     {lod_glsl, lod_keys_glsl, lod_error_glsl, lod_held_candidates_comp}));
    TERRANE_TRY(slope, make("lod_slope", {lod_glsl, lod_keys_glsl, lod_slope_comp}));
    TERRANE_TRY(coarse_candidates,
                make("lod_coarse_candidates", {lod_glsl, lod_keys_glsl, lod_coarse_glsl,
                                               lod_error_glsl, lod_coarse_candidates_comp}));
    TERRANE_TRY(error, make("lod_error", {lod_glsl, lod_error_glsl, lod_error_comp}));
    return {};
}

// Takes over a resident set: frees the slots of chunks that have left.
void GpuTriangulator::State::follow(std::shared_ptr<const ResidentSet> next) {
    const bool has_same = resident != nullptr && resident->has_same_chunks(*next);
    // the chunks of the set before live until here, so that equal pointers mean equal chunks
    if (!has_same) {
        std::unordered_map<const Chunk*, std::uint32_t> kept;
        slot_of.assign(next->chunks().size(), kNone);
        for (std::size_t i = 0; i < next->chunks().size(); ++i) {
            const auto found = slots.find(next->chunks()[i].get());
            if (found == slots.end()) continue;
            slot_of[i] = found->second;
            kept.insert(*found);
            slots.erase(found);
        }
        for (const auto& [chunk, slot] : slots) free_slots.push_back(slot);
        slots = std::move(kept);
    }
    resident = std::move(next);
    if (!has_same) upload_table();
}

// Uploads the links of all resident chunks.
void GpuTriangulator::State::upload_table() {
    const std::span<const ResidentChunk> all = resident->chunks();
    std::vector<std::uint32_t> words(kTableWords * all.size());
    root_count = 0;
    block.level_first.fill(static_cast<std::uint32_t>(all.size()));
    for (std::size_t i = all.size(); i-- > 0;) {
        const ChunkKey& key = all[i]->key;
        block.level_first[key.level] = static_cast<std::uint32_t>(i);
        if (key.level == 0) ++root_count;
    }
    for (std::size_t level = kMostLevels; level-- > 0;)
        block.level_first[level] = std::min(block.level_first[level], block.level_first[level + 1]);
    for (std::size_t i = 0; i < all.size(); ++i) {
        const ChunkKey& key = all[i]->key;
        const ResidentSet::Links& links = resident->links(i);
        std::uint32_t* const to = &words[kTableWords * i];
        to[0] = key.level | static_cast<std::uint32_t>(key.x & 1) << 5 |
                static_cast<std::uint32_t>(key.y & 1) << 6;
        const std::array<ChunkKey, 4> beyond{
            ChunkKey{key.x - 1, key.y, key.level}, ChunkKey{key.x + 1, key.y, key.level},
            ChunkKey{key.x, key.y - 1, key.level}, ChunkKey{key.x, key.y + 1, key.level}};
        for (std::size_t side = 0; side < 4; ++side) {
            if (!resident->window().contains(beyond[side])) to[0] |= 1u << (7 + side);
            to[2 + side] = static_cast<std::uint32_t>(links.neighbour[side]);
            to[6 + side] = static_cast<std::uint32_t>(links.child[side]);
        }
        if (key.level == 0 && cut_to_north_east(key.x, key.y)) to[0] |= 1u << 11;
        to[1] = static_cast<std::uint32_t>(links.parent);
    }
    const std::size_t bytes = 4 * words.size();
    chunks.reserve(bytes + 4 * kFrameWords * all.size(), false);
    chunks.write(0, words.data(), bytes);
}

void GpuTriangulator::State::upload(const Chunk& chunk, std::uint32_t slot) {
    const internal::ChunkVertices& of = *chunk.vertices;
    staging.assign(kSlotWords, 0);
    const auto put = [&](std::size_t word, const void* from, std::size_t bytes) {
        std::memcpy(&staging[word], from, bytes);
    };
    put(0, of.areas.data(), sizeof of.areas);
    for (std::size_t i = 0; i < kAreaCount; ++i) {
        const Chunk::Area& area = chunk.areas[i];
        staging[kBoundsWord + i] = bits_of(area.max_vertex_bound);
        staging[kAreaHeightsWord + 2 * i] = static_cast<std::uint32_t>(area.low);
        staging[kAreaHeightsWord + 2 * i + 1] = static_cast<std::uint32_t>(area.high);
        staging[kCellBoundsWord + i] = bits_of(area.max_cell_bound);
    }
    put(kReachesWord, of.area_reaches.data(), sizeof of.area_reaches);
    put(kEastWord, &of.east_side, sizeof of.east_side);
    put(kNorthWord, &of.north_side, sizeof of.north_side);
    const std::array<double, 4> header{static_cast<double>(chunk.corner.x),
                                       static_cast<double>(chunk.corner.y),
                                       static_cast<double>(chunk.step), of.reach_base};
    put(kHeaderWord, header.data(), sizeof header);
    put(kHeaderWord + 8, &of.reach_unit, sizeof of.reach_unit);
    vertices.write(4 * kSlotWords * slot, staging.data(), 4 * kSlotWords);
    heights.write(4 * kHeightWords * slot, chunk.heights.data(), 4 * kSamples);
    heights.write(4 * (kHeightWords * slot + kSamples), chunk.cell_bounds.data(),
                  4 * chunk.cell_bounds.size());
}

// Uploads what a frame needs: chunks that its floor may refine, keys and fades, demands, and the uniform block.
void GpuTriangulator::State::prepare(const ScreenError& screen, const View& view, float floor,
                                     std::span<const TriangleDemand> others) {
    const std::span<const ResidentChunk> all = resident->chunks();
    std::vector<std::size_t> wanted;
    for (std::size_t i = 0; i < all.size(); ++i)
        if (least[i] < floor && slot_of[i] == kNone) wanted.push_back(i);
    const std::size_t needed = slots.size() + wanted.size();
    if (needed > slot_count) {
        const std::size_t grown = std::max(needed, slot_count + slot_count / 2);
        vertices.reserve(4 * kSlotWords * grown, true);
        heights.reserve(4 * kHeightWords * grown, true);
        for (std::size_t slot = grown; slot-- > slot_count;)
            free_slots.push_back(static_cast<std::uint32_t>(slot));
        slot_count = grown;
    }
    for (const std::size_t i : wanted) {
        const std::uint32_t slot = free_slots.back();
        free_slots.pop_back();
        upload(*all[i], slot);
        slots.emplace(all[i].get(), slot);
        slot_of[i] = slot;
    }
    std::size_t candidates = 0;
    frame_words.clear();
    for (std::size_t i = 0; i < all.size(); ++i) {
        const bool is_root = i < root_count;
        if (least[i] < floor) ++candidates;
        const float fade = is_root ? 1.0f : resident->fade(i);
        const float factor = fade < 1.0f ? 1.0f / (fade * fade) : 1.0f;
        for (const std::uint32_t word : {bits_of(least[i]), bits_of(factor), slot_of[i], 0u})
            frame_words.push_back(word);
    }
    // beyond the demand that ends the budget, none matters: sums of weights stay small
    demands.clear();
    for (const TriangleDemand& demand : others) {
        const double threshold_px = demand.threshold_px > 0.0 ? demand.threshold_px : 0.0;
        demands.emplace_back(screen.key_of(threshold_px), demand.triangles);
    }
    std::ranges::sort(demands, {}, [](const auto& demand) { return demand.first; });
    const auto budget = static_cast<std::uint32_t>(
        settings.triangle_budget - 2 * static_cast<std::size_t>(lattice.resident_root_count()));
    std::size_t weight = 0, demand_count = 0;
    for (auto& [key, triangles] : demands) {
        if (weight > budget) break;
        triangles = std::min(triangles, budget + 1);
        weight += triangles;
        ++demand_count;
        frame_words.push_back(bits_of(key));
        frame_words.push_back(triangles);
    }
    const std::size_t table_bytes = 4 * kTableWords * all.size();
    if (chunks.bytes < table_bytes + 4 * frame_words.size())
        chunks.reserve(table_bytes + 4 * frame_words.size(), true);
    chunks.write(table_bytes, frame_words.data(), 4 * frame_words.size());
    uploaded += 4 * frame_words.size() + sizeof block;

    area_capacity = std::max(area_capacity, kAreaCount * candidates);
    const std::size_t areas = area_capacity, count = all.size();
    const std::array<std::size_t, 6> work_at{3 * count,
                                             3 * count + areas,
                                             3 * count + areas + 64 * count,
                                             3 * count + areas + 64 * count + 6 * areas,
                                             3 * count + areas + 64 * count + 7 * areas,
                                             3 * count + areas + 64 * count + 25 * areas};
    constexpr std::size_t kMostCandidates = 1 << 16, kCandidateWords = 3;
    const std::size_t lists_at = work_at[5] + kCandidateWords * kMostCandidates;
    // the start of a range of a storage block is aligned
    constexpr std::size_t kAlignment = 64, kPlaceWords = 12;
    const std::size_t places_at = (lists_at + 2 * areas + kAlignment - 1) / kAlignment * kAlignment;
    const std::size_t place_words = kPlaceWords * (areas + root_count);
    work.reserve(4 * (places_at + place_words), false);
    const std::size_t axes_at = kAreaKeys * areas + 128 * count + kCoarse * root_count;
    keys.reserve(4 * (axes_at + 2 * kChunkSamples * count), false);
    offsets.reserve(4 * (kAreaOffsets * areas + kCoarse * root_count), false);
    // at the end of vertices[]
    const std::size_t bounds_at = kSlotWords * slot_count;
    if (bounds_at != coarse_bounds_at || vertices.bytes < 4 * (bounds_at + kCoarse * root_count)) {
        vertices.reserve(4 * (bounds_at + kCoarse * root_count), true);
        coarse_bounds_at = bounds_at;
    }
    for (std::size_t root = 0; root < root_count; ++root) {
        vertices.write(4 * (bounds_at + kCoarse * root), all[root]->vertices->coarse_bounds.data(),
                       4 * kCoarse);
    }

    const WorldPos& eye = view.eye_world;
    block.eye_lattice = {static_cast<double>(eye_frame.x), static_cast<double>(eye_frame.y), 0.0,
                         0.0};
    block.eye_spacing = {eye.x(), eye.y(), eye.z(), lattice.spacing};
    block.origin_quantum = {lattice.origin_x, lattice.origin_y, lattice.quantum,
                            view.near_distance};
    const Frustum frustum = make_frustum(view);
    for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector3d& n = frustum.normals[i];
        block.normals[i] = {n.x(), n.y(), n.z(), 0.0};
        block.planes[i] = {static_cast<float>(n.x()), static_cast<float>(n.y()),
                           static_cast<float>(n.z()), 0.0f};
    }
    const double ratio = settings.morph_ratio, squared = ratio * ratio;
    const bool morphs = ratio > 1.0;
    block.distances = {clearance, 0.0, ratio, morphs ? squared / (squared - 1.0) : 1.0};
    block.scalars = {screen.eye_heights(*all[0]).near_squared,
                     static_cast<float>(view.near_distance), floor,
                     morphs ? static_cast<float>(squared / (squared - 1.0)) : 1.0f};
    constexpr float kWindow = 1.03f;  // the first window begins so far below the last threshold
    block.guess = {last_threshold > 0.0f ? last_threshold / kWindow : 0.0f, 0.0f, 0.0f, 0.0f};
    const auto word = [](std::size_t value) { return static_cast<std::uint32_t>(value); };
    block.counts = {word(count), word(root_count), budget, word(demand_count)};
    block.bases = {word(work_at[0]), word(work_at[1]), word(work_at[2]), word(work_at[3])};
    block.more_bases = {word(kAreaKeys * areas), word(kAreaKeys * areas + 128 * count),
                        word(kAreaOffsets * areas), word(bounds_at)};
    block.options = {word(static_cast<std::size_t>(lattice.finest_level) + 1), morphs ? 1u : 0u,
                     word(static_cast<std::size_t>(lattice.finest_level)), word(axes_at)};
    block.last_bases = {word(work_at[4]), word(work_at[5]), word(lists_at), word(kMostCandidates)};
    block.capacity = {word(areas), word(places_at), 0, 0};
    device.places_byte = 4 * places_at;
    device.places_bytes = 4 * place_words;
    device.first_root_place = word(areas);
    device.first_root_offset = block.more_bases[2];
    device.morphs = morphs;
    for (std::size_t i = 0; i < reaches.centre.size(); ++i) {
        block.reaches[i] = {reaches.centre[i].half_width, reaches.centre[i].half_height,
                            reaches.midpoint[i].half_width, reaches.midpoint[i].half_height};
    }
    frame.write(0, &block, sizeof block);
}

// Runs a program and makes its results visible to the next.
void GpuTriangulator::State::run(const GlProgram& program, std::size_t groups) {
    glUseProgram(program.name());
    glDispatchCompute(static_cast<GLuint>(groups), 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
}

// As run(), with the number of groups in a word of the state.
void GpuTriangulator::State::run_indirect(const GlProgram& program, std::size_t word) const {
    glUseProgram(program.name());
    glDispatchComputeIndirect(static_cast<GLintptr>(4 * word));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
}

// Selects the threshold among the keys below the floor.
void GpuTriangulator::State::select() {
    const std::size_t count = resident->chunks().size();
    run(open, count);
    run(scan, 1);
    run(list, count);
    run(coarse, (kCoarse * root_count + 63) / 64);
    run(coarse_trim, 1);
    for (std::uint32_t level = 0; level < block.options[0]; ++level) {
        for (const GlProgram* program : {&centres, &midpoints}) {
            glProgramUniform1ui(program->name(), 0, level);
            run_indirect(*program, kLevelGroups + 3 * level);
        }
    }
    for (std::uint32_t step = 0; step < kSearchSteps; ++step) {
        for (const auto& [program, groups] :
             {std::pair{&count_keys, kSearchGroups}, std::pair{&pick, kPickGroups}}) {
            glProgramUniform1ui(program->name(), 0, step);
            run_indirect(*program, groups + 3 * step);
        }
    }
}

void GpuTriangulator::State::triangulate() {
    run_indirect(masks, kAllGroups);
    if (block.options[1] != 0) {
        run(slope, 1);
        run(coarse_morph, root_count);
        for (std::uint32_t level = 0; level < block.options[0]; ++level) {
            glProgramUniform1ui(morph.name(), 0, level);
            run_indirect(morph, kLevelGroups + 3 * level);
        }
    }
    run_indirect(tally, kAllGroups);
    glProgramUniform1i(coarse_mesh.name(), 0, 0);
    run(coarse_mesh, root_count);
    run(sum, 1);
    glProgramUniform1i(coarse_mesh.name(), 0, 1);
    run(coarse_mesh, root_count);
    run_indirect(emit, kAllGroups);
    run_indirect(error_least, kCellGroups);
    run_indirect(cell_candidates, kCellGroups);
    run_indirect(held_candidates, kHeldGroups);
    run(coarse_candidates, (kCoarse * root_count + 63) / 64);
    run_indirect(error, kErrorGroups);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_ELEMENT_ARRAY_BARRIER_BIT);
}

// Reports error and status of the mesh: waits for the device.
void GpuTriangulator::State::report(const ScreenError& screen,
                                    std::span<const TriangleDemand> others) {
    const std::vector<std::uint32_t> words = state.read<std::uint32_t>(0, kResiduals + 5);
    mesh.triangle_count = words[kTriangles];
    area_count = words[kAreaTotal];
    const auto residual = [&](std::size_t i) {
        return static_cast<double>(std::bit_cast<float>(words[kResiduals + i]));
    };
    // the device has squares of bound over distance
    const double pixels = screen.error_px_at(1.0, 0.0) * screen.least_distance();
    const auto in_pixels = [&](std::size_t i) {
        return pixels * std::sqrt(residual(i)) * (1.0 + 1e-6);
    };
    internal::ErrorParts parts;
    parts.residual.absent = in_pixels(0);
    parts.residual.held = in_pixels(1);
    parts.residual.finest = in_pixels(2);
    parts.residual.finest_m = residual(3);
    parts.residual.morphing = residual(4);
    const internal::Morph of_frame(settings.morph_ratio, threshold);
    parts.fading = internal::fading_error(*resident, reaches, screen, of_frame, threshold,
                                          [&](std::size_t index) { return least[index]; });
    internal::report_error(screen, of_frame, threshold, settings.max_error_px,
                           source->is_certified(), parts, mesh);
    mesh.demand_threshold_px = mesh.threshold_px;
    mesh.demand_triangles = 0;
    for (const TriangleDemand& demand : others) {
        if (screen.key_of(demand.threshold_px > 0.0 ? demand.threshold_px : 0.0) < threshold) {
            mesh.demand_triangles += demand.triangles;
        } else {
            mesh.demand_threshold_px = std::max(mesh.demand_threshold_px, demand.threshold_px);
        }
    }
}

Result<GpuTriangulator> GpuTriangulator::create(const GlContext& context,
                                                const HeightSource& source,
                                                const TriangulatorSettings& settings) {
    TERRANE_TRY(Triangulator checked, Triangulator::create(source, settings));
    auto state = std::make_unique<State>(source, settings);
    if (static_cast<std::size_t>(state->lattice.resident_root_count()) > kMostRoots) {
        return fail(ErrorCode::device_unavailable,
                    "the GPU triangulator takes at most " + std::to_string(kMostRoots) +
                        " root squares, got " +
                        std::to_string(state->lattice.resident_root_count()));
    }
    state->context = context.keep_alive();
    TERRANE_TRY(state->compile());
    state->frame.reserve(sizeof(FrameBlock), false);
    state->state.reserve(4 * kStateWords, false);
    state->indices.reserve(12 * settings.triangle_budget, false);
    TERRANE_TRY(internal::check_gl("make the GPU triangulator"));
    return GpuTriangulator(std::move(state));
}

GpuTriangulator::GpuTriangulator(std::unique_ptr<State> state) : state_(std::move(state)) {}
GpuTriangulator::GpuTriangulator(GpuTriangulator&&) noexcept = default;
GpuTriangulator& GpuTriangulator::operator=(GpuTriangulator&&) noexcept = default;
GpuTriangulator::~GpuTriangulator() = default;

Result<TerrainMesh> GpuTriangulator::update(std::shared_ptr<const ResidentSet> resident,
                                            const View& view,
                                            std::span<const TriangleDemand> others) {
    State& s = *state_;
    TERRANE_TRY(view.validate());
    if (resident->has_solids()) {
        return fail(ErrorCode::invalid_argument, "the GPU triangulator does not draw volumes yet");
    }
    s.uploaded = 0;
    s.mesh = {};
    s.follow(std::move(resident));
    s.mesh.resident = s.resident;
    if (!s.resident->has_roots()) {
        s.mesh.threshold_px = s.settings.max_error_px;
        s.mesh.demand_threshold_px = internal::kInfinity;
        return s.mesh;
    }
    TERRANE_TRY(s.eye_frame, internal::make_eye_frame(s.lattice, view.eye_world));
    s.clearance = internal::clearance_of(*s.source, view.eye_world);
    const ScreenError screen(view, *s.source, s.clearance);
    const std::span<const ResidentChunk> all = s.resident->chunks();
    s.least.resize(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
        const Chunk& chunk = *all[i];
        if (i < s.root_count) {
            s.least[i] = -1.0f;  // always open
        } else if (!(s.resident->fade(i) > 0.0f)) {
            s.least[i] = internal::OpenChunk::kNever;
        } else {
            const auto exponent =
                static_cast<std::size_t>(s.lattice.finest_level - chunk.key.level);
            s.least[i] =
                screen.least_key(screen.reach_of(chunk, s.reaches.centre[exponent].half_width),
                                 chunk.max_vertex_bound);
        }
    }
    const float target =
        internal::target_key(screen, s.settings.morph_ratio, s.settings.max_error_px);
    float floor = std::min(target, s.last_threshold > 0.0f ? kFloorMargin * s.last_threshold
                                                           : screen.key_of(kFirstFloor_px));
    for (;;) {
        s.prepare(screen, view, floor, others);
        glBindBufferBase(GL_UNIFORM_BUFFER, 0, s.frame.buffer.name());
        GLuint binding = 0;
        for (const DeviceArray* array : {&s.chunks, &s.vertices, &s.heights, &s.state, &s.work,
                                         &s.keys, &s.offsets, &s.indices})
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding++, array->buffer.name());
        glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, s.state.buffer.name());
        s.select();
        s.threshold = s.state.read<float>(kThreshold, 1)[0];
        if (s.threshold < floor || floor == target) break;
        floor = std::min(target, kFloorStep * floor);
    }
    s.last_threshold = s.threshold;
    s.triangulate();
    s.report(screen, others);
    s.device.indices = s.indices.buffer.name();
    s.device.commands = s.state.buffer.name();
    s.device.command_byte = 4 * kDraw;
    s.device.places = s.work.buffer.name();
    s.device.offsets = s.offsets.buffer.name();
    s.device.heights = s.heights.buffer.name();
    s.mesh.device = &s.device;
    TERRANE_TRY(internal::check_gl("triangulate on the device"));
    return s.mesh;
}

Result<void> GpuTriangulator::change(const TriangulatorSettings& settings) {
    TERRANE_TRY(Triangulator checked, Triangulator::create(*state_->source, settings));
    state_->settings = settings;
    state_->indices.reserve(12 * settings.triangle_budget, false);
    return internal::check_gl("change the GPU triangulator");
}

Result<TerrainMesh> GpuTriangulator::read() {
    State& s = *state_;
    s.read_indices.clear();
    s.read_chunks.clear();
    s.read_offsets.clear();
    TerrainMesh mesh = s.mesh;
    if (mesh.device == nullptr) return mesh;
    mesh.device = nullptr;
    const std::vector<std::uint32_t> state = s.state.read<std::uint32_t>(0, kStateWords);
    const std::size_t areas = state[kAreaTotal], triangles = state[kTriangles];
    const std::vector<std::uint32_t> list = s.work.read<std::uint32_t>(s.block.bases[0], areas);
    const std::vector<std::uint32_t> masks =
        s.work.read<std::uint32_t>(s.block.bases[2], 6 * areas);
    std::vector<std::uint32_t> first = s.work.read<std::uint32_t>(s.block.bases[3], areas);
    first.push_back(static_cast<std::uint32_t>(triangles));
    std::vector<std::uint32_t> first_of_root(
        state.begin() + kRootTriangles,
        state.begin() + kRootTriangles + static_cast<std::ptrdiff_t>(s.root_count));
    first_of_root.push_back(first[0]);
    const std::vector<std::uint32_t> indices = s.indices.read<std::uint32_t>(0, 3 * triangles);
    const bool morphs = s.block.options[1] != 0;
    std::vector<float> offsets, coarse;
    if (morphs) {
        offsets = s.offsets.read<float>(0, kAreaOffsets * areas);
        coarse = s.offsets.read<float>(s.block.more_bases[2], kCoarse * s.root_count);
    }
    const auto sample_of = [&](std::uint32_t vertex) {
        if (vertex >= kRootVertex) {
            return static_cast<std::uint16_t>((vertex - kRootVertex) % kSamples);
        }
        const std::size_t area = list[vertex / kAreaOffsets] & 63u, at = vertex % kAreaOffsets;
        return static_cast<std::uint16_t>((area / kChunkAreas * kAreaCells + at / kAreaSide) *
                                              kChunkSamples +
                                          area % kChunkAreas * kAreaCells + at % kAreaSide);
    };
    s.read_offsets.reserve(s.resident->chunks().size());
    std::size_t area = 0;
    for (std::size_t i = 0; i < s.resident->chunks().size(); ++i) {
        MeshChunk made;
        made.chunk = s.resident->chunks()[i].get();
        made.first_index = static_cast<std::uint32_t>(s.read_indices.size());
        const auto copy = [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = 3 * begin; k < 3 * end; ++k)
                s.read_indices.push_back(sample_of(indices[k]));
        };
        std::vector<float> of_chunk(morphs ? kSamples : 0, 0.0f);
        if (i < s.root_count) {
            copy(first_of_root[i], first_of_root[i + 1]);
            for (std::size_t k = 0; morphs && k < kCoarse; ++k)
                of_chunk[2 * (k / kCoarseSide) * kChunkSamples + 2 * (k % kCoarseSide)] =
                    coarse[kCoarse * i + k];
        }
        for (; area < areas && list[area] >> 9 == i; ++area) {
            copy(first[area], first[area + 1]);
            if (!morphs || (masks[6 * area] | masks[6 * area + 1]) == 0) continue;
            for (std::size_t k = 0; k < kAreaOffsets; ++k) {
                of_chunk[sample_of(static_cast<std::uint32_t>(kAreaOffsets * area + k))] =
                    offsets[kAreaOffsets * area + k];
            }
        }
        made.index_count = static_cast<std::uint32_t>(s.read_indices.size()) - made.first_index;
        if (made.index_count == 0) continue;
        s.read_offsets.push_back(std::move(of_chunk));
        if (morphs) made.offsets = s.read_offsets.back().data();
        s.read_chunks.push_back(made);
    }
    mesh.chunks = s.read_chunks;
    mesh.indices = s.read_indices;
    TERRANE_TRY(internal::check_gl("read the device's mesh"));
    return mesh;
}

std::size_t GpuTriangulator::device_bytes() const {
    const State& s = *state_;
    return s.frame.bytes + s.chunks.bytes + s.vertices.bytes + s.heights.bytes + s.state.bytes +
           s.work.bytes + s.keys.bytes + s.offsets.bytes + s.indices.bytes;
}

std::size_t GpuTriangulator::area_count() const { return state_->area_count; }

std::size_t GpuTriangulator::uploaded_bytes() const { return state_->uploaded; }

}  // namespace terrane
