// SPDX-License-Identifier: MIT
#include "horizon/drawn_ground.h"

#include "base/vector_math.h"

#include <array>
#include <cmath>
#include <optional>

namespace terrane::internal {
namespace {

// Left for rounding: a triangle counts at places this far beyond its edges, in its own area.
constexpr double kEdge = 1e-9;

// A place on a chunk, in samples from its south-western one.
struct ChunkPlace {
    double column, row;

    bool is_within() const {
        return column >= -kEdge && column <= kChunkCells + kEdge && row >= -kEdge &&
               row <= kChunkCells + kEdge;
    }
};

ChunkPlace place_on(const Lattice& lattice, const Chunk& chunk, const WorldPos& place) {
    const double spacing = lattice.spacing * static_cast<double>(chunk.step);
    return {(place.x() - lattice.x(chunk.corner.x)) / spacing,
            (place.y() - lattice.y(chunk.corner.y)) / spacing};
}

// Height of one triangle, of three samples of a chunk, at a place on it; none beside it.
std::optional<double> height_at(const MeshChunk& part, std::span<const std::uint16_t> samples,
                                double quantum, const ChunkPlace& place) {
    std::array<double, 3> x, y;
    for (std::size_t i = 0; i < 3; ++i) {
        const int column = samples[i] % kChunkSamples, row = samples[i] / kChunkSamples;
        x[i] = column - place.column;
        y[i] = row - place.row;
    }
    std::array<double, 3> weight;  // twice the areas opposite to the corners
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        weight[i] = x[j] * y[k] - x[k] * y[j];
    }
    const double area = weight[0] + weight[1] + weight[2];
    double height = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        if (!(weight[i] >= -kEdge * area)) return std::nullopt;
        height += weight[i] / area * part.displayed_height(samples[i], quantum);
    }
    return height;
}

}  // namespace

bool is_above_drawn_ground(const TerrainMesh& mesh, const WorldPos& place) {
    if (mesh.resident == nullptr) return false;
    const Lattice& lattice = mesh.resident->lattice();
    bool is_over_triangle = false;
    for (const MeshChunk& part : mesh.chunks) {
        const ChunkPlace on_chunk = place_on(lattice, *part.chunk, place);
        if (!on_chunk.is_within()) continue;
        for (std::size_t i = 0; i < part.index_count; i += 3) {
            const std::optional<double> height = height_at(
                part, mesh.indices.subspan(part.first_index + i, 3), lattice.quantum, on_chunk);
            if (!height) continue;
            if (!(*height < place.z())) return false;
            is_over_triangle = true;
        }
    }
    return is_over_triangle;
}

}  // namespace terrane::internal
