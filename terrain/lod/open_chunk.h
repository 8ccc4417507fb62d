// SPDX-License-Identifier: MIT
#pragma once

#include "key_kernels.h"

#include <terrane/terrain/resident_set.h>

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::internal {

/// Sides of a chunk, in the order of ResidentSet::Links::neighbour.
enum Side : std::size_t { west = 0, east = 1, south = 2, north = 3 };

/// One chunk that the view may refine, and what a frame knows of it.
struct OpenChunk {
    static constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;
    /// Key of a vertex that cannot be active.
    static constexpr float kNever = std::numeric_limits<float>::infinity();

    OpenChunk() : keys(kSamples, kNever), offsets(kSamples, 0.0f) {}

    const Chunk* chunk = nullptr;
    std::int32_t index = ResidentSet::kNone;  ///< in the resident set
    OpenChunk* parent = nullptr;              ///< null for roots
    std::array<OpenChunk*, 4> child{};        ///< by quadrant; null where not open
    std::array<OpenChunk*, 4> neighbour{};    ///< by Side; null where not open
    std::array<bool, 4> is_absent{};          ///< by quadrant: no child there to open
    /// Beyond a side there is no world; or a world, but no chunk.
    enum class Beyond : std::uint8_t { world_end, absent, resident };
    std::array<Beyond, 4> beyond{};
    float fade_factor = 1.0f;  ///< keys are raised by it: 1 / fade^2

    /// Areas that may hold a vertex below the floor: bit column of byte row.
    std::array<std::uint8_t, kChunkAreas> open_areas{};
    KeyPlanes planes;  ///< of the view, that the chunk is not wholly inside of
    /// Those of them that are not wholly in view.
    std::array<std::uint8_t, kChunkAreas> areas_beside{};
    /// Whether a vertex below the floor has been raised: something may be missing here.
    bool is_held = false;

    std::vector<float> keys;     ///< [kSamples], at least those of the parents
    std::vector<float> offsets;  ///< [kSamples] see MeshChunk

    /// Active vertices, a bit each: centres by row, midpoints of west-east edges (along_x) by line, of
    /// south-north edges (along_y) by row, the easternmost of those apart.
    std::array<std::uint64_t, kChunkCells / 2> centre{};
    std::array<std::uint64_t, kChunkCells / 2 + 1> along_x{};
    std::array<std::uint64_t, kChunkCells / 2> along_y{};
    std::uint64_t along_y_east = 0;  ///< bit: row

    /// Areas with an active centre: bit column of byte row. Nothing else of the chunk is drawn.
    std::array<std::uint8_t, kChunkAreas> active_areas{};

    std::size_t triangle_count = 0;
    std::size_t first_triangle = 0;

    bool is_root() const { return chunk->key.level == 0; }

    /// Areas that a row of samples touches, a bit for each column of areas.
    unsigned open_columns(int row) const { return columns(open_areas, row); }
    unsigned active_columns(int row) const { return columns(active_areas, row); }
    unsigned columns_beside(int row) const { return columns(areas_beside, row); }

    /// Calls part(first, last) for the runs of columns of samples that `columns` covers, ends
    /// included.
    template <typename Part>
    static void for_each_run(unsigned columns, const Part& part) {
        while (columns != 0) {
            const int begin = std::countr_zero(columns);
            const int end = begin + std::countr_one(columns >> begin);
            part(begin * kAreaCells, end * kAreaCells);
            columns &= ~0u << end;
        }
    }

    static unsigned columns(const std::array<std::uint8_t, kChunkAreas>& areas, int row) {
        const int area = row / kAreaCells;
        unsigned columns = area < kChunkAreas ? areas[static_cast<std::size_t>(area)] : 0u;
        if (row % kAreaCells == 0 && area > 0) columns |= areas[static_cast<std::size_t>(area - 1)];
        return columns;
    }

    const float* key_row(int row) const { return keys.data() + sample_index(0, row); }
    float* key_row(int row) { return keys.data() + sample_index(0, row); }
};

}  // namespace terrane::internal
