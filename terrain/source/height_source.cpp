// SPDX-License-Identifier: MIT
#include <terrane/base/text.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace terrane {

Result<void> HeightSource::mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                       std::span<float> cell_bounds_out) const {
    TERRANE_TRY(vertex_bounds(grid, vertex_bounds_out));
    return cell_bounds(grid, cell_bounds_out);
}

Result<void> HeightSource::cell_flags(const SampleGrid& /*grid*/,
                                      std::span<std::uint8_t> flags_out) const {
    std::ranges::fill(flags_out, std::uint8_t{cell_ground});
    return {};
}

bool HeightSource::is_certified() const { return true; }

Result<std::shared_ptr<const Chunk>> ChunkSource::stored_chunk(
    const ChunkKey& /*key*/, const std::stop_token& /*stop*/) const {
    return std::shared_ptr<const Chunk>();
}

bool ChunkSource::is_current(const Chunk& /*chunk*/) const { return true; }

std::optional<SolidExtent> ChunkSource::solid_extent(const ChunkKey& /*key*/) const {
    return std::nullopt;
}

bool ChunkSource::is_in_volume(double /*x*/, double /*y*/, double /*z*/) const { return false; }

std::size_t ChunkSource::max_chunk_bytes(const ChunkKey& /*key*/) const {
    return Chunk::max_bytes();
}

const ChunkSource& chunks_of(const HeightSource& source) {
    static const ChunkSource made_from_heights{};
    const auto* own = dynamic_cast<const ChunkSource*>(&source);
    return own != nullptr ? *own : made_from_heights;
}

namespace {

constexpr std::int32_t kMostRoots = 1024;  // along a side, in a world without a root window
constexpr std::int32_t kLeastRootWindow = 4, kMostRootWindow = 64;

}  // namespace

double Lattice::x(std::int64_t index) const {
    return origin_x + spacing * static_cast<double>(index);
}

double Lattice::y(std::int64_t index) const {
    return origin_y + spacing * static_cast<double>(index);
}

int Lattice::level_for_spacing(double wanted) const {
    for (int level = 0; level < finest_level; ++level) {
        if (level_spacing(level) <= wanted) return level;
    }
    return finest_level;
}

Result<void> Lattice::validate() const {
    const auto refuse = [](const std::string& what, double value) -> Result<void> {
        return fail(ErrorCode::invalid_argument, what + ", got " + number_text(value));
    };
    if (!(spacing >= kLeastSpacing && spacing <= kMostSpacing)) {
        return refuse("spacing must be 2^-30 to 2^20 m", spacing);
    }
    for (const auto& [name, origin] :
         {std::pair{"origin_x", origin_x}, std::pair{"origin_y", origin_y}}) {
        if (!(std::abs(origin) <= kMostSpacingsFromOrigin * spacing)) {
            return refuse(std::string(name) + " must be within 2^40 spacings of 0, spacing " +
                              number_text(spacing) + " m",
                          origin);
        }
    }
    int exponent = 0;
    if (!(quantum >= 0x1p-60 && quantum <= 0x1p20) || std::frexp(quantum, &exponent) != 0.5) {
        return refuse("quantum must be a power of two from 2^-60 to 2^20 m", quantum);
    }
    if (finest_level < 0 || finest_level > 24) {
        return refuse("finest_level must be 0 to 24", finest_level);
    }
    const bool has_window = root_window != 0;
    if (has_window &&
        (root_window % 2 != 0 || root_window < kLeastRootWindow || root_window > kMostRootWindow)) {
        return refuse("root_window must be 0 or an even number of 4 to 64", root_window);
    }
    for (const auto& [name, count] :
         {std::pair{"root_count_x", root_count_x}, std::pair{"root_count_y", root_count_y}}) {
        if (count < 1 || (!has_window && count > kMostRoots)) {
            return refuse(
                std::string(name) + (has_window ? " must be 1 or more" : " must be 1 to 1024"),
                count);
        }
    }
    // keys of the finest level must fit into 32 bits
    const std::int64_t limit = (std::int64_t{1} << 31) >> finest_level;
    for (const std::int64_t root :
         {std::int64_t{first_root_x}, std::int64_t{first_root_y},
          std::int64_t{first_root_x} + root_count_x, std::int64_t{first_root_y} + root_count_y}) {
        if (root <= -limit || root >= limit) {
            return refuse("root squares must lie within 2^31 chunks of the finest level",
                          static_cast<double>(root));
        }
    }
    for (const double edge : {x(west()), x(east()), y(south()), y(north())}) {
        if (!(std::abs(edge) <= kFarthestPlace)) {
            return refuse("root squares must lie within 2^40 m of 0", edge);
        }
    }
    return {};
}

}  // namespace terrane
