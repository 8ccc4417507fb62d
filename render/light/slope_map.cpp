// SPDX-License-Identifier: MIT
#include "light/slope_map.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace terrane::internal {
namespace {

ChunkKey neighbour(const ChunkKey& key, int side) {
    constexpr std::array<std::int32_t, 4> kX{-1, 1, 0, 0};
    constexpr std::array<std::int32_t, 4> kY{0, 0, -1, 1};
    const auto at = static_cast<std::size_t>(side);
    return {key.x + kX[at], key.y + kY[at], key.level};
}

// The chunk of a coarser level that covers a chunk.
ChunkKey ancestor(ChunkKey key, int level) {
    while (key.level > level) key = key.parent();
    return key;
}

// Heights of a chunk and of the chunks around it, by lattice point.
class Heights {
public:
    Heights(const ResidentSet& resident, const Chunk& chunk, const SideLevels& side_levels)
        : chunk_(chunk) {
        for (int side = 0; side < 4; ++side) {
            const int level = side_levels[static_cast<std::size_t>(side)];
            if (level < 0) continue;
            const std::int32_t index = resident.find(ancestor(neighbour(chunk.key, side), level));
            around_[static_cast<std::size_t>(side)] =
                resident.chunks()[static_cast<std::size_t>(index)].get();
        }
    }

    // `column` or `row`, not both, may be up to 128 samples beyond the edges. Absent where no chunk has the
    // sample.
    std::optional<std::int32_t> at(int column, int row) const {
        int side = -1;
        if (column < 0) side = 0;
        if (column > kChunkCells) side = 1;
        if (row < 0) side = 2;
        if (row > kChunkCells) side = 3;
        if (side < 0) return chunk_.heights[sample_index(column, row)];
        const Chunk* other = around_[static_cast<std::size_t>(side)];
        if (other == nullptr) return std::nullopt;
        const std::int64_t x = chunk_.corner.x + column * chunk_.step - other->corner.x;
        const std::int64_t y = chunk_.corner.y + row * chunk_.step - other->corner.y;
        if (x % other->step != 0 || y % other->step != 0) return std::nullopt;
        return other->heights[sample_index(static_cast<int>(x / other->step),
                                           static_cast<int>(y / other->step))];
    }

private:
    const Chunk& chunk_;
    std::array<const Chunk*, 4> around_{};
};

// Rise per sample spacing, quanta: central difference over `baseline` samples to both sides, one-sided where one is
// absent.
double rise(std::int32_t middle, std::optional<std::int32_t> before,
            std::optional<std::int32_t> after, int baseline) {
    const double last = after.value_or(middle);
    const double first = before.value_or(middle);
    const int width = (after ? baseline : 0) + (before ? baseline : 0);
    return width == 0 ? 0.0 : (last - first) / width;
}

std::int16_t to_signed_16(double component) {
    return static_cast<std::int16_t>(std::lround(component * 32767.0));
}

}  // namespace

SideLevels find_side_levels(const ResidentSet& resident, const ChunkKey& key) {
    SideLevels levels{-1, -1, -1, -1};
    for (int side = 0; side < 4; ++side) {
        const ChunkKey beside = neighbour(key, side);
        for (int level = key.level; level >= 0; --level) {
            if (resident.find(ancestor(beside, level)) == ResidentSet::kNone) continue;
            levels[static_cast<std::size_t>(side)] = level;
            break;
        }
    }
    return levels;
}

std::vector<std::int16_t> make_slope_map(const ResidentSet& resident, const Chunk& chunk,
                                         const SideLevels& side_levels) {
    const Heights heights(resident, chunk, side_levels);
    const Lattice& lattice = resident.lattice();
    const double slope_per_rise =
        lattice.quantum / (lattice.spacing * static_cast<double>(chunk.step));
    std::vector<std::int16_t> map(std::size_t{2} * kSlopeMapWidth * kSlopeMapHeight, 0);
    for (int layer = 0; layer < kSlopeLayers; ++layer) {
        const int baseline = 1 << layer;
        for (int row = 0; row <= kChunkCells; row += baseline) {
            std::size_t out = std::size_t{2} * kSlopeMapWidth *
                              static_cast<std::size_t>(slope_layer_row(layer) + row / baseline);
            for (int column = 0; column <= kChunkCells; column += baseline) {
                const std::int32_t middle = chunk.heights[sample_index(column, row)];
                const double east =
                    slope_per_rise * rise(middle, heights.at(column - baseline, row),
                                          heights.at(column + baseline, row), baseline);
                const double north =
                    slope_per_rise * rise(middle, heights.at(column, row - baseline),
                                          heights.at(column, row + baseline), baseline);
                const double scale = 1.0 / std::sqrt(east * east + north * north + 1.0);
                map[out++] = to_signed_16(-east * scale);
                map[out++] = to_signed_16(-north * scale);
            }
        }
    }
    return map;
}

}  // namespace terrane::internal
