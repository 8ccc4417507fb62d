// SPDX-License-Identifier: MIT
#include "base/worker_team.h"

#include "base/simd_level.h"

namespace terrane::internal {

SimdLevel best_simd_level() {
#if defined(__x86_64__)
    static const SimdLevel level = [] {
        if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
            __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")) {
            return SimdLevel::avx512;
        }
        return __builtin_cpu_supports("avx2") ? SimdLevel::avx2 : SimdLevel::baseline;
    }();
    return level;
#else
    return SimdLevel::baseline;
#endif
}

namespace {

// Number of polls before a worker sleeps. The loops of one update() follow each other within microseconds, and waking a
// thread takes longer.
constexpr int kSpins = 2'000;

}  // namespace

WorkerTeam::WorkerTeam(int size) {
    for (int worker = 1; worker < size; ++worker) {
        threads_.emplace_back([this, worker](const std::stop_token& stop) { serve(stop, worker); });
    }
}

WorkerTeam::~WorkerTeam() {
    for (std::jthread& thread : threads_) thread.request_stop();
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
}

void WorkerTeam::start(std::size_t count, const void* context, Call call) {
    count_ = count;
    context_ = context;
    call_ = call;
    next_.store(0, std::memory_order_relaxed);
    busy_.store(static_cast<std::uint32_t>(threads_.size()), std::memory_order_relaxed);
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
    take(0);
    for (std::uint32_t busy = busy_.load(std::memory_order_acquire); busy != 0;
         busy = busy_.load(std::memory_order_acquire)) {
        std::this_thread::yield();
    }
}

void WorkerTeam::take(int worker) {
    for (std::size_t i = next_.fetch_add(1, std::memory_order_relaxed); i < count_;
         i = next_.fetch_add(1, std::memory_order_relaxed)) {
        call_(context_, i, worker);
    }
}

void WorkerTeam::serve(const std::stop_token& stop, int worker) {
    std::uint32_t seen = 0;
    for (;;) {
        std::uint32_t round = round_.load(std::memory_order_acquire);
        for (int spin = 0; round == seen && spin < kSpins; ++spin) {
            round = round_.load(std::memory_order_acquire);
        }
        while (round == seen) {
            round_.wait(seen, std::memory_order_acquire);
            round = round_.load(std::memory_order_acquire);
        }
        if (stop.stop_requested()) return;
        seen = round;
        take(worker);
        busy_.fetch_sub(1, std::memory_order_release);
    }
}

}  // namespace terrane::internal
