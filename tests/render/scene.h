// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/image.h>
#include <terrane/terrain/triangulator.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::test {

/// A small world of hills that is drawn without pager or triangulator: two roots side by side, 256 m
/// each with samples 2 m apart, and one chunk of level 1 (1 m) in the western root's north-east
/// quadrant. That chunk's triangles and the roots' meet at vertices 2 m apart along its edges, by a
/// fan of triangles in the chunk.
struct Scene {
    std::shared_ptr<const ResidentSet> resident;
    std::vector<MeshChunk> chunks;
    std::vector<std::uint16_t> indices;
    std::vector<std::vector<float>> offsets;  ///< that chunks point to

    TerrainMesh mesh() const;
    double height(double x, double y) const;  ///< of the source
};

/// The world's west edge lies `roots_east` root squares (of 256 m) east of the origin.
Scene make_scene(std::int32_t roots_east = 0);

/// The same two roots, of gentle hills with a roughness of 80 cm that only samples 1 m apart show.
///
/// @param resident chunks of level 1 that there are beside the roots
/// @param drawn    those of them that draw their own triangles; roots draw the rest
Scene make_rough_scene(std::span<const ChunkKey> resident, std::span<const ChunkKey> drawn);

/// Makes the vertices of the western root and of the fine chunk morph, by up to 2 m, but for those
/// near the eastern root, which morphs nowhere. Offsets of samples that no triangle uses are NaN.
void add_offsets(Scene& scene);
/// What add_offsets() gives a lattice point, counted from the world's south-west corner.
float offset_at(std::int64_t x, std::int64_t y);

/// Pixels that differ by more than that in any channel.
int count_different(const Image& a, const Image& b, int more_than = 0);
/// Largest difference of a channel.
int largest_difference(const Image& a, const Image& b);

}  // namespace terrane::test
