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

/// What a loader shares with its threads. A thread that hangs cannot be stopped, only left behind: so
/// all that a thread touches is in here, each thread keeps it alive, and none is waited for without
/// limit. A load is a node that moves from list to list: threads allocate nothing for it, and cannot
/// fail at it.
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
        std::list<Load> load;  ///< at most one: what it is making
        bool is_lost = false;  ///< its load has timed out; nobody else looks at it any more
        bool has_ended = false;
    };
    using WorkerPlace = std::list<Worker>::iterator;

    State(std::shared_ptr<const HeightSource> from, const ThreadLoaderSettings& settings);

    const std::shared_ptr<const HeightSource> source;
    const std::size_t worker_count;
    const Clock::duration timeout;

    std::mutex mutex;                 ///< of everything below
    std::condition_variable queued;   ///< threads wait for loads
    std::condition_variable changed;  ///< the owner waits for threads
    std::list<Load> queue, finished;
    std::list<Worker> workers;  ///< lost ones too
    std::size_t lost_count = 0;
    bool is_stopping = false;

    // These require the lock.
    std::size_t active_count() const { return workers.size() - lost_count; }
    /// Whether something will be finished, or time out.
    bool is_busy() const;
    /// When the first of the loads under way times out, or one that would begin at once.
    Clock::time_point next_timeout() const;
    /// Fails: out_of_memory where the system has no thread left
    static Result<void> start_worker(const std::shared_ptr<State>& state);
    /// Reports loads that take too long, and starts as many threads as are missing and may be there.
    /// One that cannot start is tried again the next time.
    static void replace_hung(const std::shared_ptr<State>& state);

private:
    static void work(std::shared_ptr<State> state, WorkerPlace self);
    bool serve(std::unique_lock<std::mutex>& lock, Worker& self);
};

}  // namespace terrane
