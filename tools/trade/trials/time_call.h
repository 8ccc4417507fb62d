// SPDX-License-Identifier: MIT
#pragma once

#include "trade/table/thread_clock.h"

#include <cstddef>

namespace terrane::tools {

/// Processor time of one call, nanoseconds: of the calls 0 to count - 1, in as many rounds as take two milliseconds
/// together.
///
/// @param call takes an index and returns a number that depends on its result, so that the call is not removed
template <class Call>
double time_call_ns(std::size_t count, const Call& call) {
    constexpr double kLeast = 2e-3;  // seconds
    if (count == 0) return 0.0;
    double sum = 0.0;
    std::size_t calls = 0;
    const double start = thread_seconds();
    double taken = 0.0;
    while (taken < kLeast) {
        for (std::size_t i = 0; i < count; ++i) sum += static_cast<double>(call(i));
        calls += count;
        taken = thread_seconds() - start;
    }
    [[maybe_unused]] static volatile double sink;
    sink = sum;
    return 1e9 * taken / static_cast<double>(calls);
}

}  // namespace terrane::tools
