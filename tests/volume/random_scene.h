// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"
#include "volume/joined_mesh.h"

#include <terrane/volume/volume_shapes.h>

#include <vector>

namespace terrane::test {

/// A world and operations that are likely to find faults: flat ground, slopes up to 10, noise; volumes on borders and
/// corners of tiles and chunks, tangential to the ground, nested, touching, through nodes.
struct RandomScene {
    VolumeWorld world;
    std::vector<VolumeOperation> operations;

    explicit RandomScene(std::uint64_t seed);
};

}  // namespace terrane::test
