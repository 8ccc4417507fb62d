// SPDX-License-Identifier: MIT
#pragma once

#include "gl/device_array.h"

#include <terrane/base/result.h>
#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Keeps vertices and samples of chunks on the device while they are resident, and the links of all resident chunks, as
/// lod.glsl reads them.
class DeviceChunks {
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;
    static constexpr std::size_t kMostRoots = 4096;
    static constexpr std::size_t kLevels = 32;  ///< at least the levels of a lattice and one
    static constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;
    static constexpr std::size_t kCoarseSide = kChunkCells / 2 + 1;
    static constexpr std::size_t kCoarse =
        kCoarseSide * kCoarseSide;  ///< vertices of coarser spacings of a root

    explicit DeviceChunks(const Lattice& lattice)
        : first_slot_(kCoarse * static_cast<std::size_t>(lattice.resident_root_count())) {}

    /// Takes over a resident set: frees the slots of chunks that have left, and uploads links if chunks have changed.
    ///
    /// Fails as DeviceArray::reserve(); then follow another set before the next call
    Result<void> follow(std::shared_ptr<const ResidentSet> resident);
    const std::shared_ptr<const ResidentSet>& resident() const { return resident_; }

    /// Uploads chunks at these indices of the set. Requires that they have no slot. Fails as DeviceArray::reserve()
    Result<void> load(std::span<const std::size_t> indices);
    /// The slot of a chunk; kNone if it is not on the device.
    std::uint32_t slot_of(std::size_t index) const { return slot_of_[index]; }
    /// Uploads words that change each frame, behind the links. Fails as DeviceArray::reserve()
    Result<void> write_frame(std::span<const std::uint32_t> words);

    std::size_t root_count() const { return root_count_; }
    /// Index of the first chunk of each level; their number where there is none.
    const std::array<std::uint32_t, kLevels>& level_first() const { return level_first_; }
    /// Word of vertices() at which the slots begin, behind the bounds of the roots' coarser vertices.
    std::size_t first_slot() const { return first_slot_; }

    const DeviceArray& table() const { return table_; }        ///< links and frame words
    const DeviceArray& vertices() const { return vertices_; }  ///< bounds, reaches, rises
    const DeviceArray& heights() const { return heights_; }    ///< samples and cell bounds
    std::size_t bytes() const { return table_.bytes() + vertices_.bytes() + heights_.bytes(); }

private:
    Result<void> upload_links();
    void upload_coarse_bounds();
    void upload(const Chunk& chunk, std::uint32_t slot);

    std::shared_ptr<const ResidentSet> resident_;
    DeviceArray table_, vertices_, heights_;
    std::unordered_map<const Chunk*, std::uint32_t> slots_;
    std::vector<std::uint32_t> free_slots_;
    std::size_t slot_count_ = 0;
    std::size_t first_slot_;
    std::vector<std::uint32_t> slot_of_;     // by index in the set
    std::vector<const Chunk*> with_bounds_;  // roots whose coarse bounds are on the device
    std::size_t root_count_ = 0;
    std::array<std::uint32_t, kLevels> level_first_{};
    std::vector<std::uint32_t> staging_;
};

}  // namespace terrane::internal
