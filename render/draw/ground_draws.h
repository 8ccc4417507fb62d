// SPDX-License-Identifier: MIT
#pragma once

#include "draw/chunk_pool.h"
#include "draw/eye_frame.h"
#include "gl/stream_buffer.h"
#include "shadow/sun_cascades.h"

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Per-chunk input of terrain.vert: one instance of its attributes 1 and 2.
struct ChunkAttributes {
    std::array<std::int32_t, 4>
        corner{};  ///< lattice index minus the eye's: x high, low, y high, low
    std::array<std::int32_t, 2> stride{};  ///< finest spacings between samples: high, low part
    std::int32_t first_vertex = 0;         ///< gl_VertexID of sample 0
    std::int32_t first_offset = -1;        ///< of sample 0 in the block of offsets; -1: no offsets
};
static_assert(sizeof(ChunkAttributes) == 32);

/// Which chunks of a mesh are submitted.
enum class GroundCulling : std::uint8_t {
    view,  ///< those that the view can show: pictures of triangles do not change
    none,  ///< all: lines are a pixel wide, and reach into the picture from chunks beyond its edge
};

/// Uploads and draws a mesh, with one multi-draw command for all chunks of a page.
///
/// Heights stay in a ChunkPool; indices, offsets and chunk attributes are streamed. Chunks are drawn from the finest
/// level to the coarsest, about from near to far.
class GroundDraws {
public:
    /// @param max_page_slots see ChunkPool
    explicit GroundDraws(int max_page_slots = ChunkPool::largest_page());

    /// Uploads a mesh for draw(), which must not be called after a failure. Chunks whose box (their square, their
    /// heights and offsets) is out of view are left out.
    ///
    /// @param casters shadow maps; a list of the chunks that can cast into it is made for each
    ///
    /// Fails with invalid_argument where the mesh draws a chunk that is not in its resident set, device_unavailable
    /// where the device is out of memory.
    Result<void> prepare(const TerrainMesh& mesh, const View& view, const EyeFrame& eye,
                         GroundCulling culling = GroundCulling::view,
                         std::span<const SunCascade> casters = {});

    /// Draws what the view shows with the current program. Binds the offsets to storage block 0.
    void draw() const { draw_list(0); }
    /// Draws the shadow casters of a map of prepare().
    void draw_casters(std::size_t caster) const { draw_list(1 + caster); }

    /// After the last draw() of a frame.
    void finish();

    const ChunkPool& pool() const { return pool_; }
    std::size_t batch_count() const { return lists_.empty() ? 0 : lists_[0].batches.size(); }
    /// Chunks that draw() draws.
    std::size_t drawn_count() const { return drawn_count_; }
    std::size_t culled_count() const { return culled_count_; }

private:
    // Bit i: list i has the chunk. List 0 is for the view, list 1 + i for caster i.
    using Lists = std::uint8_t;
    // A chunk of the mesh and its slot.
    struct ChunkDraw {
        const MeshChunk* mesh = nullptr;
        const ChunkSlot* slot = nullptr;
        Lists lists = 0;
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
                         std::span<const SunCascade> casters);
    Layout lay_out(const TerrainMesh& mesh) const;
    void write(const TerrainMesh& mesh, const EyeFrame& eye, std::byte* memory);
    void draw_list(std::size_t list) const;

    ChunkPool pool_;
    StreamBuffer stream_;
    GlVertexArray vertices_;
    std::weak_ptr<const ResidentSet> followed_;
    std::size_t drawn_count_ = 0, culled_count_ = 0;
    std::vector<ChunkDraw> draws_;  // in any list
    std::vector<List> lists_;
    Layout layout_;
};

}  // namespace terrane::internal
