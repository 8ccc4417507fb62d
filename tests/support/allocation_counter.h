// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace terrane::test {

/// Counts what operator new gives out while it lives. A program that compiles allocation_counter.cpp has
/// its global operators new and delete replaced; link it into a test program of its own.
///
/// What calls malloc() itself is not seen.
class AllocationCounter {
public:
    enum class Of { this_thread, all_threads };

    explicit AllocationCounter(Of of = Of::all_threads);

    /// Since the counter was made.
    std::uint64_t count() const;

private:
    std::uint64_t total() const;

    Of of_;
    std::uint64_t start_;
};

}  // namespace terrane::test
