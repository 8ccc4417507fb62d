// SPDX-License-Identifier: MIT
#include "allocation_counter.h"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::uint64_t> count_of_all_threads{0}, bytes_of_all_threads{0};
thread_local std::uint64_t count_of_this_thread = 0, bytes_of_this_thread = 0;

}  // namespace

#if TERRANE_COUNTS_ALLOCATIONS
namespace {

void* try_allocate(std::size_t size, std::size_t alignment) noexcept {
    count_of_all_threads.fetch_add(1, std::memory_order_relaxed);
    bytes_of_all_threads.fetch_add(size, std::memory_order_relaxed);
    ++count_of_this_thread;
    bytes_of_this_thread += size;
    if (size == 0) size = 1;
    // aligned_alloc() requires a multiple of the alignment
    return alignment <= alignof(std::max_align_t)
               ? std::malloc(size)
               : std::aligned_alloc(alignment, (size + alignment - 1) & ~(alignment - 1));
}

void* allocate(std::size_t size, std::size_t alignment) {
    void* const memory = try_allocate(size, alignment);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

}  // namespace

// All overloads, because a sanitizer supplies those that the program does not replace.
void* operator new(std::size_t size) { return allocate(size, 1); }
void* operator new[](std::size_t size) { return allocate(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
    return allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
    return allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    return try_allocate(size, 1);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
    return try_allocate(size, 1);
}
void* operator new(std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
    return try_allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
    return try_allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
#endif

namespace terrane::test {

AllocationCounter::AllocationCounter(Of of) : of_(of), start_(totals()) {}

std::uint64_t AllocationCounter::count() const { return totals().count - start_.count; }

std::uint64_t AllocationCounter::bytes() const { return totals().bytes - start_.bytes; }

AllocationCounter::Totals AllocationCounter::totals() const {
    if (of_ == Of::this_thread) return {count_of_this_thread, bytes_of_this_thread};
    return {count_of_all_threads.load(std::memory_order_relaxed),
            bytes_of_all_threads.load(std::memory_order_relaxed)};
}

}  // namespace terrane::test
