// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/contact_needs.h"
#include "support/heights/wave_heights.h"

#include <cmath>
#include <cstdint>
#include <set>
#include <vector>

// Worlds for tests of contact needs.
namespace terrane::test {

/// Each chunk of one level is flat, at its own height.
class Terraces final : public HeightSource {
public:
    Terraces(const Lattice& lattice, const WorldRect& extent, int level)
        : HeightSource(lattice, extent), side_(lattice.level_spacing(level) * kChunkCells) {}

    double terrace(std::int64_t column, std::int64_t row) const {
        return 5.0 * static_cast<double>(((column * 7 + row * 13) % 8 + 8) % 8);
    }
    double height(double x, double y) const override {
        return terrace(index((x - lattice().origin_x) / side_),
                       index((y - lattice().origin_y) / side_));
    }
    /// The edges of a rectangle belong to it alone.
    HeightInterval interval(const WorldRect& rect) const override {
        if (rect.east - rect.west > 1.5 * side_) return {0.0, 35.0};
        const double middle =
            height(0.5 * (rect.west + rect.east), 0.5 * (rect.south + rect.north));
        return {middle, middle};
    }
    double rise_bound(double) const override { return 35.0; }
    Result<void> sample(const SampleGrid&, std::span<double>) const override { return {}; }
    Result<void> vertex_bounds(const SampleGrid&, std::span<float>) const override { return {}; }
    Result<void> cell_bounds(const SampleGrid&, std::span<float>) const override { return {}; }

private:
    static std::int64_t index(double place) { return static_cast<std::int64_t>(std::floor(place)); }
    double side_;
};

/// A world of 16 x 16 chunks of 64 m at level 3, around the origin.
inline constexpr int kLevel = 3;
inline constexpr double kSide = 64.0;
inline Terraces small_terraces() {
    const Lattice lattice = small_world(kLevel + 1, 0.25);
    return {lattice, whole_extent(lattice), kLevel};
}

/// A world of 2^18 x 2^18 chunks of a metre.
inline constexpr int kDeepLevel = 17;
inline Terraces deep_terraces() {
    const Lattice lattice = small_world(kDeepLevel, 1.0 / kChunkCells);
    return {lattice, whole_extent(lattice), kDeepLevel};
}

/// The chunks of that level of the small world.
inline std::vector<ChunkKey> all_small_chunks() {
    std::vector<ChunkKey> keys;
    for (int y = -8; y < 8; ++y) {
        for (int x = -8; x < 8; ++x) keys.push_back({x, y, kLevel});
    }
    return keys;
}

/// The needed chunks of a level.
inline std::set<ChunkKey> keys_of(const internal::ContactNeeds& needs, int level) {
    std::set<ChunkKey> keys;
    for (const internal::ContactNeeds::Entry& entry : needs.entries()) {
        if (entry.key.level == level) keys.insert(entry.key);
    }
    return keys;
}

}  // namespace terrane::test
