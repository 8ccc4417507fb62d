// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/store/chunk_store.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace terrane::test {

/// A folder of its own, removed at the end.
class StoreFolder {
public:
    StoreFolder() {
        std::random_device entropy;
        path_ =
            std::filesystem::temp_directory_path() / ("terrane_store_" + std::to_string(entropy()));
        std::filesystem::create_directories(path_);
    }
    ~StoreFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    StoreFolder(const StoreFolder&) = delete;
    StoreFolder& operator=(const StoreFolder&) = delete;
    std::string file(const std::string& name) const { return (path_ / name).string(); }
    int file_count() const {
        return static_cast<int>(std::distance(std::filesystem::directory_iterator(path_), {}));
    }

private:
    std::filesystem::path path_;
};

inline std::vector<char> read_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_file(const std::string& path, const std::vector<char>& bytes) {
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// Two by two roots of 4096 m, and three levels.
inline std::shared_ptr<const HeightSource> small_fractal() {
    return FractalHeights::create({.seed = 11,
                                   .octave_count = 9,
                                   .wavelength_log2 = 11,
                                   .finest_spacing_log2 = 3,
                                   .root_size_log2 = 12})
        .value();
}

inline std::shared_ptr<const HeightSource> open_store(const std::string& path) {
    auto store = ChunkStore::open(path);
    EXPECT_TRUE(store.has_value()) << (store ? "" : store.error().message);
    return store ? *store : nullptr;
}

/// All chunks of a world.
inline std::vector<ChunkKey> all_keys(const Lattice& lattice) {
    std::vector<ChunkKey> keys;
    for (int level = 0; level <= lattice.finest_level; ++level) {
        const int per_root = 1 << level;
        for (int y = 0; y < lattice.root_count_y * per_root; ++y) {
            for (int x = 0; x < lattice.root_count_x * per_root; ++x) {
                keys.push_back({lattice.first_root_x * per_root + x,
                                lattice.first_root_y * per_root + y,
                                static_cast<std::uint8_t>(level)});
            }
        }
    }
    return keys;
}

/// Whether two chunks have the same bits, all of them.
inline bool same_chunk(const Chunk& a, const Chunk& b) {
    const auto same_side = [](const Chunk::SideVertices& s, const Chunk::SideVertices& t) {
        return s.inverse_square_bounds == t.inverse_square_bounds && s.low == t.low &&
               s.high == t.high;
    };
    bool same = a.key == b.key && a.corner == b.corner && a.step == b.step &&
                a.heights == b.heights && a.vertices.size() == b.vertices.size() &&
                same_side(a.east_side, b.east_side) && same_side(a.north_side, b.north_side) &&
                a.reach_base == b.reach_base && a.reach_unit == b.reach_unit &&
                a.reach_low == b.reach_low && a.reach_high == b.reach_high &&
                a.coarse_bounds == b.coarse_bounds && a.cell_bounds == b.cell_bounds &&
                a.cell_flags == b.cell_flags && a.low == b.low && a.high == b.high &&
                a.max_vertex_bound == b.max_vertex_bound && a.quadrant_bound == b.quadrant_bound;
    for (std::size_t i = 0; same && i < a.vertices.size(); ++i) {
        const AreaVertices &v = a.vertices[i], &w = b.vertices[i];
        same = v.inverse_square_bounds == w.inverse_square_bounds && v.low == w.low &&
               v.high == w.high && v.rise == w.rise && v.rise_unit == w.rise_unit;
    }
    for (std::size_t i = 0; same && i < a.areas.size(); ++i) {
        const Chunk::Area &v = a.areas[i], &w = b.areas[i];
        same = v.low == w.low && v.high == w.high && v.max_vertex_bound == w.max_vertex_bound &&
               v.max_cell_bound == w.max_cell_bound && v.reach_low == w.reach_low &&
               v.reach_high == w.reach_high;
    }
    for (int log2 = SamplePyramid::kFinest; same && log2 <= SamplePyramid::kCoarsest; ++log2) {
        for (int row = 0; row < kChunkCells; row += 1 << log2) {
            for (int column = 0; column < kChunkCells; column += 1 << log2) {
                same = same && a.pyramid.at(log2, column, row) == b.pyramid.at(log2, column, row);
            }
        }
    }
    return same;
}

}  // namespace terrane::test
