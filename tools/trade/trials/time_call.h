// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>

namespace terrane::tools {

/// Time of one call, nanoseconds: of the calls 0 to count - 1, in as many rounds as take two milliseconds together.
///
/// @param call takes an index and returns a number that depends on its result, so that the call is not removed
template <class Call>
double time_call_ns(std::size_t count, const Call& call) {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::milliseconds kLeast(2);
    if (count == 0) return 0.0;
    double sum = 0.0;
    std::size_t calls = 0;
    const Clock::time_point start = Clock::now();
    Clock::duration taken{};
    while (taken < kLeast) {
        for (std::size_t i = 0; i < count; ++i) sum += static_cast<double>(call(i));
        calls += count;
        taken = Clock::now() - start;
    }
    [[maybe_unused]] static volatile double sink;
    sink = sum;
    return std::chrono::duration<double, std::nano>(taken).count() / static_cast<double>(calls);
}

}  // namespace terrane::tools
