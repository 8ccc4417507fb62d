// SPDX-License-Identifier: MIT
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>

namespace terrane {

Result<void> HeightSource::mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                       std::span<float> cell_bounds_out) const {
    if (auto ok = vertex_bounds(grid, vertex_bounds_out); !ok) return ok;
    return cell_bounds(grid, cell_bounds_out);
}

Result<void> HeightSource::cell_flags(const SampleGrid& /*grid*/,
                                      std::span<std::uint8_t> flags_out) const {
    std::ranges::fill(flags_out, std::uint8_t{cell_ground});
    return {};
}

Result<std::shared_ptr<const Chunk>> HeightSource::stored_chunk(
    const ChunkKey& /*key*/, const std::stop_token& /*stop*/) const {
    return std::shared_ptr<const Chunk>();
}

bool HeightSource::is_certified() const { return true; }

bool HeightSource::is_current(const Chunk& /*chunk*/) const { return true; }

std::optional<SolidExtent> HeightSource::solid_extent(const ChunkKey& /*key*/) const {
    return std::nullopt;
}

bool HeightSource::is_in_volume(double /*x*/, double /*y*/, double /*z*/) const { return false; }

std::size_t HeightSource::max_chunk_bytes(const ChunkKey& /*key*/) const {
    return Chunk::max_bytes();
}

}  // namespace terrane
