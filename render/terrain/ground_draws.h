// SPDX-License-Identifier: MIT
#pragma once

#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "light/frame_uniforms.h"
#include "light/shadow_maps.h"

#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Samples of one slot of a page.
inline constexpr int kSlotSamples = kChunkSamples * kChunkSamples;

/// Location of a chunk on the device.
struct ChunkSlot {
    std::weak_ptr<const Chunk> chunk;  ///< distinguishes a chunk from a later one with the same key
    std::uint64_t checked = 0;  ///< number of the last follow() after which find() returned it
    int page = -1;
    int slot = -1;
};

/// A buffer of heights with one slot per chunk.
struct ChunkPage {
    GlBuffer heights;       ///< [capacity * kSlotSamples] quanta, and padding for any 16-bit index
    int capacity = 0;       ///< slots
    std::vector<int> free;  ///< free slots; the next one to use is last
};

/// Keeps the heights of drawn chunks on the device while the chunks are resident, many per buffer (page), so that one
/// draw call covers all chunks of a page.
///
/// A full page doubles up to a limit of slots; then a new page is added. Empty pages at the end are freed.
class ChunkPool {
public:
    /// @param max_page_slots 1 or more, at most largest_page()
    explicit ChunkPool(int max_page_slots) : max_page_slots_(max_page_slots) {}

    /// Slot limit of the current device, from its largest shader storage block.
    static int largest_page();

    /// Frees the slots of chunks that are not in the set. Call before find() if the set may have changed.
    void follow(const ResidentSet& resident);

    /// The slot of a chunk of the last followed set; uploads the chunk if necessary. Null if the set does not contain
    /// the chunk. The slot is valid until the next follow(), page() until the next find().
    const ChunkSlot* find(const ResidentSet& resident, const Chunk& chunk);

    int page_count() const { return static_cast<int>(pages_.size()); }
    const ChunkPage& page(int index) const { return pages_[static_cast<std::size_t>(index)]; }

    /// Bytes of the used slots.
    std::size_t bytes() const;

private:
    void allocate_slot(ChunkSlot& slot);
    void upload_heights(const ChunkSlot& slot, const Chunk& chunk) const;

    int max_page_slots_;
    std::uint64_t follow_count_ = 0;
    std::map<ChunkKey, ChunkSlot> slots_;
    std::vector<ChunkPage> pages_;
};

/// A colour and an opacity, 0 to 255.
using MarkBytes = std::array<std::uint8_t, 4>;

/// Per-chunk input of terrain.vert: one instance of its attributes 1 to 3.
struct ChunkAttributes {
    std::array<std::int32_t, 4>
        corner{};  ///< lattice index minus the eye's: x high, low, y high, low
    std::array<std::int32_t, 2> stride{};  ///< finest spacings between samples: high, low part
    std::int32_t first_vertex = 0;         ///< gl_VertexID of sample 0
    std::int32_t first_offset = -1;        ///< of sample 0 in the block of offsets; -1: no offsets
    MarkBytes mark{};                      ///< colour drawn over the chunk
};
static_assert(sizeof(ChunkAttributes) == 36);

/// Which chunks of a mesh are submitted.
enum class GroundCulling : std::uint8_t {
    view,  ///< only chunks in view, which suffice for pictures of triangles
    none,  ///< all chunks: the pixel-wide lines of a chunk out of view can reach into the picture
};

/// Which triangles of a chunk are submitted as shadow casters: those that face away from the sun would do, because the
/// sun's rays leave the solid ground through one of them before they reach ground in shadow.
enum class GroundCasters : std::uint8_t {
    all,    ///< for devices that cull faces themselves
    backs,  ///< for software rasterisers, which spend more on a triangle's vertices than the selection on all of it
};

/// Whether the eye is above all triangles of a mesh whose bounding rectangles have the eye's x and y, of which there
/// must be some. Every ray from the eye then meets the front of a triangle before the back of any: the ground is a
/// function of x and y where no volume opens it. Cost: reads the triangles of the eye's chunk
bool is_above_ground(const TerrainMesh& mesh, const WorldPos& eye_world);

/// Uploads and draws a mesh, with one multi-draw command for all chunks of a page. A mesh on the device is drawn whole
/// by one command, with programs that define FROM_DEVICE.
///
/// Heights stay in a ChunkPool; indices, offsets and chunk attributes are streamed. Chunks are drawn from the finest
/// level to the coarsest, about from near to far.
class GroundDraws {
public:
    /// @param max_page_slots see ChunkPool
    explicit GroundDraws(int max_page_slots = ChunkPool::largest_page());

    /// Sets the marks of the following prepare(); null: all are transparent.
    void set_marks(std::function<MarkBytes(const MeshChunk&)> mark_of) {
        mark_of_ = std::move(mark_of);
    }

    /// Uploads a mesh for draw(), which must not be called after a failure. Chunks whose box (from their square,
    /// heights and offsets) is out of view are omitted.
    ///
    /// @param cascades shadow maps; each gets a list of the chunks that can cast into it
    /// @param casters  which of their triangles
    ///
    /// Fails with invalid_argument if the mesh draws a chunk that is not in its resident set, device_unavailable if the
    /// device is out of memory.
    Result<void> prepare(const TerrainMesh& mesh, const View& view, const EyeFrame& eye,
                         GroundCulling culling = GroundCulling::view,
                         std::span<const SunCascade> cascades = {},
                         GroundCasters casters = GroundCasters::all);

    /// Draws the chunks in view with the current program. Binds the offsets to storage block 0.
    void draw() const { draw_list(0); }
    /// Draws the shadow casters of a map of prepare().
    void draw_casters(std::size_t cascade) const { draw_list(1 + cascade); }

    /// Call after the last draw() of a frame.
    void finish();

    const ChunkPool& pool() const { return pool_; }
    std::size_t batch_count() const { return lists_.empty() ? 0 : lists_[0].batches.size(); }
    /// Chunks that draw() draws.
    std::size_t drawn_count() const { return drawn_count_; }
    std::size_t culled_count() const { return culled_count_; }

private:
    // Bit i: the chunk is in list i. List 0 is for the view, list 1 + i for cascade i.
    using Lists = std::uint8_t;
    // A chunk of the mesh with its slot. Its shadow casters are caster_count indices from first_caster on; indices of
    // the mesh come first, and back_indices_ follow.
    struct ChunkDraw {
        const MeshChunk* mesh = nullptr;
        const ChunkSlot* slot = nullptr;
        Lists lists = 0;
        std::uint32_t first_caster = 0, caster_count = 0;
    };
    // Consecutive commands of one page.
    struct Batch {
        int page = 0;
        GLsizei command_count = 0;
        std::size_t first_command_byte = 0;
        std::size_t first_offset_byte = 0, offset_bytes = 0;
    };
    struct List {
        std::size_t command_count = 0;
        std::vector<Batch> batches;
    };
    // Offsets in the stream buffer.
    struct Layout {
        std::size_t commands = 0, attributes = 0, offsets = 0, end = 0;
    };

    Result<void> collect(const TerrainMesh& mesh, const View& view, GroundCulling culling,
                         std::span<const SunCascade> cascades, GroundCasters casters);
    Layout lay_out(const TerrainMesh& mesh) const;
    void write(const TerrainMesh& mesh, const EyeFrame& eye, std::byte* memory);
    void draw_list(std::size_t list) const;
    void draw_device() const;
    void upload_device_marks(const ResidentSet& resident);

    ChunkPool pool_;
    StreamBuffer stream_;
    GlVertexArray vertices_, device_vertices_;
    GlBuffer device_marks_;
    std::weak_ptr<const ResidentSet> followed_;
    std::size_t drawn_count_ = 0, culled_count_ = 0;
    const DeviceMesh* device_ = nullptr;       // of the prepared mesh; null: it has chunks
    std::vector<ChunkDraw> draws_;             // chunks in at least one list
    std::vector<std::uint16_t> back_indices_;  // of triangles that face away from the sun
    std::vector<List> lists_;
    Layout layout_;
    std::function<MarkBytes(const MeshChunk&)> mark_of_;
};

}  // namespace terrane::internal
