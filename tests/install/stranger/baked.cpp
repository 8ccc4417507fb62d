// SPDX-License-Identifier: MIT
// Bakes a fractal, opens the file, and compares the ground.
#include <terrane/store/chunk_store.h>
#include <terrane/terrain/fractal_heights.h>

#include <cmath>
#include <cstdio>

int main() {
    using namespace terrane;
    const auto source = FractalHeights::create({.seed = 7}).value();
    const char* const path = "stranger.terrane";
    const auto baked = ChunkStore::bake(*source, path, {.level_count = 1});
    const auto store = ChunkStore::open(path);
    std::remove(path);
    if (!baked || !store) return 1;
    std::printf("%lld chunks\n", static_cast<long long>(baked->chunk_count));
    const double off = std::abs((*store)->height(100.0, 200.0) - source->height(100.0, 200.0));
    return off <= baked->max_error_m ? 0 : 1;
}
