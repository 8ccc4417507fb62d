// SPDX-License-Identifier: MIT
#include "terrain/ground_draws.h"

#include "gl/gl_object.h"
#include "triangulation/device_mesh.h"

#include <terrane/base/result.h>
#include <terrane/scene/culling.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

namespace terrane::internal {
namespace {

constexpr GLsizeiptr kHeightBytes = GLsizeiptr{sizeof(std::int32_t)} * kSlotSamples;
constexpr int kFirstPageSlots = 32;      // 2.1 MB
constexpr int kLargestPageSlots = 1024;  // 68 MB
// Padding after the last slot: an invalid 16-bit index still reads inside the buffer.
constexpr GLsizeiptr kSpareBytes = GLsizeiptr{sizeof(std::int32_t)} * (65536 - kSlotSamples);

bool is_same(const std::weak_ptr<const Chunk>& chunk, const std::shared_ptr<const Chunk>& now) {
    return !chunk.owner_before(now) && !now.owner_before(chunk);
}

ChunkPage make_page(int capacity) {
    ChunkPage page;
    page.capacity = capacity;
    page.heights = make_buffer();
    glNamedBufferStorage(page.heights.name(), capacity * kHeightBytes + kSpareBytes, nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    for (int slot = capacity; slot-- > 0;) page.free.push_back(slot);
    return page;
}

// A copy of a full page with additional slots.
ChunkPage grow(const ChunkPage& old, int capacity) {
    ChunkPage page = make_page(capacity);
    glCopyNamedBufferSubData(old.heights.name(), page.heights.name(), 0, 0,
                             old.capacity * kHeightBytes);
    page.free.resize(static_cast<std::size_t>(capacity - old.capacity));
    return page;
}

}  // namespace

int ChunkPool::largest_page() {
    GLint block_bytes = 0;
    glGetIntegerv(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block_bytes);
    // offsets of all chunks of a page must fit into one storage block
    const auto blocks = static_cast<int>(block_bytes / kHeightBytes);
    return std::clamp(blocks, 1, kLargestPageSlots);
}

void ChunkPool::follow(const ResidentSet& resident) {
    ++follow_count_;
    for (auto entry = slots_.begin(); entry != slots_.end();) {
        const std::int32_t index = resident.find(entry->first);
        if (index != ResidentSet::kNone &&
            is_same(entry->second.chunk, resident.chunks()[static_cast<std::size_t>(index)])) {
            ++entry;
            continue;
        }
        pages_[static_cast<std::size_t>(entry->second.page)].free.push_back(entry->second.slot);
        entry = slots_.erase(entry);
    }
    while (!pages_.empty() &&
           pages_.back().free.size() == static_cast<std::size_t>(pages_.back().capacity)) {
        pages_.pop_back();
    }
}

const ChunkSlot* ChunkPool::find(const ResidentSet& resident, const Chunk& chunk) {
    const auto entry = slots_.find(chunk.key);
    if (entry != slots_.end() && entry->second.checked == follow_count_ &&
        entry->second.chunk.lock().get() == &chunk) {
        return &entry->second;
    }
    const std::int32_t index = resident.find(chunk.key);
    if (index == ResidentSet::kNone) return nullptr;
    const std::shared_ptr<const Chunk>& owner = resident.chunks()[static_cast<std::size_t>(index)];
    if (owner.get() != &chunk) return nullptr;

    ChunkSlot& slot = slots_[chunk.key];
    const bool is_new = slot.page < 0 || !is_same(slot.chunk, owner);
    if (slot.page < 0) allocate_slot(slot);
    if (is_new) {
        slot.chunk = owner;
        upload_heights(slot, chunk);
    }
    slot.checked = follow_count_;
    return &slot;
}

// Takes a free slot of the first page that has one, else grows the last page, else adds a page.
void ChunkPool::allocate_slot(ChunkSlot& slot) {
    auto page = std::find_if(pages_.begin(), pages_.end(),
                             [](const ChunkPage& p) { return !p.free.empty(); });
    if (page == pages_.end()) {
        if (!pages_.empty() && pages_.back().capacity < max_page_slots_) {
            pages_.back() =
                grow(pages_.back(), std::min(2 * pages_.back().capacity, max_page_slots_));
        } else {
            pages_.push_back(make_page(std::min(kFirstPageSlots, max_page_slots_)));
        }
        page = std::prev(pages_.end());
    }
    slot.page = static_cast<int>(page - pages_.begin());
    slot.slot = page->free.back();
    page->free.pop_back();
}

void ChunkPool::upload_heights(const ChunkSlot& slot, const Chunk& chunk) const {
    glNamedBufferSubData(page(slot.page).heights.name(), slot.slot * kHeightBytes, kHeightBytes,
                         chunk.heights.data());
}

std::size_t ChunkPool::bytes() const {
    return slots_.size() * static_cast<std::size_t>(kHeightBytes);
}

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

// Enlargement of boxes for the rounding of positions to float on the device, relative to the distance from the eye.
constexpr double kViewMargin = 1e-5;

// The volumes against which chunks are culled.
struct Culling {
    const ViewVolume* view = nullptr;  // null: list 0 has all chunks
    WorldPos eye_world;
    std::span<const SunCascade> cascades;
};

// The lists whose volumes a box meets.
std::uint8_t lists_of(const Aabb& box, const Culling& culling) {
    unsigned lists = culling.view == nullptr || culling.view->meets(box) ? 1 : 0;
    for (std::size_t i = 0; i < culling.cascades.size(); ++i) {
        if (culling.cascades[i].meets(box)) lists |= 2u << i;
    }
    return static_cast<std::uint8_t>(lists);
}

// Box of a chunk between two heights, enlarged by the margin.
Aabb box_of(const Lattice& lattice, const Chunk& chunk, double low, double high,
            const WorldPos& eye_world) {
    const std::int64_t side = kChunkCells * chunk.step;
    const Aabb box = {{lattice.x(chunk.corner.x), lattice.y(chunk.corner.y), low},
                      {lattice.x(chunk.corner.x + side), lattice.y(chunk.corner.y + side), high}};
    const double distance = (box.low - eye_world).norm() + (box.high - eye_world).norm();
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kViewMargin * distance);
    return {box.low - margin, box.high + margin};
}

// The lists whose volumes the chunk's triangles may meet. Offsets are read only if the samples alone do not meet all
// volumes.
std::uint8_t lists_of(const TerrainMesh& mesh, const MeshChunk& chunk, const Culling& culling) {
    const Lattice& lattice = mesh.resident->lattice();
    const double low = lattice.quantum * static_cast<double>(chunk.chunk->low);
    const double high = lattice.quantum * static_cast<double>(chunk.chunk->high);
    const std::uint8_t lists =
        lists_of(box_of(lattice, *chunk.chunk, low, high, culling.eye_world), culling);
    if (chunk.offsets == nullptr || lists == (2u << culling.cascades.size()) - 1) return lists;
    float least = 0.0f, most = 0.0f;
    for (const std::uint16_t sample : mesh.indices.subspan(chunk.first_index, chunk.index_count)) {
        least = std::min(least, chunk.offsets[sample]);
        most = std::max(most, chunk.offsets[sample]);
    }
    return lists_of(box_of(lattice, *chunk.chunk, low + static_cast<double>(least),
                           high + static_cast<double>(most), culling.eye_world),
                    culling);
}

// Appends the triangles of a chunk that face away from the sun.
//
// sun: unit, towards the sun
void append_backs(const TerrainMesh& mesh, const MeshChunk& drawn, const Eigen::Vector3d& sun,
                  std::vector<std::uint16_t>& indices_out) {
    const Chunk& chunk = *drawn.chunk;
    const Lattice& lattice = mesh.resident->lattice();
    const double step = lattice.spacing * static_cast<double>(chunk.step);
    const auto height = [&](std::uint16_t sample) {
        const double offset =
            drawn.offsets == nullptr ? 0.0 : static_cast<double>(drawn.offsets[sample]);
        return lattice.quantum * chunk.heights[sample] + offset;
    };
    const auto indices = mesh.indices.subspan(drawn.first_index, drawn.index_count);
    for (std::size_t i = 0; i < indices.size(); i += 3) {
        const std::uint16_t a = indices[i], b = indices[i + 1], c = indices[i + 2];
        // edges from a: x and y in steps, z in metres
        const int bx = b % kChunkSamples - a % kChunkSamples;
        const int by = b / kChunkSamples - a / kChunkSamples;
        const int cx = c % kChunkSamples - a % kChunkSamples;
        const int cy = c / kChunkSamples - a / kChunkSamples;
        const double bz = height(b) - height(a), cz = height(c) - height(a);
        const double facing = (by * cz - cy * bz) * sun.x() + (cx * bz - bx * cz) * sun.y() +
                              (bx * cy - by * cx) * step * sun.z();
        if (facing < 0.0) indices_out.insert(indices_out.end(), {a, b, c});
    }
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
    glEnableVertexArrayAttrib(name, 3);
    glVertexArrayAttribFormat(name, 3, 4, GL_UNSIGNED_BYTE, GL_TRUE, 32);
    glVertexArrayAttribBinding(name, 3, 1);
    glVertexArrayBindingDivisor(name, 1, 1);
    return layout;
}

}  // namespace

GroundDraws::GroundDraws(int max_page_slots)
    : pool_(max_page_slots), vertices_(make_layout()), device_vertices_(make_vertex_array()) {}

// Collects the draws of the mesh that are in view or cast shadows, nearest first, and uploads new chunks.
Result<void> GroundDraws::collect(const TerrainMesh& mesh, const View& view, GroundCulling culling,
                                  std::span<const SunCascade> cascades, GroundCasters casters) {
    draws_.clear();
    back_indices_.clear();
    drawn_count_ = culled_count_ = 0;
    if (mesh.resident == nullptr) return {};
    if (followed_.lock() != mesh.resident) {
        pool_.follow(*mesh.resident);
        followed_ = mesh.resident;
    }
    const ViewVolume volume(view);
    const Culling against = {culling == GroundCulling::view ? &volume : nullptr, view.eye_world,
                             cascades};
    // the mesh is ordered from coarse to fine; near ground is drawn first for early depth rejection
    for (std::size_t i = mesh.chunks.size(); i-- > 0;) {
        const MeshChunk& chunk = mesh.chunks[i];
        if (chunk.index_count == 0) continue;
        ChunkDraw draw = {.mesh = &chunk,
                          .lists = lists_of(mesh, chunk, against),
                          .first_caster = chunk.first_index,
                          .caster_count = chunk.index_count};
        ++((draw.lists & 1) != 0 ? drawn_count_ : culled_count_);
        if (casters == GroundCasters::backs && (draw.lists & ~1) != 0) {
            const std::size_t first = back_indices_.size();
            append_backs(mesh, chunk, cascades[0].axes.row(2), back_indices_);
            draw.first_caster = static_cast<std::uint32_t>(mesh.indices.size() + first);
            draw.caster_count = static_cast<std::uint32_t>(back_indices_.size() - first);
            if (draw.caster_count == 0) draw.lists &= 1;
        }
        if (draw.lists == 0) continue;
        const ChunkSlot* slot = pool_.find(*mesh.resident, *chunk.chunk);
        if (slot == nullptr) {
            return fail(ErrorCode::invalid_argument,
                        "the mesh draws a chunk that is not in its resident set");
        }
        draw.slot = slot;
        draws_.push_back(draw);
    }
    return {};
}

GroundDraws::Layout GroundDraws::lay_out(const TerrainMesh& mesh) const {
    std::size_t offset_count = 0;
    for (const ChunkDraw& draw : draws_) offset_count += draw.mesh->offsets != nullptr ? 1 : 0;
    // indices come first, so that the first_index of the mesh is valid in the buffer
    Layout layout;
    layout.commands =
        align(mesh.indices.size_bytes() + sizeof(std::uint16_t) * back_indices_.size());
    layout.attributes =
        align(layout.commands + sizeof(DrawCommand) * lists_.size() * draws_.size());
    layout.offsets = align(layout.attributes + sizeof(ChunkAttributes) * draws_.size());
    // each batch starts at an aligned byte; a batch without offsets binds one float
    layout.end = layout.offsets + kOffsetBytes * offset_count + kAlignment * (draws_.size() + 1);
    return layout;
}

void GroundDraws::write(const TerrainMesh& mesh, const EyeFrame& eye, std::byte* memory) {
    std::memcpy(memory, mesh.indices.data(), mesh.indices.size_bytes());
    if (!back_indices_.empty()) {
        std::memcpy(memory + mesh.indices.size_bytes(), back_indices_.data(),
                    sizeof(std::uint16_t) * back_indices_.size());
    }
    // chunks of one page share a range of offsets, whichever lists they are in
    std::size_t offset_byte = layout_.offsets, first_offset_byte = 0;
    for (std::size_t i = 0; i < draws_.size(); ++i) {
        const MeshChunk& chunk = *draws_[i].mesh;
        const ChunkSlot& slot = *draws_[i].slot;
        if (i == 0 || draws_[i - 1].slot->page != slot.page) {
            offset_byte = first_offset_byte = align(offset_byte);
        }
        ChunkAttributes attributes = make_attributes(*chunk.chunk, slot, eye);
        if (mark_of_) attributes.mark = mark_of_(chunk);
        if (chunk.offsets != nullptr) {
            attributes.first_offset =
                static_cast<std::int32_t>((offset_byte - first_offset_byte) / sizeof(float));
            std::memcpy(memory + offset_byte, chunk.offsets, kOffsetBytes);
            offset_byte += kOffsetBytes;
        }
        for (std::size_t number = 0; number < lists_.size(); ++number) {
            if ((draws_[i].lists >> number & 1) == 0) continue;
            const bool is_view = number == 0;
            const DrawCommand command{is_view ? chunk.index_count : draws_[i].caster_count, 1,
                                      is_view ? chunk.first_index : draws_[i].first_caster,
                                      attributes.first_vertex, static_cast<std::uint32_t>(i)};
            List& list = lists_[number];
            const std::size_t command_byte =
                layout_.commands +
                sizeof(command) * (number * draws_.size() + list.command_count++);
            if (list.batches.empty() ||
                list.batches.back().first_offset_byte != first_offset_byte ||
                list.batches.back().page != slot.page) {
                list.batches.push_back(
                    {slot.page, 0, command_byte, first_offset_byte, sizeof(float)});
            }
            Batch& batch = list.batches.back();
            ++batch.command_count;
            batch.offset_bytes = std::max(sizeof(float), offset_byte - first_offset_byte);
            std::memcpy(memory + command_byte, &command, sizeof(command));
        }
        std::memcpy(memory + layout_.attributes + sizeof(attributes) * i, &attributes,
                    sizeof(attributes));
    }
}

bool is_above_ground(const TerrainMesh& mesh, const WorldPos& eye_world) {
    bool has_ground = false;
    for (const MeshChunk& drawn : mesh.chunks) {
        const Chunk& chunk = *drawn.chunk;
        const Lattice& lattice = mesh.resident->lattice();
        const double step = lattice.spacing * static_cast<double>(chunk.step);
        const double x = (eye_world.x() - lattice.x(chunk.corner.x)) / step;
        const double y = (eye_world.y() - lattice.y(chunk.corner.y)) / step;
        if (!(x >= 0.0 && x <= kChunkCells && y >= 0.0 && y <= kChunkCells)) continue;
        for (std::uint32_t i = 0; i < drawn.index_count; i += 3) {
            double west = kChunkCells, east = 0.0, south = kChunkCells, north = 0.0;
            double highest = -std::numeric_limits<double>::infinity();
            for (std::uint32_t corner = 0; corner < 3; ++corner) {
                const std::uint16_t sample = mesh.indices[drawn.first_index + i + corner];
                const int at_x = sample % kChunkSamples, at_y = sample / kChunkSamples;
                const double column = at_x, row = at_y;
                west = std::min(west, column);
                east = std::max(east, column);
                south = std::min(south, row);
                north = std::max(north, row);
                const double offset =
                    drawn.offsets == nullptr ? 0.0 : static_cast<double>(drawn.offsets[sample]);
                highest = std::max(highest, lattice.quantum * chunk.heights[sample] + offset);
            }
            if (x < west || x > east || y < south || y > north) continue;
            has_ground = true;
            if (!(eye_world.z() > highest)) return false;
        }
    }
    return has_ground;
}

Result<void> GroundDraws::prepare(const TerrainMesh& mesh, const View& view, const EyeFrame& eye,
                                  GroundCulling culling, std::span<const SunCascade> cascades,
                                  GroundCasters casters) {
    TERRANE_ASSERT(cascades.size() < 8, "a list for the view and one for each cascade");
    lists_.resize(1 + cascades.size());
    for (List& list : lists_) {
        list.command_count = 0;
        list.batches.clear();
    }
    device_ = mesh.device;
    if (device_ != nullptr && mark_of_) upload_device_marks(*mesh.resident);
    TERRANE_TRY(collect(mesh, view, culling, cascades, casters));
    if (draws_.empty()) return {};
    layout_ = lay_out(mesh);
    std::byte* memory = stream_.begin(layout_.end);
    if (memory == nullptr) {
        const std::string doing =
            "take " + std::to_string(layout_.end) + " bytes of the device for the mesh";
        TERRANE_TRY(check_gl(doing));
        return fail(ErrorCode::device_unavailable, "OpenGL cannot " + doing);
    }
    write(mesh, eye, memory);
    return {};
}

// Marks of all resident chunks, as unpackUnorm4x8() of terrain.vert reads them.
void GroundDraws::upload_device_marks(const ResidentSet& resident) {
    std::vector<MarkBytes> marks;
    for (const ResidentChunk& chunk : resident.chunks())
        marks.push_back(mark_of_(MeshChunk{.chunk = chunk.get()}));
    device_marks_ = make_buffer();
    glNamedBufferStorage(device_marks_.name(),
                         static_cast<GLsizeiptr>(marks.size() * sizeof(MarkBytes)), marks.data(),
                         0);
}

void GroundDraws::draw_device() const {
    const DeviceMesh& mesh = *device_;
    glBindVertexArray(device_vertices_.name());
    glVertexArrayElementBuffer(device_vertices_.name(), mesh.indices);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, mesh.commands);
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, 0, mesh.places,
                      static_cast<GLintptr>(mesh.places_byte),
                      static_cast<GLsizeiptr>(mesh.places_bytes));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, mesh.offsets);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, mesh.heights);
    if (mark_of_) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, device_marks_.name());
    glUniform4ui(0, mesh.first_root_place, mesh.first_root_offset, mesh.morphs ? 1 : 0, 0);
    // OpenGL passes the offset in the command buffer as a pointer
    glDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT,
                           reinterpret_cast<const void*>(mesh.command_byte));
}

void GroundDraws::draw_list(std::size_t list) const {
    if (device_ != nullptr) {
        draw_device();
        return;
    }
    const std::vector<Batch>& batches = lists_[list].batches;
    if (batches.empty()) return;
    glBindVertexArray(vertices_.name());
    glVertexArrayElementBuffer(vertices_.name(), stream_.name());
    glVertexArrayVertexBuffer(vertices_.name(), 1, stream_.name(),
                              static_cast<GLintptr>(layout_.attributes), sizeof(ChunkAttributes));
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, stream_.name());
    for (const Batch& batch : batches) {
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
    if (!draws_.empty()) stream_.end();
}

}  // namespace terrane::internal
