// SPDX-License-Identifier: MIT
//
// Samples a second of fractals, on one thread, at every level of vector instructions that the
// machine has. The spacing is a share of the coarsest wavelength: 512 m, so that 1/512 is a grid of 1 m.
#include "base/simd_level.h"
#include "benchmark/bench.h"
#include "source/fractal/fractal_surface.h"

#include <terrane/terrain/fractal_heights.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace {

using terrane::FractalKind;
using terrane::internal::SimdLevel;

struct Case {
    FractalKind kind;
    int octaves;
    int spacing_log2;  ///< of the coarsest wavelength
    int columns, rows;
};

double samples_per_second(const Case& what, SimdLevel level) {
    constexpr int kWavelengthLog2 = 9, kRuns = 9;
    const terrane::FractalSurface surface(
        {.kind = what.kind, .octave_count = what.octaves, .wavelength_log2 = kWavelengthLog2});
    terrane::UnitGrid grid;
    grid.step = std::uint64_t{1} << (kWavelengthLog2 + what.spacing_log2 - terrane::kUnitLog2);
    grid.columns = what.columns;
    grid.rows = what.rows;
    std::vector<double> heights(static_cast<std::size_t>(grid.columns) *
                                static_cast<std::size_t>(grid.rows));
    std::vector<double> ns;
    for (int run = 0; run < kRuns; ++run) {
        ns.push_back(terrane::tools::time_call_ns(1, [&](std::size_t) {
            surface.sample(grid, level, heights);
            grid.x += grid.step * static_cast<std::uint64_t>(grid.columns - 1);  // ever new ground
            return heights.back();
        }));
    }
    return 1e9 * static_cast<double>(heights.size()) / terrane::tools::median(ns);
}

}  // namespace

int main() {
    constexpr const char* kKinds[] = {"fbm", "ridged", "hybrid", "warped"};
    constexpr const char* kLevels[] = {"baseline", "avx2", "avx512"};
    constexpr int kChunk = 129, kRow = 1024;
    std::vector<Case> cases;
    for (const int octaves : {1, 8, 10}) {
        for (const int spacing_log2 : {-10, -9, -6, -3, 0}) {
            cases.push_back({FractalKind::fbm, octaves, spacing_log2, kChunk, kChunk});
            cases.push_back({FractalKind::fbm, octaves, spacing_log2, kRow, 1});
        }
    }
    for (const FractalKind kind : {FractalKind::ridged, FractalKind::hybrid, FractalKind::warped}) {
        for (const int spacing_log2 : {-9, -3}) {
            cases.push_back({kind, 10, spacing_log2, kChunk, kChunk});
        }
    }
    std::printf("%-8s %-8s %10s %8s %8s %16s\n", "kind", "level", "grid", "octaves", "spacing",
                "million a second");
    for (const SimdLevel level : {SimdLevel::baseline, SimdLevel::avx2, SimdLevel::avx512}) {
        if (level > terrane::internal::best_simd_level()) continue;
        for (const Case& what : cases) {
            std::printf("%-8s %-8s %5d x %-4d %8d 1/%-6d %16.1f\n",
                        kKinds[static_cast<int>(what.kind)], kLevels[static_cast<int>(level)],
                        what.columns, what.rows, what.octaves, 1 << -what.spacing_log2,
                        1e-6 * samples_per_second(what, level));
        }
    }
    return 0;
}
