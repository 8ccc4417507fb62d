// SPDX-License-Identifier: MIT
// Plays a flight and a drop in one scene and prints what they cost as one JSON object:
//
//     scene_cost SCENE [FRAMES [DEM]]
//
// Times are those of the processor, of all threads. Bytes allocated are those of operator new in the flight and drop;
// the peak is the largest resident set of the process, its libraries included.
#include "cost/play.h"
#include "cost/scenes.h"
#include "support/allocation_counter.h"

#include <sys/resource.h>

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

namespace {

using terrane::test::AllocationCounter;

double processor_ms() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

std::uint64_t peak_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::uint64_t{1024} * static_cast<std::uint64_t>(usage.ru_maxrss);
}

int fail(const std::string& message) {
    std::fprintf(stderr, "cost: %s\n", message.c_str());
    return 1;
}

}  // namespace

int main(int argc, char** argv) {
    using namespace terrane::test;
    if (argc < 2 || argc > 4) {
        std::fprintf(stderr, "usage: %s SCENE [FRAMES [DEM]]\n", argv[0]);
        return 2;
    }
    const int frames = argc > 2 ? std::atoi(argv[2]) : 120;
    if (frames < 1)
        return fail("FRAMES must be a number above 0, got '" + std::string(argv[2]) + "'");
    const std::string dem = argc > 3 ? argv[3] : TERRANE_SOURCE_DIR "/tools/data/jacksboro.tif";

    const double before_ms = processor_ms();
    const auto scene = make_cost_scene(argv[1], dem);
    if (!scene) return fail(scene.error().message);
    const AllocationCounter allocations;
    const double made_ms = processor_ms();
    const auto run = play_cost_scene(*scene, frames);
    if (!run) return fail(run.error().message);
    const double played_ms = processor_ms();

    std::printf("{\"scene\":\"%s\",\"frames\":%d,\"setup_ms\":%.3f,\"play_ms\":%.3f,", argv[1],
                frames, made_ms - before_ms, played_ms - made_ms);
    std::printf("\"allocations\":%" PRIu64 ",\"allocated_bytes\":%" PRIu64
                ",\"peak_bytes\":%" PRIu64 ",\"threads\":%d,\"threads_begun\":%d,",
                allocations.count(), allocations.bytes(), peak_bytes(), run->threads,
                run->threads_begun);
    std::printf("\"ground_triangles\":%zu,\"object_triangles\":%zu,\"late_chunks\":%" PRIu64
                ",\"awake_bodies\":%" PRIu64 ",\"fell_through\":%" PRIu64 ",\"hash\":\"%016" PRIx64
                "\"}\n",
                run->ground_triangles, run->object_triangles, run->late_chunks, run->awake_bodies,
                run->fell_through, run->hash);
    return 0;
}
