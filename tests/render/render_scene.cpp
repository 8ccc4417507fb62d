// SPDX-License-Identifier: MIT
#include "render/render_scene.h"

#include "support/grounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace terrane::test {
namespace {

constexpr double kAmplitude = 12.0;
constexpr double kWavelength = 90.0;

// Wave heights that move with the world: the same hills at any position of it.
class MovedHeights final : public HeightSource {
public:
    MovedHeights(const Lattice& lattice, double east)
        : HeightSource(lattice, whole_extent(lattice)),
          base_(lattice, kAmplitude, kWavelength),
          east_(east) {}
    double height(double x, double y) const override { return base_.height(x - east_, y); }
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                heights_out[i++] = height(lattice().x(grid.corner.x + column * grid.step),
                                          lattice().y(grid.corner.y + row * grid.step));
            }
        }
        return {};
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return base_.vertex_bounds(grid, bounds_out);
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return base_.cell_bounds(grid, bounds_out);
    }
    HeightInterval interval(const WorldRect&) const override { return {-kAmplitude, kAmplitude}; }
    double rise_bound(double distance) const override { return base_.rise_bound(distance); }

private:
    WaveHeights base_;
    double east_;
};

// Gentle hills with a roughness at whole metres that is 0 where both coordinates are even, so that samples 2 m apart
// miss it.
class RoughHeights final : public HeightSource {
public:
    explicit RoughHeights(const Lattice& lattice)
        : HeightSource(lattice, whole_extent(lattice)), base_(lattice, 2.0, kWavelength) {}
    double height(double x, double y) const override {
        const auto column = static_cast<std::uint32_t>(std::lround(x));
        const auto row = static_cast<std::uint32_t>(std::lround(y));
        if ((column | row) % 2 == 0) return base_.height(x, y);
        std::uint32_t hash = column * 0x9e3779b1u ^ row * 0x85ebca77u;
        hash = (hash ^ (hash >> 15)) * 0x2c1b3c6du;
        hash ^= hash >> 13;
        return base_.height(x, y) + kRoughness * (static_cast<double>(hash) / 2147483647.5 - 1.0);
    }
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                heights_out[i++] = height(lattice().x(grid.corner.x + column * grid.step),
                                          lattice().y(grid.corner.y + row * grid.step));
            }
        }
        return {};
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        const Result<void> made = base_.vertex_bounds(grid, bounds_out);
        for (float& bound : bounds_out) bound += static_cast<float>(2.0 * kRoughness);
        return made;
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        const Result<void> made = base_.cell_bounds(grid, bounds_out);
        for (float& bound : bounds_out) bound += static_cast<float>(2.0 * kRoughness);
        return made;
    }
    HeightInterval interval(const WorldRect&) const override { return {-3.0, 3.0}; }
    double rise_bound(double distance) const override {
        return base_.rise_bound(distance) + 2.0 * kRoughness;
    }

private:
    static constexpr double kRoughness = 0.8;
    WaveHeights base_;
};

void add_triangle(Scene& scene, std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t i : {a, b, c}) scene.indices.push_back(static_cast<std::uint16_t>(i));
}

// A square of 2 x 2 cells: eight triangles around its centre, or fewer where an edge is on the border of the chunk, so
// that only every second border sample is a vertex.
void add_fan(Scene& scene, int column, int row) {
    const std::size_t middle = sample_index(column + 1, row + 1);
    const auto add_edge = [&](int x0, int y0, int x1, int y1, bool is_border) {
        const std::size_t first = sample_index(column + x0, row + y0);
        const std::size_t last = sample_index(column + x1, row + y1);
        const std::size_t between = sample_index(column + (x0 + x1) / 2, row + (y0 + y1) / 2);
        if (is_border) {
            add_triangle(scene, first, last, middle);
        } else {
            add_triangle(scene, first, between, middle);
            add_triangle(scene, between, last, middle);
        }
    };
    add_edge(0, 0, 2, 0, row == 0);
    add_edge(2, 0, 2, 2, column + 2 == kChunkCells);
    add_edge(2, 2, 0, 2, row + 2 == kChunkCells);
    add_edge(0, 2, 0, 0, column == 0);
}

void add_cell(Scene& scene, int column, int row) {
    const std::size_t south_west = sample_index(column, row);
    const std::size_t south_east = sample_index(column + 1, row);
    const std::size_t north_west = sample_index(column, row + 1);
    const std::size_t north_east = sample_index(column + 1, row + 1);
    if (cut_to_north_east(column, row)) {
        add_triangle(scene, south_west, south_east, north_east);
        add_triangle(scene, south_west, north_east, north_west);
    } else {
        add_triangle(scene, south_west, south_east, north_west);
        add_triangle(scene, south_east, north_east, north_west);
    }
}

}  // namespace

TerrainMesh Scene::mesh() const {
    TerrainMesh mesh;
    mesh.resident = resident;
    mesh.chunks = chunks;
    mesh.indices = indices;
    mesh.triangle_count = indices.size() / 3;
    mesh.status = MeshStatus::error_met;
    return mesh;
}

double Scene::height(double x, double y) const {
    const double east = resident->lattice().x(resident->lattice().west());
    const MovedHeights source(resident->lattice(), east);
    return source.height(x, y);
}

Scene make_scene(std::int32_t roots_east) {
    Lattice lattice;
    lattice.spacing = 1.0;
    lattice.finest_level = 1;
    lattice.first_root_x = roots_east;
    lattice.root_count_x = 2;
    const MovedHeights source(lattice, lattice.x(lattice.west()));
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (const ChunkKey& key : {ChunkKey{roots_east, 0, 0}, ChunkKey{roots_east + 1, 0, 0},
                                ChunkKey{2 * roots_east + 1, 1, 1}}) {
        Result<std::shared_ptr<const Chunk>> chunk = make_chunk(source, key);
        EXPECT_TRUE(chunk) << (chunk ? "" : chunk.error().message);
        if (!chunk) return {};
        chunks.push_back(std::move(*chunk));
    }

    Scene scene;
    for (const std::shared_ptr<const Chunk>& chunk : chunks) {
        const auto first = static_cast<std::uint32_t>(scene.indices.size());
        const bool is_fine = chunk->key.level == 1;
        const bool is_western_root = !is_fine && chunk->key.x == roots_east;
        for (int row = 0; row < kChunkCells; row += is_fine ? 2 : 1) {
            for (int column = 0; column < kChunkCells; column += is_fine ? 2 : 1) {
                if (is_fine) {
                    add_fan(scene, column, row);
                } else if (!(is_western_root && column >= kChunkCells / 2 &&
                             row >= kChunkCells / 2)) {
                    add_cell(scene, column, row);
                }
            }
        }
        scene.chunks.push_back({chunk.get(), first,
                                static_cast<std::uint32_t>(scene.indices.size()) - first, nullptr});
    }
    scene.resident = std::make_shared<const ResidentSet>(lattice, source.extent(), chunks, 1);
    return scene;
}

Scene make_rough_scene(std::span<const ChunkKey> resident, std::span<const ChunkKey> drawn) {
    Lattice lattice;
    lattice.spacing = 1.0;
    lattice.finest_level = 1;
    lattice.root_count_x = 2;
    const RoughHeights source(lattice);
    std::vector<ChunkKey> keys{{0, 0, 0}, {1, 0, 0}};
    keys.insert(keys.end(), resident.begin(), resident.end());
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (const ChunkKey& key : keys) {
        Result<std::shared_ptr<const Chunk>> chunk = make_chunk(source, key);
        EXPECT_TRUE(chunk) << (chunk ? "" : chunk.error().message);
        if (!chunk) return {};
        chunks.push_back(std::move(*chunk));
    }
    const auto is_drawn = [&](const ChunkKey& key) {
        return std::find(drawn.begin(), drawn.end(), key) != drawn.end();
    };
    Scene scene;
    for (const std::shared_ptr<const Chunk>& chunk : chunks) {
        if (chunk->key.level == 1 && !is_drawn(chunk->key)) continue;
        const auto first = static_cast<std::uint32_t>(scene.indices.size());
        for (int row = 0; row < kChunkCells; ++row) {
            for (int column = 0; column < kChunkCells; ++column) {
                const int quadrant = column / (kChunkCells / 2) + 2 * (row / (kChunkCells / 2));
                if (chunk->key.level == 0 && is_drawn(chunk->key.child(quadrant))) continue;
                add_cell(scene, column, row);
            }
        }
        scene.chunks.push_back({chunk.get(), first,
                                static_cast<std::uint32_t>(scene.indices.size()) - first, nullptr});
    }
    scene.resident = std::make_shared<const ResidentSet>(lattice, source.extent(), chunks, 1);
    return scene;
}

float offset_at(std::int64_t x, std::int64_t y) {
    if (x > 250) return 0.0f;
    // multiples of 1/48, so that sums are rounded
    return static_cast<float>((x * 37 + y * 101) % 64 - 32) / 48.0f;
}

void add_offsets(Scene& scene) {
    const Lattice& lattice = scene.resident->lattice();
    scene.offsets.clear();
    scene.offsets.reserve(scene.chunks.size());
    for (MeshChunk& drawn : scene.chunks) {
        const Chunk& chunk = *drawn.chunk;
        if (chunk.key.level == 0 && chunk.key.x != lattice.first_root_x) continue;
        std::vector<float>& offsets = scene.offsets.emplace_back(
            std::size_t{kChunkSamples} * kChunkSamples, std::numeric_limits<float>::quiet_NaN());
        for (std::uint32_t i = 0; i < drawn.index_count; ++i) {
            const std::uint16_t sample = scene.indices[drawn.first_index + i];
            const std::int64_t x = chunk.corner.x + sample % kChunkSamples * chunk.step;
            const std::int64_t y = chunk.corner.y + sample / kChunkSamples * chunk.step;
            offsets[sample] = offset_at(x - lattice.west(), y - lattice.south());
        }
        drawn.offsets = offsets.data();
    }
}

int count_different(const Image& a, const Image& b, int more_than) {
    if (a.rgb.size() != b.rgb.size()) return -1;
    int count = 0;
    for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
        bool is_different = false;
        for (std::size_t c = i; c < i + 3; ++c) {
            is_different = is_different || std::abs(int{a.rgb[c]} - int{b.rgb[c]}) > more_than;
        }
        count += is_different ? 1 : 0;
    }
    return count;
}

int largest_difference(const Image& a, const Image& b) {
    if (a.rgb.size() != b.rgb.size()) return 256;
    int largest = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) {
        largest = std::max(largest, std::abs(int{a.rgb[i]} - int{b.rgb[i]}));
    }
    return largest;
}

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
