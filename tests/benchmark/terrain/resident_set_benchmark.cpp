// SPDX-License-Identifier: MIT
//
// Makes sets of 2000 chunks, destroys them, and looks keys up in one. In cold cases 64 MiB are
// written just before: more than a frame does, so that a flight lies between these and the warm ones.
#include <terrane/terrain/resident_set.h>

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace terrane {
namespace {

using Chunks = std::vector<std::shared_ptr<const Chunk>>;
using Seconds = std::chrono::duration<double>;

constexpr std::size_t kChunkCount = 2000;
constexpr std::int32_t kHalfSide = 6;  // chunks of each level around the eye

// Nothing but its key, in a block of memory of its own.
std::shared_ptr<const Chunk> fake_chunk(const ChunkKey& key) {
    auto chunk = std::make_unique<Chunk>();
    chunk->key = key;
    return chunk;
}

Lattice lattice() {
    Lattice lattice;
    lattice.finest_level = 24;
    lattice.first_root_x = lattice.first_root_y = -kHalfSide;
    lattice.root_count_x = lattice.root_count_y = 2 * kHalfSide;
    return lattice;
}

// Squares around one point, each of half the side of the one before.
Chunks chunks_around_a_point() {
    Chunks chunks;
    for (std::uint8_t level = 0; chunks.size() < kChunkCount; ++level) {
        for (std::int32_t y = -kHalfSide; y < kHalfSide; ++y) {
            for (std::int32_t x = -kHalfSide; x < kHalfSide; ++x) {
                if (chunks.size() == kChunkCount) return chunks;
                chunks.push_back(fake_chunk({x, y, level}));
            }
        }
    }
    return chunks;
}

void leave_the_caches() {
    static std::vector<std::uint64_t> other(std::size_t{8} << 20);
    for (std::size_t i = 0; i < other.size(); i += 8) ++other[i];
    benchmark::ClobberMemory();
}

enum class Caches { warm, cold };

// Times `make`, or the destruction of its result: a frame pays for both, but separately.
template <typename Make>
void measure(benchmark::State& state, Caches caches, bool is_letting_go, const Make& make) {
    for (auto _ : state) {
        const auto now = [] { return std::chrono::steady_clock::now(); };
        if (caches == Caches::cold) leave_the_caches();
        const auto begin = now();
        auto set = make();
        const auto made = now();
        benchmark::DoNotOptimize(set);
        if (is_letting_go && caches == Caches::cold) leave_the_caches();
        const auto end = now();
        set.reset();
        const auto gone = now();
        state.SetIterationTime(Seconds(is_letting_go ? gone - end : made - begin).count());
    }
}

template <typename Make>
void add(const std::string& name, Make make) {
    for (const Caches caches : {Caches::warm, Caches::cold}) {
        for (const bool is_letting_go : {false, true}) {
            const bool is_cold = caches == Caches::cold;
            const std::string full_name =
                name + (is_letting_go ? "/let_go" : "/make") + (is_cold ? "/cold" : "");
            benchmark::RegisterBenchmark(
                full_name.c_str(),
                [=](benchmark::State& state) { measure(state, caches, is_letting_go, make); })
                ->UseManualTime()
                ->Iterations(is_cold ? 100 : 1000)
                ->Unit(benchmark::kMicrosecond);
        }
    }
}

void find_all(benchmark::State& state, const ResidentSet& set, const std::vector<ChunkKey>& keys) {
    for (auto _ : state) {
        std::int64_t sum = 0;
        for (const ChunkKey& key : keys) sum += set.find(key);
        benchmark::DoNotOptimize(sum);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(keys.size()));
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
    using namespace terrane;
    // with one thread alone the standard library counts owners without atomics
    std::thread([] {}).join();

    const Chunks chunks = chunks_around_a_point();
    const auto set = std::make_shared<const ResidentSet>(lattice(), WorldRect{}, chunks, 1);
    const std::vector<float> fades(kChunkCount, 0.5f);
    add("from_scratch", [&] {
        return std::make_shared<const ResidentSet>(lattice(), WorldRect{}, chunks, fades, 2);
    });

    std::vector<ChunkKey> gone;
    Chunks come;
    for (std::size_t i = 0; i < 4; ++i) {
        gone.push_back(chunks[kChunkCount - 1 - 17 * i]->key);
        come.push_back(fake_chunk(chunks[kChunkCount - 8 - 17 * i]->key.child(0)));
    }
    add("4_come_4_gone",
        [&] { return std::make_shared<const ResidentSet>(*set, gone, come, fades, 2, lattice()); });
    add("only_fades", [&] { return std::make_shared<const ResidentSet>(*set, fades, 2); });

    std::vector<ChunkKey> present, absent;
    for (std::size_t i = 0; i < kChunkCount; ++i) {
        const ChunkKey& key = chunks[i * 769 % kChunkCount]->key;  // in no order
        present.push_back(key);
        absent.push_back({key.x + 2 * kHalfSide, key.y, key.level});
    }
    benchmark::RegisterBenchmark("find/present",
                                 [&](benchmark::State& state) { find_all(state, *set, present); });
    benchmark::RegisterBenchmark("find/absent",
                                 [&](benchmark::State& state) { find_all(state, *set, absent); });

    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
