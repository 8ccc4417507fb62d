// SPDX-License-Identifier: MIT
#include "scene/horizon/hill_world.h"

#include <terrane/terrain/chunk.h>

#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace terrane::test {

std::shared_ptr<const ResidentSet> resident_chunks(
    const HeightSource& source, int finest_level,
    const std::function<bool(const ChunkKey&)>& is_resident,
    const std::function<std::shared_ptr<const Chunk>(std::shared_ptr<const Chunk>)>& change) {
    const Lattice& lattice = source.lattice();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    std::set<ChunkKey> keys;
    for (int level = 0; level <= finest_level; ++level) {
        const std::int32_t scale = 1 << level;
        for (std::int32_t j = 0; j < lattice.root_count_y * scale; ++j) {
            for (std::int32_t i = 0; i < lattice.root_count_x * scale; ++i) {
                const ChunkKey key = {lattice.first_root_x * scale + i,
                                      lattice.first_root_y * scale + j,
                                      static_cast<std::uint8_t>(level)};
                if (level > 0 && keys.count(key.parent()) == 0) continue;
                if (is_resident && !is_resident(key)) continue;
                keys.insert(key);
                std::shared_ptr<const Chunk> chunk = make_chunk(source, key).value();
                chunks.push_back(change ? change(std::move(chunk)) : std::move(chunk));
            }
        }
    }
    return std::make_shared<const ResidentSet>(lattice, source.extent(), std::move(chunks), 1);
}

MeshRays drawn_surface(const TerrainMesh& mesh) {
    const Lattice& lattice = mesh.resident->lattice();
    TriangleMesh triangles;
    for (const MeshChunk& part : mesh.chunks) {
        std::map<std::uint16_t, std::uint32_t> made;
        const auto vertex_of = [&](std::uint16_t sample) {
            const auto [place, is_new] =
                made.emplace(sample, static_cast<std::uint32_t>(triangles.positions.size()));
            if (is_new) {
                const Chunk& chunk = *part.chunk;
                triangles.positions.emplace_back(
                    lattice.x(chunk.corner.x + sample % kChunkSamples * chunk.step),
                    lattice.y(chunk.corner.y + sample / kChunkSamples * chunk.step),
                    part.displayed_height(sample, lattice.quantum));
            }
            return place->second;
        };
        for (std::uint32_t i = part.first_index; i < part.first_index + part.index_count; i += 3) {
            const std::uint32_t a = vertex_of(mesh.indices[i]);
            const std::uint32_t b = vertex_of(mesh.indices[i + 1]);
            const std::uint32_t c = vertex_of(mesh.indices[i + 2]);
            triangles.triangles.push_back({a, b, c});
        }
    }
    return MeshRays::create(triangles).value();
}

View view_along(const WorldPos& eye_world, const Eigen::Vector2d& direction, double slope,
                double roll) {
    View view;
    view.eye_world = eye_world;
    view.forward = Eigen::Vector3d(direction.x(), direction.y(), slope).normalized();
    const Eigen::Vector3d right = view.forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d up = right.cross(view.forward).normalized();
    view.up = (std::cos(roll) * up + std::sin(roll) * right).normalized();
    return view;
}

}  // namespace terrane::test
