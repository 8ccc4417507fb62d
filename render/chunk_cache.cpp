// SPDX-License-Identifier: MIT
#include "chunk_cache.h"

namespace terrane::internal {
namespace {

constexpr std::size_t kHeightBytes =
    sizeof(std::int32_t) * std::size_t{kChunkSamples} * kChunkSamples;
constexpr std::size_t kSlopeBytes =
    2 * sizeof(std::int16_t) * std::size_t{kSlopeMapWidth} * kSlopeMapHeight;

bool is_same(const std::weak_ptr<const Chunk>& held, const std::shared_ptr<const Chunk>& now) {
    return !held.owner_before(now) && !now.owner_before(held);
}

void upload_heights(DeviceChunk& device, const Chunk& chunk) {
    device.heights = make_buffer();
    glNamedBufferStorage(device.heights.name(), static_cast<GLsizeiptr>(kHeightBytes),
                         chunk.heights.data(), 0);
}

void upload_slopes(DeviceChunk& device, const ResidentSet& resident, const Chunk& chunk) {
    const std::vector<std::int16_t> map = make_slope_map(resident, chunk, device.side_levels);
    if (device.slopes.name() == 0) {
        device.slopes = make_texture_2d();
        const GLuint name = device.slopes.name();
        glTextureStorage2D(name, 1, GL_RG16_SNORM, kSlopeMapWidth, kSlopeMapHeight);
        glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTextureSubImage2D(device.slopes.name(), 0, 0, 0, kSlopeMapWidth, kSlopeMapHeight, GL_RG,
                        GL_SHORT, map.data());
}

}  // namespace

void ChunkCache::follow(const ResidentSet& resident) {
    for (auto held = chunks_.begin(); held != chunks_.end();) {
        const std::int32_t index = resident.find(held->first);
        const bool is_there =
            index != ResidentSet::kNone &&
            is_same(held->second.chunk, resident.chunks()[static_cast<std::size_t>(index)]);
        held = is_there ? std::next(held) : chunks_.erase(held);
    }
}

const DeviceChunk* ChunkCache::find(const ResidentSet& resident, const Chunk& chunk) {
    const std::int32_t index = resident.find(chunk.key);
    if (index == ResidentSet::kNone) return nullptr;
    const std::shared_ptr<const Chunk>& owner = resident.chunks()[static_cast<std::size_t>(index)];
    if (owner.get() != &chunk) return nullptr;

    const SideLevels side_levels = find_side_levels(resident, chunk.key);
    DeviceChunk& device = chunks_[chunk.key];
    const bool is_new = !is_same(device.chunk, owner) || device.heights.name() == 0;
    if (is_new) {
        device.chunk = owner;
        upload_heights(device, chunk);
    }
    if (is_new || device.side_levels != side_levels) {
        device.side_levels = side_levels;
        upload_slopes(device, resident, chunk);
    }
    return &device;
}

std::size_t ChunkCache::bytes() const { return chunks_.size() * (kHeightBytes + kSlopeBytes); }

}  // namespace terrane::internal
