// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

namespace terrane::internal {

/// Runs loops on several threads, including the calling one; a team of size 1 starts no thread. Allocates only in the
/// constructor.
class WorkerTeam {
public:
    explicit WorkerTeam(int size);
    ~WorkerTeam();
    WorkerTeam(const WorkerTeam&) = delete;
    WorkerTeam& operator=(const WorkerTeam&) = delete;

    int size() const { return static_cast<int>(threads_.size()) + 1; }

    /// Calls job(index, worker) once for every index below count, in any order, and returns when all calls are done.
    /// `worker` is 0 to size() - 1; the calling thread is 0.
    template <typename Job>
    void run(std::size_t count, const Job& job) {
        if (threads_.empty() || count < 2) {
            for (std::size_t i = 0; i < count; ++i) job(i, 0);
            return;
        }
        start(count, &job, [](const void* context, std::size_t index, int worker) {
            (*static_cast<const Job*>(context))(index, worker);
        });
    }

    /// As run(), but calls job(index), and workers take blocks of `block_size` consecutive indices.
    template <typename Job>
    void run_blocks(std::size_t count, std::size_t block_size, const Job& job) {
        run((count + block_size - 1) / block_size, [&](std::size_t block, int) {
            const std::size_t end =
                count - block * block_size < block_size ? count : (block + 1) * block_size;
            for (std::size_t i = block * block_size; i < end; ++i) job(i);
        });
    }

private:
    using Call = void (*)(const void* context, std::size_t index, int worker);
    void start(std::size_t count, const void* context, Call call);
    void take(int worker);
    void serve(const std::stop_token& stop, int worker);

    // written by the calling thread before it increments round_
    std::size_t count_ = 0;
    const void* context_ = nullptr;
    Call call_ = nullptr;
    alignas(64) std::atomic<std::size_t> next_{0};
    alignas(64) std::atomic<std::uint32_t> round_{0};
    alignas(64) std::atomic<std::uint32_t> busy_{0};
    std::vector<std::jthread> threads_;  // last member: threads end before the others are destroyed
};

}  // namespace terrane::internal
