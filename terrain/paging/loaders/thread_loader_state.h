// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/thread_loader.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

namespace terrane {

/// The state that a loader shares with its threads. A thread that hangs cannot be stopped, only detached: so
/// everything that threads access is in here, each thread shares ownership of it, and waits for threads have a
/// limit. A load is a list node that moves from list to list, so that threads neither allocate nor fail when
/// they take or finish one.
struct ThreadLoader::State {
    using Clock = std::chrono::steady_clock;

    struct Load {
        LoadRequest request;
        std::stop_source stop;
        Clock::time_point begin, end;
        Result<std::shared_ptr<const Chunk>> chunk;
        std::size_t bytes_read = 0;
        bool has_timed_out = false;
    };
    struct Worker {
        std::jthread thread;
        std::list<Load> load;  ///< the load in progress, at most one
        bool is_lost = false;  ///< its load has timed out; only the thread itself still uses it
        bool has_ended = false;
    };
    using WorkerIterator = std::list<Worker>::iterator;

    State(std::shared_ptr<const HeightSource> from, const ThreadLoaderSettings& settings);

    const std::shared_ptr<const HeightSource> source;
    const std::size_t worker_count;
    const Clock::duration timeout;

    std::mutex mutex;                 ///< of everything below
    std::condition_variable queued;   ///< signals threads
    std::condition_variable changed;  ///< signals the owner
    std::list<Load> queue, finished;
    std::list<Worker> workers;  ///< lost ones too
    std::size_t lost_count = 0;
    bool is_stopping = false;

    // These require the lock.
    std::size_t active_count() const { return workers.size() - lost_count; }
    /// Whether a load will finish or time out without a further call.
    bool is_busy() const;
    /// Earliest timeout of the loads in progress, and of one that would begin now.
    Clock::time_point next_timeout() const;
    /// Fails: out_of_memory if the system has no thread left
    static Result<void> start_worker(const std::shared_ptr<State>& state);
    /// Reports timed-out loads, detaches their threads, and starts replacements up to the limit. A thread that
    /// cannot be started is tried again at the next call.
    static void replace_hung(const std::shared_ptr<State>& state);

private:
    static void work(std::shared_ptr<State> state, WorkerIterator self);
    bool serve(std::unique_lock<std::mutex>& lock, Worker& self);
};

}  // namespace terrane
