// SPDX-License-Identifier: MIT
#include "triangulation/device_chunks.h"

#include "chunk/chunk_vertices.h"

#include <bit>
#include <cstring>
#include <string>

namespace terrane::internal {
namespace {

// Layouts of lod.glsl
constexpr std::size_t kTableWords = 12;
constexpr std::size_t kAreaCount = std::size_t{kChunkAreas} * kChunkAreas;
constexpr std::size_t kAreaWords = sizeof(AreaVertices) / 4;
constexpr std::size_t kBoundsWord = kAreaCount * kAreaWords, kReachesWord = kBoundsWord + 64;
constexpr std::size_t kSideWords = 96;
constexpr std::size_t kEastWord = kReachesWord + 64, kNorthWord = kEastWord + kSideWords;
constexpr std::size_t kHeaderWord = kNorthWord + kSideWords;
constexpr std::size_t kAreaHeightsWord = kHeaderWord + 16;
constexpr std::size_t kCellBoundsWord = kAreaHeightsWord + 128, kSlotWords = kCellBoundsWord + 64;
static_assert(kAreaWords == 400 && kHeaderWord == 25920 && kSlotWords == 26128);
static_assert(sizeof(SideVertices) == 4 * kSideWords);
constexpr std::size_t kHeightWords =
    DeviceChunks::kSamples + std::size_t{kChunkCells} * kChunkCells;

std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }

}  // namespace

Result<void> DeviceChunks::follow(std::shared_ptr<const ResidentSet> resident) {
    if (resident_ != nullptr && resident_->has_same_chunks(*resident)) {
        resident_ = std::move(resident);
        return {};
    }
    // the chunks of the set before live until here, so that equal pointers mean equal chunks
    const std::span<const ResidentChunk> all = resident->chunks();
    std::unordered_map<const Chunk*, std::uint32_t> kept;
    slot_of_.assign(all.size(), kNone);
    root_count_ = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (all[i]->key.level == 0) ++root_count_;
        const auto found = slots_.find(all[i].get());
        if (found == slots_.end()) continue;
        slot_of_[i] = found->second;
        kept.insert(*found);
        slots_.erase(found);
    }
    for (const auto& [chunk, slot] : slots_) free_slots_.push_back(slot);
    slots_ = std::move(kept);
    // the chunks whose bounds are there may be gone, and their addresses used anew
    std::vector<const Chunk*> roots(with_bounds_.size(), nullptr);
    for (std::size_t i = 0; i < std::min(root_count_, roots.size()); ++i)
        if (all[i].get() == with_bounds_[i]) roots[i] = with_bounds_[i];
    with_bounds_ = std::move(roots);
    resident_ = std::move(resident);
    const Result<void> uploaded = upload_links();
    if (!uploaded) resident_ = nullptr;  // the next set is another
    return uploaded;
}

// Uploads the links of all resident chunks.
Result<void> DeviceChunks::upload_links() {
    const std::span<const ResidentChunk> all = resident_->chunks();
    std::vector<std::uint32_t> words(kTableWords * all.size());
    level_first_.fill(static_cast<std::uint32_t>(all.size()));
    for (std::size_t i = all.size(); i-- > 0;)
        level_first_[all[i]->key.level] = static_cast<std::uint32_t>(i);
    for (std::size_t i = 0; i < all.size(); ++i) {
        const ChunkKey& key = all[i]->key;
        const ResidentSet::Links& links = resident_->links(i);
        std::uint32_t* const to = &words[kTableWords * i];
        to[0] = key.level | static_cast<std::uint32_t>(key.x & 1) << 5 |
                static_cast<std::uint32_t>(key.y & 1) << 6;
        const std::array<ChunkKey, 4> beyond{
            ChunkKey{key.x - 1, key.y, key.level}, ChunkKey{key.x + 1, key.y, key.level},
            ChunkKey{key.x, key.y - 1, key.level}, ChunkKey{key.x, key.y + 1, key.level}};
        for (std::size_t side = 0; side < 4; ++side) {
            if (!resident_->window().contains(beyond[side])) to[0] |= 1u << (7 + side);
            to[2 + side] = static_cast<std::uint32_t>(links.neighbour[side]);
            to[6 + side] = static_cast<std::uint32_t>(links.child[side]);
        }
        if (key.level == 0 && cut_to_north_east(key.x, key.y)) to[0] |= 1u << 11;
        to[1] = static_cast<std::uint32_t>(links.parent);
    }
    const std::size_t bytes = 4 * words.size();
    TERRANE_TRY(table_.reserve(bytes, false));
    table_.write(0, words.data(), bytes);
    return {};
}

// Uploads the bounds of the coarser vertices of roots that have none on the device.
void DeviceChunks::upload_coarse_bounds() {
    with_bounds_.resize(root_count_, nullptr);
    for (std::size_t root = 0; root < root_count_; ++root) {
        const Chunk* const chunk = resident_->chunks()[root].get();
        if (with_bounds_[root] == chunk) continue;
        with_bounds_[root] = chunk;
        vertices_.write(4 * kCoarse * root, chunk->vertices->coarse_bounds.data(), 4 * kCoarse);
    }
}

Result<void> DeviceChunks::load(std::span<const std::size_t> indices) {
    const std::size_t needed = slots_.size() + indices.size();
    if (needed > slot_count_) {
        const std::size_t grown = std::max(needed, slot_count_ + slot_count_ / 2);
        TERRANE_TRY(vertices_.reserve(4 * (first_slot_ + kSlotWords * grown), true));
        TERRANE_TRY(heights_.reserve(4 * kHeightWords * grown, true));
        for (std::size_t slot = grown; slot-- > slot_count_;)
            free_slots_.push_back(static_cast<std::uint32_t>(slot));
        slot_count_ = grown;
    }
    upload_coarse_bounds();
    for (const std::size_t i : indices) {
        const std::uint32_t slot = free_slots_.back();
        free_slots_.pop_back();
        const Chunk& chunk = *resident_->chunks()[i];
        upload(chunk, slot);
        slots_.emplace(&chunk, slot);
        slot_of_[i] = slot;
    }
    return {};
}

void DeviceChunks::upload(const Chunk& chunk, std::uint32_t slot) {
    const ChunkVertices& of = *chunk.vertices;
    staging_.assign(kSlotWords, 0);
    const auto put = [&](std::size_t word, const void* from, std::size_t bytes) {
        std::memcpy(&staging_[word], from, bytes);
    };
    put(0, of.areas.data(), sizeof of.areas);
    for (std::size_t i = 0; i < kAreaCount; ++i) {
        const Chunk::Area& area = chunk.areas[i];
        staging_[kBoundsWord + i] = bits_of(area.max_vertex_bound);
        staging_[kAreaHeightsWord + 2 * i] = static_cast<std::uint32_t>(area.low);
        staging_[kAreaHeightsWord + 2 * i + 1] = static_cast<std::uint32_t>(area.high);
        staging_[kCellBoundsWord + i] = bits_of(area.max_cell_bound);
    }
    put(kReachesWord, of.area_reaches.data(), sizeof of.area_reaches);
    put(kEastWord, &of.east_side, sizeof of.east_side);
    put(kNorthWord, &of.north_side, sizeof of.north_side);
    const std::array<double, 4> header{static_cast<double>(chunk.corner.x),
                                       static_cast<double>(chunk.corner.y),
                                       static_cast<double>(chunk.step), of.reach_base};
    put(kHeaderWord, header.data(), sizeof header);
    put(kHeaderWord + 8, &of.reach_unit, sizeof of.reach_unit);
    vertices_.write(4 * (first_slot_ + kSlotWords * slot), staging_.data(), 4 * kSlotWords);
    heights_.write(4 * kHeightWords * slot, chunk.heights.data(), 4 * kSamples);
    heights_.write(4 * (kHeightWords * slot + kSamples), chunk.cell_bounds.data(),
                   4 * chunk.cell_bounds.size());
}

Result<void> DeviceChunks::write_frame(std::span<const std::uint32_t> words) {
    const std::size_t links = 4 * kTableWords * resident_->chunks().size();
    TERRANE_TRY(table_.reserve(links + words.size_bytes(), true));
    table_.write(links, words.data(), words.size_bytes());
    return {};
}

}  // namespace terrane::internal
