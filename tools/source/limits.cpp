// SPDX-License-Identifier: MIT
#include "source/limits.h"

#include <terrane/terrain/chunk.h>

#include <fmt/format.h>

#include <cmath>

namespace terrane::tools {
namespace {

std::size_t count_roots(const Terrain& terrain) {
    return static_cast<std::size_t>(terrain.source->lattice().resident_root_count());
}

std::string root_squares(std::size_t count) {
    return count == 1 ? "its root square" : fmt::format("its {} root squares", count);
}

}  // namespace

CommandResult<void> check_budget(const Terrain& terrain, std::size_t budget) {
    const std::size_t roots = count_roots(terrain);
    if (budget >= 2 * roots) return {};
    return failure(fmt::format(
        "--budget must be at least {} for this terrain, 2 triangles for {}, got {}", 2 * roots,
        roots == 1 ? "its root square" : "each of its root squares", budget));
}

CommandResult<void> check_memory(const Terrain& terrain, double memory_mb) {
    // those of two windows while one moves
    const std::size_t windows = terrain.source->lattice().root_window > 0 ? 2 : 1;
    const std::size_t roots = windows * count_roots(terrain);
    const double least = static_cast<double>(roots * Chunk::max_bytes()) / 0x1p20;
    if (memory_mb >= least) return {};
    // rounded up, so that the value in the message is enough
    return failure(
        fmt::format("--memory-mb must be at least {:.6g} for this terrain, room for {}, got {:.6g}",
                    std::ceil(least * 1e3) / 1e3, root_squares(roots), memory_mb));
}

}  // namespace terrane::tools
