// SPDX-License-Identifier: MIT
#include <terrane/base/text.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

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

namespace {

constexpr std::int32_t kMostRoots = 1024;  // along a side, if all are resident
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

Result<void> check(const Lattice& lattice) {
    const auto refuse = [](const std::string& what, double value) -> Result<void> {
        return fail(ErrorCode::invalid_argument, what + ", got " + number_text(value));
    };
    if (!(lattice.spacing >= kLeastSpacing && lattice.spacing <= kMostSpacing)) {
        return refuse("spacing must be 2^-30 to 2^20 m", lattice.spacing);
    }
    for (const auto& [name, origin] :
         {std::pair{"origin_x", lattice.origin_x}, std::pair{"origin_y", lattice.origin_y}}) {
        if (!(std::abs(origin) <= kMostSpacingsFromOrigin * lattice.spacing)) {
            return refuse(std::string(name) + " must be within 2^40 spacings of 0, spacing " +
                              number_text(lattice.spacing) + " m",
                          origin);
        }
    }
    int exponent = 0;
    if (!(lattice.quantum >= 0x1p-60 && lattice.quantum <= 0x1p20) ||
        std::frexp(lattice.quantum, &exponent) != 0.5) {
        return refuse("quantum must be a power of two from 2^-60 to 2^20 m", lattice.quantum);
    }
    if (lattice.finest_level < 0 || lattice.finest_level > 24) {
        return refuse("finest_level must be 0 to 24", lattice.finest_level);
    }
    const bool has_window = lattice.root_window != 0;
    if (has_window && (lattice.root_window % 2 != 0 || lattice.root_window < kLeastRootWindow ||
                       lattice.root_window > kMostRootWindow)) {
        return refuse("root_window must be 0 or an even number of 4 to 64", lattice.root_window);
    }
    for (const auto& [name, count] : {std::pair{"root_count_x", lattice.root_count_x},
                                      std::pair{"root_count_y", lattice.root_count_y}}) {
        if (count < 1 || (!has_window && count > kMostRoots)) {
            return refuse(
                std::string(name) + (has_window ? " must be 1 or more" : " must be 1 to 1024"),
                count);
        }
    }
    // keys of the finest level must fit into 32 bits
    const std::int64_t limit = (std::int64_t{1} << 31) >> lattice.finest_level;
    for (const std::int64_t root :
         {std::int64_t{lattice.first_root_x}, std::int64_t{lattice.first_root_y},
          std::int64_t{lattice.first_root_x} + lattice.root_count_x,
          std::int64_t{lattice.first_root_y} + lattice.root_count_y}) {
        if (root <= -limit || root >= limit) {
            return refuse("root squares must lie within 2^31 chunks of the finest level",
                          static_cast<double>(root));
        }
    }
    for (const double edge : {lattice.x(lattice.west()), lattice.x(lattice.east()),
                              lattice.y(lattice.south()), lattice.y(lattice.north())}) {
        if (!(std::abs(edge) <= kFarthestPlace)) {
            return refuse("root squares must lie within 2^40 m of 0", edge);
        }
    }
    return {};
}

}  // namespace terrane
