// SPDX-License-Identifier: MIT
#pragma once

#include "chunk/chunk_vertices.h"
#include "store/test_files.h"

#include <terrane/store/chunk_store.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace terrane::test {

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

/// Whether two chunks' vertices have the same bits.
inline bool same_vertices(const internal::ChunkVertices& a, const internal::ChunkVertices& b) {
    const auto same_side = [](const internal::SideVertices& s, const internal::SideVertices& t) {
        return s.inverse_square_bounds == t.inverse_square_bounds && s.low == t.low &&
               s.high == t.high;
    };
    bool same = same_side(a.east_side, b.east_side) && same_side(a.north_side, b.north_side) &&
                a.reach_base == b.reach_base && a.reach_unit == b.reach_unit &&
                a.coarse_bounds == b.coarse_bounds;
    for (std::size_t i = 0; same && i < a.areas.size(); ++i) {
        const internal::AreaVertices &v = a.areas[i], &w = b.areas[i];
        same = v.inverse_square_bounds == w.inverse_square_bounds && v.low == w.low &&
               v.high == w.high && v.rise == w.rise && v.rise_unit == w.rise_unit &&
               a.area_reaches[i].low == b.area_reaches[i].low &&
               a.area_reaches[i].high == b.area_reaches[i].high;
    }
    return same;
}

/// Whether two chunks have the same bits in all fields.
inline bool same_chunk(const Chunk& a, const Chunk& b) {
    bool same = a.key == b.key && a.corner == b.corner && a.step == b.step &&
                a.heights == b.heights && same_vertices(*a.vertices, *b.vertices) &&
                a.vertex_reach.low == b.vertex_reach.low &&
                a.vertex_reach.high == b.vertex_reach.high && a.cell_bounds == b.cell_bounds &&
                a.cell_flags == b.cell_flags && a.low == b.low && a.high == b.high &&
                a.max_vertex_bound == b.max_vertex_bound && a.quadrant_bound == b.quadrant_bound;
    for (std::size_t i = 0; same && i < a.areas.size(); ++i) {
        const Chunk::Area &v = a.areas[i], &w = b.areas[i];
        same = v.low == w.low && v.high == w.high && v.max_vertex_bound == w.max_vertex_bound &&
               v.max_cell_bound == w.max_cell_bound;
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
