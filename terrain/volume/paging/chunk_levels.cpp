// SPDX-License-Identifier: MIT
//
// Levels of detail of a chunk's triangles, and simple caps, by half-edge contraction (terrain/simplify).
#include "paging/chunk_tiles.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/simplify.h>

#include <algorithm>
#include <utility>

namespace terrane::internal {
namespace {

using Corners = std::array<std::uint32_t, 3>;

/// Errors of the levels, in spacings. A level that has not at least a quarter fewer triangles than the one before is
/// left out.
constexpr std::array kLevelErrors{0.02, 0.06, 0.2, 0.6, 1.8, 5.4};
constexpr double kLeastGain = 0.75;
/// Error of a cap, in spacings: it is plane, up to rounding.
constexpr double kCapError = 1e-3;

/// Locks the vertices of edges that do not have two triangles.
void lock_border(std::span<const Corners> triangles, std::vector<std::uint8_t>& locked) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    edges.reserve(3 * triangles.size());
    for (const auto& [a, b, c] : triangles) {
        for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
            edges.emplace_back(std::min(from, to), std::max(from, to));
    }
    std::ranges::sort(edges);
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i + 1;
        while (end < edges.size() && edges[end] == edges[i]) ++end;
        if (end - i != 2) locked[edges[i].first] = locked[edges[i].second] = 1;
        i = end;
    }
}

}  // namespace

void add_levels(const Lattice& lattice, const Chunk& chunk, SolidTriangles& solid) {
    const std::span<const Corners> all(solid.triangles);
    const auto ground = all.first(solid.ground_count), walls = all.subspan(solid.ground_count);
    if (walls.empty()) return;
    std::vector<std::uint8_t> locked(solid.vertices_world.size(), 0);
    lock_border(walls, locked);
    for (const Corners& triangle : ground) {
        for (const std::uint32_t corner : triangle) locked[corner] = 1;
    }
    // on the sides of the chunk: a wall may lie in one
    const std::int64_t side = kChunkCells * chunk.step;
    const double west = lattice.x(chunk.corner.x), east = lattice.x(chunk.corner.x + side);
    const double south = lattice.y(chunk.corner.y), north = lattice.y(chunk.corner.y + side);
    for (std::size_t i = 0; i < locked.size(); ++i) {
        const Eigen::Vector3d& p = solid.vertices_world[i];
        if (p.x() == west || p.x() == east || p.y() == south || p.y() == north) locked[i] = 1;
    }
    const double spacing = lattice.level_spacing(chunk.key.level);
    std::vector<SimplifyLevel> levels;
    for (const double error : kLevelErrors) levels.push_back({.error_m = error * spacing});
    auto made = simplify({solid.vertices_world, walls, locked, false}, levels);
    TERRANE_ASSERT(made.has_value(), "contours are valid meshes");
    if (!made) return;
    std::size_t least = walls.size();
    for (SimplifiedMesh& mesh : *made) {
        if (static_cast<double>(mesh.triangles.size()) > kLeastGain * static_cast<double>(least))
            continue;
        least = mesh.triangles.size();
        SolidLevel& level = solid.levels.emplace_back();
        level.error_m = mesh.error_m;
        level.triangles.reserve(ground.size() + mesh.triangles.size());
        level.triangles.assign(ground.begin(), ground.end());
        level.triangles.insert(level.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
    }
}

void simplify_cap(std::span<const WorldPos> vertices, std::vector<Corners>& cap, double spacing) {
    if (cap.empty()) return;
    std::vector<std::uint8_t> locked(vertices.size(), 0);
    lock_border(cap, locked);
    const SimplifyLevel level{.error_m = kCapError * spacing};
    auto made = simplify({vertices, cap, locked}, {&level, 1});
    TERRANE_ASSERT(made.has_value(), "caps are valid meshes");
    if (made) cap = std::move(made->front().triangles);
}

}  // namespace terrane::internal
