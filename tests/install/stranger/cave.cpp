// SPDX-License-Identifier: MIT
// Contours a cave under flat ground.
#include <terrane/volume/volume_tile.h>

#include <cstdio>

int main() {
    using namespace terrane;
    Lattice lattice;
    VolumeOperation cave;
    cave.shape = VolumeSphere{6.0};
    cave.world_from_shape.translation = {16.0, 16.0, -4.0};
    cave.voxel = 1.0;
    const auto volumes = Volumes::create(lattice, {&cave, 1});
    if (!volumes) return 1;
    const std::vector<std::int32_t> heights(kVolumeTileSamples * kVolumeTileSamples, 0);
    const auto tile = VolumeTile::create(*volumes, {0, 0}, heights);
    if (!tile) return 1;
    const VolumeContour contour = tile->contour();
    std::printf("%zu triangles, %zu of the heightfield replaced\n", contour.triangles.size(),
                contour.replaced.size());
    return contour.triangles.empty() || contour.replaced.empty() ? 1 : 0;
}
