// SPDX-License-Identifier: MIT
#include "trade/table/reference_loop.h"

#include "trade/table/thread_clock.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace terrane::tools {
namespace {

constexpr std::size_t kTableSize = std::size_t{1} << 15;  // of 8 bytes: within the second cache
constexpr int kSteps = 60'000;

using ReferenceTable = std::array<std::uint64_t, kTableSize>;

const ReferenceTable& reference_table() {
    static const std::unique_ptr<const ReferenceTable> table = [] {
        auto made = std::make_unique<ReferenceTable>();
        std::uint64_t state = 1;
        for (std::uint64_t& entry : *made) {
            state = state * 6364136223846793005U + 1442695040888963407U;
            entry = state;
        }
        return made;
    }();
    return *table;
}

}  // namespace

double time_reference_loop() {
    const ReferenceTable& table = reference_table();
    const double start = thread_seconds();
    std::uint64_t hash = 1;
    double sum = 1.0;
    for (int i = 0; i < kSteps; ++i) {
        hash = (hash ^ table[hash >> 49U]) * 0x9E3779B97F4A7C15U;
        sum = sum * 0.999 + static_cast<double>(hash >> 12U) * 0x1p-52;
    }
    const double taken = thread_seconds() - start;
    // Uses the results, so that the loop is not removed; neither is ever negative.
    return sum < 0.0 ? 0.0 : taken;
}

}  // namespace terrane::tools
