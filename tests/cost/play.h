// SPDX-License-Identifier: MIT
#pragma once

#include "cost/scenes.h"

#include <cstddef>
#include <cstdint>

namespace terrane::test {

/// What a flight and a drop came to.
struct CostRun {
    std::size_t ground_triangles = 0;  ///< summed over frames
    std::size_t object_triangles = 0;  ///< summed over frames
    std::uint64_t late_chunks = 0;     ///< summed over frames
    std::uint64_t awake_bodies = 0;    ///< summed over steps
    std::uint64_t fell_through =
        0;  ///< bodies deeper in the ground than their tolerance, summed over steps
    std::uint64_t hash = 0;  ///< of all meshes' sizes and of the bodies' states at the end
    int threads = 0;         ///< of the process at the end of the flight
    int threads_begun =
        0;  ///< of them, not there before; libraries begin some when they are loaded
};

/// Flies a camera over the ground around (0, 0) while bodies fall on it: a frame and a step of 1/60 s in turn. Chunks
/// are loaded by the calling thread, so the same scene gives the same instructions.
///
/// Not inlined: callgrind counts what it does by its name.
///
/// Fails: as the functions that make a pager, a triangulator and a world
[[gnu::noinline]] Result<CostRun> play_cost_scene(const CostScene& scene, int frames);

}  // namespace terrane::test
