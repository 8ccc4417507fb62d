// SPDX-License-Identifier: MIT
//
// Samples a second of fractals, on one thread, at every level of vector instructions that the
// machine has. Names: kind, level, grid, octaves, and the spacing as a share of the coarsest
// wavelength: 512 m, so that 1/512 is a grid of 1 m.
#include "base/simd_level.h"
#include "source/fractal/fractal_surface.h"

#include <terrane/terrain/fractal_heights.h>

#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <string>
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

void measure(benchmark::State& state, const Case& what, SimdLevel level) {
    constexpr int kWavelengthLog2 = 9;
    const terrane::FractalSurface surface(
        {.kind = what.kind, .octave_count = what.octaves, .wavelength_log2 = kWavelengthLog2});
    terrane::UnitGrid grid;
    grid.step = std::uint64_t{1} << (kWavelengthLog2 + what.spacing_log2 - terrane::kUnitLog2);
    grid.columns = what.columns;
    grid.rows = what.rows;
    std::vector<double> heights(static_cast<std::size_t>(grid.columns) *
                                static_cast<std::size_t>(grid.rows));
    for (auto _ : state) {
        surface.sample(grid, level, heights);
        benchmark::ClobberMemory();
        grid.x += grid.step * static_cast<std::uint64_t>(grid.columns - 1);  // ever new ground
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(heights.size()));
}

std::string name_of(const Case& what, SimdLevel level) {
    constexpr const char* kKinds[] = {"fbm", "ridged", "hybrid", "warped"};
    constexpr const char* kLevels[] = {"baseline", "avx2", "avx512"};
    return std::string(kKinds[static_cast<int>(what.kind)]) + "/" +
           kLevels[static_cast<int>(level)] + "/" + std::to_string(what.columns) + "x" +
           std::to_string(what.rows) + "/octaves:" + std::to_string(what.octaves) + "/spacing:1/" +
           std::to_string(1 << -what.spacing_log2);
}

}  // namespace

int main(int argc, char** argv) {
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
    for (const SimdLevel level : {SimdLevel::baseline, SimdLevel::avx2, SimdLevel::avx512}) {
        if (level > terrane::internal::best_simd_level()) continue;
        for (const Case& what : cases) {
            benchmark::RegisterBenchmark(
                name_of(what, level).c_str(),
                [what, level](benchmark::State& state) { measure(state, what, level); });
        }
    }
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
