// SPDX-License-Identifier: MIT
#include "plane_scene.h"

#include "support/heights/wave_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane::test {

Scene make_plane_scene(double height, double slope_east) {
    Lattice lattice;
    lattice.spacing = 2.0;
    lattice.finest_level = 0;
    lattice.root_count_x = 2;
    const WaveHeights source(lattice, 1.0, 90.0);
    std::vector<std::shared_ptr<const Chunk>> chunks;
    Scene scene;
    for (std::int32_t root = 0; root < 2; ++root) {
        const Result<std::shared_ptr<const Chunk>> made = make_chunk(source, {root, 0, 0});
        EXPECT_TRUE(made) << (made ? "" : made.error().message);
        if (!made) return {};
        auto chunk = std::make_shared<Chunk>(**made);
        const auto first = static_cast<std::uint32_t>(scene.indices.size());
        for (int row = 0; row < kChunkSamples; ++row) {
            for (int column = 0; column < kChunkSamples; ++column) {
                const double x = lattice.x(chunk->corner.x + column * chunk->step);
                chunk->heights[sample_index(column, row)] = static_cast<std::int32_t>(
                    std::lround((height + slope_east * (x - 256.0)) / lattice.quantum));
                if (row == kChunkCells || column == kChunkCells) continue;
                const std::size_t corners[4] = {
                    sample_index(column, row), sample_index(column + 1, row),
                    sample_index(column + 1, row + 1), sample_index(column, row + 1)};
                for (const int corner : {0, 1, 2, 0, 2, 3})
                    scene.indices.push_back(static_cast<std::uint16_t>(corners[corner]));
            }
        }
        const auto [low, high] = std::minmax_element(chunk->heights.begin(), chunk->heights.end());
        chunk->low = *low;
        chunk->high = *high;
        chunks.push_back(chunk);
        scene.chunks.push_back({chunk.get(), first,
                                static_cast<std::uint32_t>(scene.indices.size()) - first, nullptr});
    }
    scene.resident = std::make_shared<const ResidentSet>(lattice, source.extent(), chunks, 1);
    return scene;
}

void raise_western_root(Scene& scene, float by) {
    scene.offsets.emplace_back(std::size_t{kChunkSamples} * kChunkSamples, by);
    scene.chunks[0].offsets = scene.offsets.back().data();
}

}  // namespace terrane::test
