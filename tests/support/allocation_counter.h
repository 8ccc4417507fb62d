// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

// ThreadSanitizer brings operators new of its own that no program may replace.
#if defined(__SANITIZE_THREAD__)
#define TERRANE_COUNTS_ALLOCATIONS 0
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define TERRANE_COUNTS_ALLOCATIONS 0
#endif
#endif
#ifndef TERRANE_COUNTS_ALLOCATIONS
#define TERRANE_COUNTS_ALLOCATIONS 1
#endif

namespace terrane::test {

/// Counts what operator new gives out while it lives. A program that compiles allocation_counter.cpp has
/// its global operators new and delete replaced; link it into a test program of its own.
///
/// What calls malloc() itself is not seen. Under ThreadSanitizer nothing is: see `kCounts`.
class AllocationCounter {
public:
    enum class Of { this_thread, all_threads };
    static constexpr bool kCounts = TERRANE_COUNTS_ALLOCATIONS != 0;

    explicit AllocationCounter(Of of = Of::all_threads);

    /// Since the counter was made.
    std::uint64_t count() const;

private:
    std::uint64_t total() const;

    Of of_;
    std::uint64_t start_;
};

}  // namespace terrane::test
