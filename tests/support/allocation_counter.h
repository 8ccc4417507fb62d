// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

// ThreadSanitizer provides its own operator new, which a program cannot replace.
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

/// Counts calls of operator new and the bytes they request during its lifetime. Linking allocation_counter.cpp replaces
/// the program's global operators new and delete, so only separate test programs do.
///
/// Direct calls of malloc() are not counted. Under ThreadSanitizer nothing is counted: see `kCounts`.
class AllocationCounter {
public:
    enum class Of { this_thread, all_threads };
    static constexpr bool kCounts = TERRANE_COUNTS_ALLOCATIONS != 0;

    explicit AllocationCounter(Of of = Of::all_threads);

    /// Calls since construction.
    std::uint64_t count() const;
    /// Bytes requested since construction, freed or not.
    std::uint64_t bytes() const;

private:
    struct Totals {
        std::uint64_t count = 0, bytes = 0;
    };
    Totals totals() const;

    Of of_;
    Totals start_;
};

}  // namespace terrane::test
