// SPDX-License-Identifier: MIT
#include "support/allocation_counter.h"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::uint64_t> of_all_threads{0};
thread_local std::uint64_t of_this_thread = 0;

void* allocate(std::size_t size, std::size_t alignment) {
    of_all_threads.fetch_add(1, std::memory_order_relaxed);
    ++of_this_thread;
    if (size == 0) size = 1;
    // aligned_alloc() wants a multiple of the alignment
    void* memory = alignment <= alignof(std::max_align_t)
                       ? std::malloc(size)
                       : std::aligned_alloc(alignment, (size + alignment - 1) & ~(alignment - 1));
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

}  // namespace

// The other forms of new and delete, those of arrays and those that do not throw, call these.
void* operator new(std::size_t size) { return allocate(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
    return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace terrane::test {

AllocationCounter::AllocationCounter(Of of) : of_(of), start_(total()) {}

std::uint64_t AllocationCounter::count() const { return total() - start_; }

std::uint64_t AllocationCounter::total() const {
    return of_ == Of::this_thread ? of_this_thread : of_all_threads.load(std::memory_order_relaxed);
}

}  // namespace terrane::test
