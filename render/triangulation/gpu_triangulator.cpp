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
#include "gl/arithmetic_probe.h"
#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "gl/host_state.h"
#include "gl/shader.h"
#include "light/frame_uniforms.h"
#include "lod/frame_mesh.h"
#include "lod/screen_error.h"
#include "lod/solid_selection.h"
#include "triangulation/device_chunks.h"
#include "triangulation/device_mesh.h"

#include <terrane/render/gpu_triangulator.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace {

using internal::AreaVertices;
using internal::DeviceArray;
using internal::DeviceChunks;
using internal::GlBuffer;
using internal::GlProgram;
using internal::ScreenError;
using internal::SolidSelection;

// Layouts of lod.glsl
constexpr std::size_t kAreaCount = std::size_t{kChunkAreas} * kChunkAreas;
constexpr std::size_t kSamples = DeviceChunks::kSamples;
constexpr std::size_t kAreaKeys = AreaVertices::kKinds * AreaVertices::kSquares;
constexpr std::size_t kAreaSide = kAreaCells + 1, kAreaOffsets = kAreaSide * kAreaSide;
constexpr std::size_t kCoarseSide = DeviceChunks::kCoarseSide, kCoarse = DeviceChunks::kCoarse;
constexpr std::uint32_t kRootVertex = 0x80000000u;  // first number of the roots' vertices

// Words of state[]
constexpr std::size_t kAreaTotal = 0, kThreshold = 1, kTriangles = 5, kDraw = 8, kResiduals = 160;
constexpr std::size_t kLevelGroups = 20, kAllGroups = 96;
constexpr std::size_t kSearchGroups = 128, kPickGroups = 144;
constexpr std::size_t kErrorGroups = 169, kHeldGroups = 172, kCellGroups = 175, kAbove = 179;
constexpr std::size_t kRootTriangles = 184 + 2048,
                      kStateWords = kRootTriangles + DeviceChunks::kMostRoots;

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

}  // namespace

struct GpuTriangulator::State {
    State(const HeightSource& ground, const TriangulatorSettings& chosen)
        : source(&ground),
          lattice(ground.lattice()),
          settings(chosen),
          reaches(internal::make_reaches(ground)),
          chunks(ground.lattice()),
          solids(chunks_of(ground)) {}

    const HeightSource* source;
    Lattice lattice;
    TriangulatorSettings settings;
    internal::Reaches reaches;
    std::shared_ptr<const void> context;
    bool is_hosted = false;  // in a host's context

    GlProgram open, scan, list, coarse, coarse_trim, centres, midpoints, count_keys, pick, masks,
        coarse_morph, morph, in_place, tally, coarse_mesh, sum, emit, slope, error_least,
        cell_candidates, held_candidates, coarse_candidates, error, above;
    DeviceChunks chunks;
    SolidSelection solids;
    GlBuffer frame;
    DeviceArray state, work, keys, offsets, indices;

    internal::GpuTimer timer;

    // per frame
    FrameBlock block{};
    std::vector<std::uint32_t> frame_words, volume_words;
    std::vector<float> least;
    std::vector<internal::WeightedKey> others, sorted;  // keys of demands; in ascending order
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
    void find_least_keys(const ScreenError& screen);
    void write_pins();
    Result<void> upload_frame(float floor);
    Result<void> lay_out(std::size_t wanted_areas);
    void fill_block(const ScreenError& screen, const View& view, float floor);
    Result<void> prepare(const ScreenError& screen, const View& view, float floor);
    void bind() const;
    static void run(const GlProgram& program, std::size_t groups);
    void run_indirect(const GlProgram& program, std::size_t word) const;
    void select();
    void activate_and_morph();
    void find_in_place();
    void decide_solids(const ScreenError& screen);
    void write_mesh();
    void report(const ScreenError& screen, std::span<const std::uint32_t> words,
                std::span<const TriangleDemand> demands);
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
    TERRANE_TRY(in_place, make("lod_in_place", {lod_glsl, lod_squares_glsl, lod_in_place_comp}));
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
    TERRANE_TRY(above, make("lod_above", {lod_glsl, lod_above_comp}));
    return {};
}

// Least keys of all resident chunks, which decide whether a floor opens them.
void GpuTriangulator::State::find_least_keys(const ScreenError& screen) {
    const ResidentSet& resident = *chunks.resident();
    least.resize(resident.chunks().size());
    for (std::size_t i = 0; i < least.size(); ++i) {
        const Chunk& chunk = *resident.chunks()[i];
        if (i < chunks.root_count()) {
            least[i] = -1.0f;  // always open
        } else if (!(resident.fade(i) > 0.0f)) {
            least[i] = internal::OpenChunk::kNever;
        } else {
            const auto exponent = static_cast<std::size_t>(lattice.finest_level - chunk.key.level);
            least[i] = screen.least_key(screen.reach_of(chunk, reaches.centre[exponent].half_width),
                                        chunk.max_vertex_bound);
        }
    }
}

// Appends the pins of volumes and the triangles that these replace: see pin_words() of lod.glsl.
void GpuTriangulator::State::write_pins() {
    using internal::SolidPins;
    const auto write_word = [&](std::size_t word) {
        frame_words.push_back(static_cast<std::uint32_t>(word));
    };
    const auto write_both = [&](std::uint64_t bits) {
        write_word(bits & 0xffffffffu);
        write_word(bits >> 32);
    };
    const auto write_rect = [&](const SolidPins::Rect& rect) {
        for (const std::int64_t side : {rect.west, rect.south, rect.east, rect.north})
            write_both(std::bit_cast<std::uint64_t>(static_cast<double>(side)));
    };
    const std::span<const SolidPins::Group> groups = solids.pins().groups();
    const std::span<const SolidSelection::Replacement> replacements = solids.replacements();
    for (std::size_t i = 0; i < groups.size(); ++i) {
        write_rect(groups[i].all);
        write_word(groups[i].first);
        write_word(groups[i].end);
        write_word(bits_of(groups[i].key));
        write_word(static_cast<std::size_t>(replacements[i].index));
    }
    for (std::size_t i = 0; i < groups.size(); ++i) {
        for (std::size_t pin = groups[i].first; pin < groups[i].end; ++pin) {
            const internal::ReplacedTriangles::OfArea& of_area =
                replacements[i].triangles->areas[pin - groups[i].first];
            write_rect(solids.pins().pins()[pin]);
            write_word(i);
            write_word(static_cast<std::size_t>(of_area.area));
            for (const std::uint64_t squares : of_area.squares) write_both(squares);
        }
    }
}

// Uploads chunks that a floor may open, the keys and fades of all, demands, and pins of volumes.
Result<void> GpuTriangulator::State::upload_frame(float floor) {
    const ResidentSet& resident = *chunks.resident();
    const internal::SolidPins& pins = solids.pins();
    std::vector<std::size_t> wanted;
    std::size_t opened = 0;
    volume_words.assign(least.size(), 0);
    for (std::size_t number = 0; const auto& replacement : solids.replacements())
        volume_words[static_cast<std::size_t>(replacement.index)] =
            static_cast<std::uint32_t>(++number << 1);
    for (std::size_t i = 0; i < least.size(); ++i) {
        const bool is_pinned = (i < chunks.root_count() || resident.fade(i) > 0.0f) &&
                               pins.opens(*resident.chunks()[i], floor);
        volume_words[i] |= is_pinned ? 1u : 0u;
        if (!(least[i] < floor) && !is_pinned) continue;
        ++opened;
        if (chunks.slot_of(i) == DeviceChunks::kNone) wanted.push_back(i);
    }
    TERRANE_TRY(chunks.load(wanted));
    TERRANE_TRY(lay_out(kAreaCount * opened));
    frame_words.clear();
    for (std::size_t i = 0; i < least.size(); ++i) {
        const float fade = i < chunks.root_count() ? 1.0f : resident.fade(i);
        const float factor = fade < 1.0f ? 1.0f / (fade * fade) : 1.0f;
        for (const std::uint32_t word :
             {bits_of(least[i]), bits_of(factor), chunks.slot_of(i), volume_words[i]})
            frame_words.push_back(word);
    }
    // beyond the demand that ends the budget, none matters: sums of weights stay small
    sorted = others;
    std::ranges::sort(sorted, {}, &internal::WeightedKey::key);
    const auto budget = static_cast<std::uint32_t>(
        settings.triangle_budget - internal::root_triangles(lattice) - solids.reserved_triangles());
    std::size_t weight = 0;
    std::uint32_t demand_count = 0;
    for (const internal::WeightedKey& demand : sorted) {
        if (weight > budget) break;
        const std::uint32_t triangles = std::min(demand.weight, budget + 1);
        weight += triangles;
        ++demand_count;
        frame_words.push_back(bits_of(demand.key));
        frame_words.push_back(triangles);
    }
    block.counts = {static_cast<std::uint32_t>(least.size()),
                    static_cast<std::uint32_t>(chunks.root_count()), budget, demand_count};
    write_pins();
    uploaded += 4 * frame_words.size() + sizeof block;
    return chunks.write_frame(frame_words);
}

// Places of the arrays, for a number of areas that may be open.
Result<void> GpuTriangulator::State::lay_out(std::size_t wanted_areas) {
    area_capacity = std::max(area_capacity, wanted_areas);
    const std::size_t areas = area_capacity, count = least.size(), roots = chunks.root_count();
    constexpr std::size_t kMostCandidates = 1 << 16, kCandidateWords = 3;
    constexpr std::size_t kPlaceWords = 12, kSquareWords = 18;
    // the start of a range of a storage block is aligned
    constexpr std::size_t kAlignment = 64;
    const std::size_t list_at = 3 * count, slots = list_at + areas, masks_at = slots + 64 * count;
    const std::size_t counts = masks_at + 6 * areas, squares = counts + areas;
    const std::size_t candidates = squares + kSquareWords * areas;
    const std::size_t lists = candidates + kCandidateWords * kMostCandidates;
    const std::size_t volume_flags = lists + 2 * areas;
    const std::size_t places =
        (volume_flags + solids.replacements().size() + kAlignment - 1) / kAlignment * kAlignment;
    const std::size_t place_words = kPlaceWords * (areas + roots);
    const std::size_t sides = kAreaKeys * areas, coarse_keys = sides + 128 * count;
    const std::size_t axes = coarse_keys + kCoarse * roots;
    const std::size_t coarse_offsets = kAreaOffsets * areas;
    TERRANE_TRY(work.reserve(4 * (places + place_words), false));
    TERRANE_TRY(keys.reserve(4 * (axes + 2 * kChunkSamples * count), false));
    TERRANE_TRY(offsets.reserve(4 * (coarse_offsets + kCoarse * roots), false));
    const auto word = [](std::size_t value) { return static_cast<std::uint32_t>(value); };
    block.bases = {word(list_at), word(slots), word(masks_at), word(counts)};
    block.more_bases = {word(sides), word(coarse_keys), word(coarse_offsets), word(axes)};
    block.last_bases = {word(squares), word(candidates), word(lists), word(kMostCandidates)};
    block.capacity = {word(areas), word(places), word(chunks.first_slot()), word(volume_flags)};
    device.places_byte = 4 * places;
    device.places_bytes = 4 * place_words;
    device.first_root_place = word(areas);
    device.first_root_offset = word(coarse_offsets);
    return {};
}

// The uniform block, besides what upload_frame() sets.
void GpuTriangulator::State::fill_block(const ScreenError& screen, const View& view, float floor) {
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
    const double full = morphs ? squared / (squared - 1.0) : 1.0;
    block.distances = {clearance, 0.0, ratio, full};
    block.scalars = {screen.eye_heights(*chunks.resident()->chunks()[0]).near_squared,
                     static_cast<float>(view.near_distance), floor, static_cast<float>(full)};
    constexpr float kWindow = 1.03f;  // the first window begins so far below the last threshold
    block.guess = {last_threshold > 0.0f ? last_threshold / kWindow : 0.0f, 0.0f, 0.0f, 0.0f};
    const auto finest = static_cast<std::uint32_t>(lattice.finest_level);
    const auto groups = static_cast<std::uint32_t>(solids.pins().groups().size());
    block.options = {finest + 1, morphs ? 1u : 0u, finest, groups};
    block.level_first = chunks.level_first();
    device.morphs = morphs;
    for (std::size_t i = 0; i < reaches.centre.size(); ++i) {
        block.reaches[i] = {reaches.centre[i].half_width, reaches.centre[i].half_height,
                            reaches.midpoint[i].half_width, reaches.midpoint[i].half_height};
    }
}

Result<void> GpuTriangulator::State::prepare(const ScreenError& screen, const View& view,
                                             float floor) {
    TERRANE_TRY(upload_frame(floor));
    fill_block(screen, view, floor);
    glNamedBufferSubData(frame.name(), 0, sizeof block, &block);
    return {};
}

void GpuTriangulator::State::bind() const {
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame.name());
    GLuint binding = 0;
    for (const DeviceArray* array : {&chunks.table(), &chunks.vertices(), &chunks.heights(), &state,
                                     &work, &keys, &offsets, &indices})
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding++, array->name());
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, state.name());
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
    const std::size_t count = least.size(), root_count = chunks.root_count();
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

void GpuTriangulator::State::activate_and_morph() {
    run_indirect(masks, kAllGroups);
    if (block.options[1] == 0) return;
    run(slope, 1);
    run(coarse_morph, chunks.root_count());
    for (std::uint32_t level = 0; level < block.options[0]; ++level) {
        glProgramUniform1ui(morph.name(), 0, level);
        run_indirect(morph, kLevelGroups + 3 * level);
    }
}

// Sets the threshold, and the flags of volumes whose replaced triangles are in place. Waits for the device.
void GpuTriangulator::State::find_in_place() {
    const std::vector<std::uint32_t> flags(solids.replacements().size(), 1);
    work.write(4 * std::size_t{block.capacity[3]}, flags.data(), 4 * flags.size());
    run(in_place, solids.pins().pins().size());
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    threshold = state.read<float>(kThreshold, 1)[0];
}

// Decides which volumes are drawn, and tells the device, which leaves out the triangles that these replace.
void GpuTriangulator::State::decide_solids(const ScreenError& screen) {
    const std::span<SolidSelection::Replacement> replacements = solids.replacements();
    const std::size_t first = block.capacity[3];
    std::vector<std::uint32_t> flags = work.read<std::uint32_t>(first, replacements.size());
    for (std::size_t i = 0; i < flags.size(); ++i) replacements[i].are_in_place = flags[i] != 0;
    solids.decide(internal::Morph(settings.morph_ratio, threshold), threshold, screen);
    for (std::size_t i = 0; i < flags.size(); ++i) flags[i] = replacements[i].is_drawn ? 1 : 0;
    work.write(4 * first, flags.data(), 4 * flags.size());
}

void GpuTriangulator::State::write_mesh() {
    const std::size_t root_count = chunks.root_count();
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

// Reports error and status of the mesh.
void GpuTriangulator::State::report(const ScreenError& screen, std::span<const std::uint32_t> words,
                                    std::span<const TriangleDemand> demands) {
    mesh.triangle_count = words[kTriangles] + solids.triangle_count();
    mesh.solids = solids.drawn();
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
    parts.fading = internal::fading_error(*chunks.resident(), reaches, screen, of_frame, threshold,
                                          [&](std::size_t index) { return least[index]; });
    parts.left_out = solids.left_out_px();
    parts.absent_solids = solids.absent_px();
    parts.drawn_solids = solids.drawn_px();
    internal::report_error(screen, of_frame, threshold, settings.max_error_px,
                           source->is_certified(), parts, mesh);
    internal::grant_demands(demands, others, threshold, mesh);
}

Result<GpuTriangulator> GpuTriangulator::create(const GlContext& context,
                                                const HeightSource& source,
                                                const TriangulatorSettings& settings) {
    TERRANE_TRY(Triangulator checked, Triangulator::create(source, settings));
    const internal::HostState host(context.is_adopted());
    auto state = std::make_unique<State>(source, settings);
    state->is_hosted = context.is_adopted();
    if (static_cast<std::size_t>(state->lattice.resident_root_count()) > DeviceChunks::kMostRoots) {
        return fail(ErrorCode::device_unavailable,
                    "the GPU triangulator takes at most " +
                        std::to_string(DeviceChunks::kMostRoots) + " root squares, got " +
                        std::to_string(state->lattice.resident_root_count()));
    }
    state->context = context.keep_alive();
    TERRANE_TRY(internal::probe_arithmetic());
    TERRANE_TRY(state->compile());
    state->frame = internal::make_buffer();
    glNamedBufferStorage(state->frame.name(), sizeof(FrameBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
    TERRANE_TRY(state->state.reserve(4 * kStateWords, false));
    TERRANE_TRY(state->indices.reserve(12 * settings.triangle_budget, false));
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
    const internal::HostState host(s.is_hosted);
    TERRANE_TRY(view.validate());
    s.uploaded = 0;
    s.mesh = {};  // for read(), should this fail
    TERRANE_TRY(s.chunks.follow(std::move(resident)));
    s.mesh.resident = s.chunks.resident();
    if (!s.mesh.resident->has_roots()) {
        s.mesh.threshold_px = s.settings.max_error_px;
        s.mesh.demand_threshold_px = internal::kInfinity;
        return s.mesh;
    }
    TERRANE_TRY(s.eye_frame, internal::make_eye_frame(s.lattice, view.eye_world));
    s.clearance = internal::clearance_of(*s.source, view.eye_world);
    const ScreenError screen(view, *s.source, s.clearance);
    s.find_least_keys(screen);
    s.solids.begin(s.mesh.resident, screen, s.settings.max_error_px, s.settings.morph_ratio,
                   s.settings.triangle_budget - internal::root_triangles(s.lattice));
    const bool has_replacements = !s.solids.replacements().empty();
    const float target = internal::target_key(screen, s.settings.morph_ratio,
                                              s.settings.max_error_px - s.solids.allowed_px());
    internal::find_demand_keys(screen, others, s.others);
    float floor = internal::first_floor(screen, target, s.last_threshold);
    const auto is_found = [&] { return s.threshold < floor || floor == target; };
    // the triangles of a floor that was too low are in vain, but the frame waits for the device only once, or twice if
    // volumes replace triangles
    std::vector<std::uint32_t> words;
    for (;;) {
        TERRANE_TRY(s.prepare(screen, view, floor));
        s.bind();
        s.timer.begin();
        s.select();
        s.activate_and_morph();
        if (has_replacements) {
            s.find_in_place();
            if (is_found()) s.decide_solids(screen);
        }
        s.write_mesh();
        s.timer.end();
        words = s.state.read<std::uint32_t>(0, kResiduals + 5);
        s.threshold = std::bit_cast<float>(words[kThreshold]);
        if (is_found()) break;
        floor = internal::next_floor(floor, target);
    }
    if (!has_replacements) s.decide_solids(screen);
    s.last_threshold = s.threshold;
    s.report(screen, words, others);
    s.timer.collect();
    s.device.indices = s.indices.name();
    s.device.commands = s.state.name();
    s.device.command_byte = 4 * kDraw;
    s.device.places = s.work.name();
    s.device.offsets = s.offsets.name();
    s.device.heights = s.chunks.heights().name();
    s.mesh.device = &s.device;
    TERRANE_TRY(internal::check_gl("triangulate on the device"));
    return s.mesh;
}

Result<void> GpuTriangulator::change(const TriangulatorSettings& settings) {
    TERRANE_TRY(Triangulator checked, Triangulator::create(*state_->source, settings));
    TERRANE_TRY(state_->indices.reserve(12 * settings.triangle_budget, false));
    state_->settings = settings;
    return internal::check_gl("change the GPU triangulator");
}

Result<TerrainMesh> GpuTriangulator::read() {
    State& s = *state_;
    const internal::HostState host(s.is_hosted);
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
        state.begin() + kRootTriangles + static_cast<std::ptrdiff_t>(s.chunks.root_count()));
    first_of_root.push_back(first[0]);
    const std::vector<std::uint32_t> indices = s.indices.read<std::uint32_t>(0, 3 * triangles);
    const bool morphs = s.block.options[1] != 0;
    std::vector<float> offsets, coarse;
    if (morphs) {
        offsets = s.offsets.read<float>(0, kAreaOffsets * areas);
        coarse = s.offsets.read<float>(s.device.first_root_offset, kCoarse * s.chunks.root_count());
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
    s.read_offsets.reserve(mesh.resident->chunks().size());
    std::size_t area = 0;
    for (std::size_t i = 0; i < mesh.resident->chunks().size(); ++i) {
        MeshChunk made;
        made.chunk = mesh.resident->chunks()[i].get();
        made.first_index = static_cast<std::uint32_t>(s.read_indices.size());
        const auto copy = [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = 3 * begin; k < 3 * end; ++k)
                s.read_indices.push_back(sample_of(indices[k]));
        };
        std::vector<float> of_chunk(morphs ? kSamples : 0, 0.0f);
        if (i < s.chunks.root_count()) {
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

Result<bool> GpuTriangulator::is_above_ground(const WorldPos& place) {
    State& s = *state_;
    if (s.mesh.device == nullptr) return false;
    const internal::HostState host(s.is_hosted);
    s.bind();
    constexpr std::uint32_t kNothing = 0;
    s.state.write(4 * kAbove, &kNothing, sizeof kNothing);
    const std::span<const ResidentChunk> chunks = s.mesh.resident->chunks();
    for (std::size_t i = 0; i < chunks.size(); ++i) {
        if (s.chunks.slot_of(i) == DeviceChunks::kNone) continue;
        const Chunk& chunk = *chunks[i];
        const double spacing = s.lattice.spacing * static_cast<double>(chunk.step);
        const double x = place.x() - s.lattice.x(chunk.corner.x);
        const double y = place.y() - s.lattice.y(chunk.corner.y);
        // wider than the margin of the triangles
        if (std::min(x, y) < -spacing || std::max(x, y) > (kChunkCells + 1) * spacing) continue;
        glProgramUniform1ui(s.above.name(), 0, static_cast<GLuint>(i));
        glProgramUniform4d(s.above.name(), 1, x, y, place.z(), spacing);
        State::run(s.above, 1);
    }
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    const bool is_above = s.state.read<std::uint32_t>(kAbove, 1)[0] == 1;
    TERRANE_TRY(internal::check_gl("find the triangles below a place"));
    return is_above;
}

std::size_t GpuTriangulator::device_bytes() const {
    const State& s = *state_;
    return sizeof(FrameBlock) + s.chunks.bytes() + s.state.bytes() + s.work.bytes() +
           s.keys.bytes() + s.offsets.bytes() + s.indices.bytes();
}

std::optional<double> GpuTriangulator::gpu_ms() const { return state_->timer.last_ms(); }

std::size_t GpuTriangulator::area_count() const { return state_->area_count; }

std::size_t GpuTriangulator::uploaded_bytes() const { return state_->uploaded; }

}  // namespace terrane
