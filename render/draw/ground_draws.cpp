// SPDX-License-Identifier: MIT
#include "draw/ground_draws.h"

#include "gl/gl_error.h"

#include <terrane/scene/view_volume.h>

#include <algorithm>
#include <cstring>
#include <string>

namespace terrane::internal {
namespace {

// Layout given by OpenGL (DrawElementsIndirectCommand).
struct DrawCommand {
    std::uint32_t index_count = 0;
    std::uint32_t instance_count = 1;
    std::uint32_t first_index = 0;
    std::int32_t first_vertex = 0;
    std::uint32_t first_instance = 0;
};
static_assert(sizeof(DrawCommand) == 20);

// Upper bound of the offset alignment of storage blocks on all devices.
constexpr std::size_t kAlignment = 256;
constexpr std::size_t kOffsetBytes = sizeof(float) * std::size_t{kSlotSamples};

std::size_t align(std::size_t byte) { return (byte + kAlignment - 1) / kAlignment * kAlignment; }

ChunkAttributes make_attributes(const Chunk& chunk, const ChunkSlot& slot, const EyeFrame& eye) {
    const SplitInteger x = split(chunk.corner.x - eye.x, kIndexBits);
    const SplitInteger y = split(chunk.corner.y - eye.y, kIndexBits);
    const SplitInteger stride = split(chunk.step, kIndexBits);
    ChunkAttributes made;
    made.corner = {x.high, x.low, y.high, y.low};
    made.stride = {stride.high, stride.low};
    made.first_vertex = slot.slot * kSlotSamples;
    return made;
}

// Positions are rounded to float on the device, relative to the eye: the box is a little larger.
constexpr double kViewMargin = 1e-5;

bool is_in_view(const Lattice& lattice, const Chunk& chunk, double low, double high,
                const ViewVolume& volume) {
    const std::int64_t side = kChunkCells * chunk.step;
    Aabb box = {{lattice.x(chunk.corner.x), lattice.y(chunk.corner.y), low},
                {lattice.x(chunk.corner.x + side), lattice.y(chunk.corner.y + side), high}};
    const double distance =
        (box.low - volume.eye_world()).norm() + (box.high - volume.eye_world()).norm();
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kViewMargin * distance);
    box = {box.low - margin, box.high + margin};
    return volume.meets(box);
}

// Whether the view can show a point of the chunk's triangles. Offsets are read only where the samples are out of view.
bool is_in_view(const TerrainMesh& mesh, const MeshChunk& chunk, const ViewVolume& volume) {
    const Lattice& lattice = mesh.resident->lattice();
    const double low = lattice.quantum * static_cast<double>(chunk.chunk->low);
    const double high = lattice.quantum * static_cast<double>(chunk.chunk->high);
    if (is_in_view(lattice, *chunk.chunk, low, high, volume)) return true;
    if (chunk.offsets == nullptr) return false;
    float least = 0.0f, most = 0.0f;
    for (const std::uint16_t sample : mesh.indices.subspan(chunk.first_index, chunk.index_count)) {
        least = std::min(least, chunk.offsets[sample]);
        most = std::max(most, chunk.offsets[sample]);
    }
    return is_in_view(lattice, *chunk.chunk, low + static_cast<double>(least),
                      high + static_cast<double>(most), volume);
}

GlVertexArray make_layout() {
    GlVertexArray layout = make_vertex_array();
    const GLuint name = layout.name();
    glEnableVertexArrayAttrib(name, 0);
    glVertexArrayAttribIFormat(name, 0, 1, GL_INT, 0);
    glVertexArrayAttribBinding(name, 0, 0);
    for (GLuint attribute = 1; attribute <= 2; ++attribute) {
        glEnableVertexArrayAttrib(name, attribute);
        glVertexArrayAttribIFormat(name, attribute, 4, GL_INT, 16 * (attribute - 1));
        glVertexArrayAttribBinding(name, attribute, 1);
    }
    glVertexArrayBindingDivisor(name, 1, 1);
    return layout;
}

}  // namespace

GroundDraws::GroundDraws(int max_page_slots) : pool_(max_page_slots), vertices_(make_layout()) {}

// Collects the draws of the mesh that are in view, nearest first, and uploads new chunks.
Result<void> GroundDraws::collect(const TerrainMesh& mesh, const View& view,
                                  GroundCulling culling) {
    draws_.clear();
    culled_count_ = 0;
    if (mesh.resident == nullptr) return {};
    if (followed_.lock() != mesh.resident) {
        pool_.follow(*mesh.resident);
        followed_ = mesh.resident;
    }
    const ViewVolume volume(view);
    // the mesh is ordered from coarse to fine; near ground is drawn first for early depth rejection
    for (std::size_t i = mesh.chunks.size(); i-- > 0;) {
        const MeshChunk& chunk = mesh.chunks[i];
        if (chunk.index_count == 0) continue;
        if (culling == GroundCulling::view && !is_in_view(mesh, chunk, volume)) {
            ++culled_count_;
            continue;
        }
        const ChunkSlot* slot = pool_.find(*mesh.resident, *chunk.chunk);
        if (slot == nullptr) {
            return fail(ErrorCode::invalid_argument,
                        "the mesh draws a chunk that is not in its resident set");
        }
        draws_.push_back({&chunk, slot});
    }
    return {};
}

GroundDraws::Layout GroundDraws::lay_out(const TerrainMesh& mesh) const {
    std::size_t offset_count = 0;
    for (const ChunkDraw& draw : draws_) offset_count += draw.mesh->offsets != nullptr ? 1 : 0;
    // indices come first, so that the first_index of the mesh is valid in the buffer
    Layout layout;
    layout.commands = align(mesh.indices.size_bytes());
    layout.attributes = align(layout.commands + sizeof(DrawCommand) * draws_.size());
    layout.offsets = align(layout.attributes + sizeof(ChunkAttributes) * draws_.size());
    // each batch starts at an aligned byte; a batch without offsets binds one float
    layout.end = layout.offsets + kOffsetBytes * offset_count + kAlignment * (draws_.size() + 1);
    return layout;
}

void GroundDraws::write(const TerrainMesh& mesh, const EyeFrame& eye, std::byte* memory) {
    std::memcpy(memory, mesh.indices.data(), mesh.indices.size_bytes());
    batches_.clear();
    std::size_t offset_byte = layout_.offsets;
    for (std::size_t i = 0; i < draws_.size(); ++i) {
        const MeshChunk& chunk = *draws_[i].mesh;
        const ChunkSlot& slot = *draws_[i].slot;
        if (batches_.empty() || batches_.back().page != slot.page) {
            offset_byte = align(offset_byte);
            batches_.push_back({slot.page, 0, layout_.commands + sizeof(DrawCommand) * i,
                                offset_byte, sizeof(float)});
        }
        Batch& batch = batches_.back();
        ++batch.command_count;

        ChunkAttributes attributes = make_attributes(*chunk.chunk, slot, eye);
        if (chunk.offsets != nullptr) {
            attributes.first_offset =
                static_cast<std::int32_t>((offset_byte - batch.first_offset_byte) / sizeof(float));
            std::memcpy(memory + offset_byte, chunk.offsets, kOffsetBytes);
            offset_byte += kOffsetBytes;
            batch.offset_bytes = offset_byte - batch.first_offset_byte;
        }
        const DrawCommand command{chunk.index_count, 1, chunk.first_index, attributes.first_vertex,
                                  static_cast<std::uint32_t>(i)};
        std::memcpy(memory + layout_.commands + sizeof(command) * i, &command, sizeof(command));
        std::memcpy(memory + layout_.attributes + sizeof(attributes) * i, &attributes,
                    sizeof(attributes));
    }
}

Result<void> GroundDraws::prepare(const TerrainMesh& mesh, const View& view, const EyeFrame& eye,
                                  GroundCulling culling) {
    if (const Result<void> collected = collect(mesh, view, culling); !collected) return collected;
    batches_.clear();
    if (draws_.empty()) return {};
    layout_ = lay_out(mesh);
    std::byte* memory = stream_.begin(layout_.end);
    if (memory == nullptr) {
        const std::string doing =
            "take " + std::to_string(layout_.end) + " bytes of the device for the mesh";
        if (const Result<void> good = check_gl(doing); !good) return good;
        return fail(ErrorCode::device_unavailable, "OpenGL cannot " + doing);
    }
    write(mesh, eye, memory);
    return {};
}

void GroundDraws::draw() const {
    if (batches_.empty()) return;
    glBindVertexArray(vertices_.name());
    glVertexArrayElementBuffer(vertices_.name(), stream_.name());
    glVertexArrayVertexBuffer(vertices_.name(), 1, stream_.name(),
                              static_cast<GLintptr>(layout_.attributes), sizeof(ChunkAttributes));
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, stream_.name());
    for (const Batch& batch : batches_) {
        const ChunkPage& page = pool_.page(batch.page);
        glVertexArrayVertexBuffer(vertices_.name(), 0, page.heights.name(), 0,
                                  sizeof(std::int32_t));
        glBindBufferRange(GL_SHADER_STORAGE_BUFFER, 0, stream_.name(),
                          static_cast<GLintptr>(batch.first_offset_byte),
                          static_cast<GLsizeiptr>(batch.offset_bytes));
        // OpenGL passes the offset in the command buffer as a pointer
        glMultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_SHORT,
                                    reinterpret_cast<const void*>(batch.first_command_byte),
                                    batch.command_count, 0);
    }
}

void GroundDraws::finish() {
    if (!batches_.empty()) stream_.end();
}

}  // namespace terrane::internal
