// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "paging/chunk_loader.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/chunk_source.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace terrane {

/// State shared by a loader and its threads. A hanging thread cannot be stopped, only detached. Therefore this state
/// holds everything that threads access, each thread shares ownership of it, and waits for threads have a time limit.
/// Loads are list nodes spliced from list to list: threads take and finish loads without allocating or failing.
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
        bool is_lost = false;  ///< its load timed out; only its own thread still uses this Worker
        bool has_ended = false;
    };
    using WorkerIterator = std::list<Worker>::iterator;

    State(std::shared_ptr<const HeightSource> from, const ThreadLoaderSettings& settings);

    const std::shared_ptr<const HeightSource> source;
    const std::size_t worker_count;
    const Clock::duration timeout;

    std::mutex mutex;                 ///< guards everything below
    std::condition_variable queued;   ///< signals threads
    std::condition_variable changed;  ///< signals the owner
    std::list<Load> queue, finished;
    std::list<Worker> workers;  ///< including lost workers
    std::size_t lost_count = 0;
    bool is_stopping = false;

    /// Chunks of the loads in progress, except for lost workers.
    std::vector<ChunkKey> keys_in_progress();
    // These functions require the lock.
    std::size_t active_count() const { return workers.size() - lost_count; }
    /// Whether a load will finish or time out without a further call.
    bool is_busy() const;
    /// Earliest timeout of the loads in progress and of a load started now.
    Clock::time_point next_timeout() const;
    /// Fails: out_of_memory if the system cannot start a thread
    static Result<void> start_worker(const std::shared_ptr<State>& state);
    /// Reports timed-out loads, detaches their threads, and starts new ones, up to 2 * worker_count threads in all.
    /// Failed starts are retried at the next call.
    static void replace_hung(const std::shared_ptr<State>& state);

private:
    static void work(std::shared_ptr<State> state, WorkerIterator self);
    bool serve(std::unique_lock<std::mutex>& lock, Worker& self);
};

namespace {

constexpr double kLongestTimeout = 1e9;  // seconds, within the range of the clock

}  // namespace

ThreadLoader::State::State(std::shared_ptr<const HeightSource> from,
                           const ThreadLoaderSettings& settings)
    : source(std::move(from)),
      worker_count(static_cast<std::size_t>(settings.worker_count)),
      timeout(std::chrono::duration_cast<Clock::duration>(
          std::chrono::duration<double>(std::min(settings.timeout, kLongestTimeout)))) {}

Result<void> ThreadLoader::State::start_worker(const std::shared_ptr<State>& state) {
    std::list<Worker> started(1);
    try {
        started.front().thread = std::jthread(&State::work, state, started.begin());
    } catch (const std::system_error& trouble) {
        return fail(ErrorCode::out_of_memory,
                    "loader thread " + std::to_string(state->active_count() + 1) + " of " +
                        std::to_string(state->worker_count) + " cannot start: " + trouble.what());
    }
    state->workers.splice(state->workers.end(), started);
    return {};
}

void ThreadLoader::State::replace_hung(const std::shared_ptr<State>& state) {
    const Clock::time_point now = Clock::now();
    for (Worker& worker : state->workers) {
        if (worker.is_lost || worker.load.empty()) continue;
        Load& hung = worker.load.front();
        if (now - hung.begin < state->timeout) continue;
        Load& report = state->finished.emplace_back();
        report.request.key = hung.request.key;
        report.begin = hung.begin;
        report.end = now;
        report.has_timed_out = true;
        hung.stop.request_stop();
        worker.thread.detach();
        worker.is_lost = true;
        ++state->lost_count;
    }
    while (state->active_count() < state->worker_count &&
           state->workers.size() < 2 * state->worker_count && start_worker(state)) {
    }
}

bool ThreadLoader::State::is_busy() const {
    if (!queue.empty() && active_count() > 0) return true;
    return std::any_of(workers.begin(), workers.end(), [](const Worker& worker) {
        return !worker.is_lost && !worker.load.empty();
    });
}

std::vector<ChunkKey> ThreadLoader::State::keys_in_progress() {
    const std::lock_guard lock(mutex);
    std::vector<ChunkKey> keys;
    for (const Worker& worker : workers) {
        if (!worker.is_lost && !worker.load.empty())
            keys.push_back(worker.load.front().request.key);
    }
    return keys;
}

ThreadLoader::State::Clock::time_point ThreadLoader::State::next_timeout() const {
    Clock::time_point next = Clock::now() + timeout;
    for (const Worker& worker : workers) {
        if (!worker.is_lost && !worker.load.empty()) {
            next = std::min(next, worker.load.front().begin + timeout);
        }
    }
    return next;
}

// Takes one load from the queue and makes its chunk with the lock released. Returns false if the thread must end
// because it was replaced or the loader is being destroyed.
bool ThreadLoader::State::serve(std::unique_lock<std::mutex>& lock, Worker& self) {
    self.load.splice(self.load.end(), queue, queue.begin());
    Load& load = self.load.front();
    load.begin = Clock::now();
    lock.unlock();
    load.chunk = internal::load_claimed(load.request.key, std::move(load.request.claim), [&] {
        return make_chunk(*source, load.request.key, load.stop.get_token());
    });
    load.end = Clock::now();
    if (load.chunk) load.bytes_read = (*load.chunk)->bytes();
    lock.lock();
    if (self.is_lost || is_stopping) {
        lock.unlock();
        self.load.clear();
        lock.lock();
        return false;
    }
    if (load.stop.stop_requested()) load.chunk = std::shared_ptr<const Chunk>();
    finished.splice(finished.end(), self.load);
    changed.notify_all();
    return true;
}

void ThreadLoader::State::work(std::shared_ptr<State> state, WorkerIterator self) {
    std::unique_lock lock(state->mutex);
    do {
        state->queued.wait(lock, [&] { return state->is_stopping || !state->queue.empty(); });
    } while (!state->is_stopping && state->serve(lock, *self));
    self->has_ended = true;
    if (self->is_lost) {
        state->workers.erase(self);
        --state->lost_count;
    }
    state->changed.notify_all();
}

namespace {

constexpr int kMostWorkers = 256;
constexpr std::chrono::seconds kJoinTimeout{1};  // in the destructor, for all threads together

double to_seconds(std::chrono::steady_clock::duration duration) {
    return std::chrono::duration<double>(duration).count();
}

}  // namespace

Result<std::unique_ptr<ThreadLoader>> ThreadLoader::create(
    std::shared_ptr<const HeightSource> source, const ThreadLoaderSettings& settings) {
    if (!source) return fail(ErrorCode::invalid_argument, "a loader needs a source");
    TERRANE_TRY(check_range("worker_count", settings.worker_count, 1, kMostWorkers));
    if (!(settings.timeout > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "timeout must be > 0 s, got " + number_text(settings.timeout));
    }
    const auto state = std::make_shared<State>(std::move(source), settings);
    std::unique_ptr<ThreadLoader> loader(new ThreadLoader(state));
    const std::lock_guard lock(state->mutex);
    while (state->active_count() < state->worker_count) {
        TERRANE_TRY(State::start_worker(state));
    }
    return loader;
}

ThreadLoader::ThreadLoader(std::shared_ptr<State> state) : state_(std::move(state)) {}

ThreadLoader::~ThreadLoader() {
    chunks_of(*state_->source).expect_chunks({});  // what was expected is not asked for
    std::list<State::Load> dropped;
    std::unique_lock lock(state_->mutex);
    State& state = *state_;
    state.is_stopping = true;
    dropped.splice(dropped.end(), state.queue);
    dropped.splice(dropped.end(), state.finished);
    for (State::Worker& worker : state.workers) {
        if (!worker.is_lost && !worker.load.empty()) worker.load.front().stop.request_stop();
    }
    state.queued.notify_all();
    state.changed.wait_for(lock, kJoinTimeout, [&] {
        return std::all_of(state.workers.begin(), state.workers.end(),
                           [](const auto& worker) { return worker.is_lost || worker.has_ended; });
    });
    for (State::Worker& worker : state.workers) {
        if (worker.has_ended) {
            worker.thread.join();
        } else if (!worker.is_lost) {
            worker.thread.detach();
        }
    }
}

void ThreadLoader::advance(double) {}  // threads use the steady clock

std::vector<LoadRequest> ThreadLoader::take_queue() {
    std::list<State::Load> taken;
    {
        const std::lock_guard lock(state_->mutex);
        taken.swap(state_->queue);
    }
    std::vector<LoadRequest> requests;
    requests.reserve(taken.size());
    for (State::Load& load : taken) requests.push_back(std::move(load.request));
    return requests;
}

void ThreadLoader::queue(std::vector<LoadRequest> requests) {
    std::list<State::Load> loads;
    // A load that has just started may not have asked the source for its chunk yet.
    std::vector<ChunkKey> keys = state_->keys_in_progress();
    for (LoadRequest& request : requests) {
        keys.push_back(request.key);
        loads.emplace_back().request = std::move(request);
    }
    chunks_of(*state_->source).expect_chunks(keys);
    {
        const std::lock_guard lock(state_->mutex);
        TERRANE_ASSERT(state_->queue.empty(), "the queue must be taken back first");
        state_->queue.splice(state_->queue.end(), loads);
    }
    state_->queued.notify_all();
}

void ThreadLoader::cancel(const ChunkKey& key) {
    const std::lock_guard lock(state_->mutex);
    for (State::Worker& worker : state_->workers) {
        if (worker.is_lost || worker.load.empty()) continue;
        if (worker.load.front().request.key == key) worker.load.front().stop.request_stop();
    }
}

std::vector<FinishedLoad> ThreadLoader::take_finished() {
    std::list<State::Load> taken;
    {
        const std::lock_guard lock(state_->mutex);
        State::replace_hung(state_);
        taken.swap(state_->finished);
    }
    std::vector<FinishedLoad> finished;
    finished.reserve(taken.size());
    for (State::Load& load : taken) {
        const ChunkKey& key = load.request.key;
        if (load.has_timed_out) {
            load.chunk =
                fail(ErrorCode::timed_out, internal::name_of(key) + " was not read in " +
                                               number_text(to_seconds(state_->timeout)) + " s");
        } else if (load.stop.stop_requested()) {
            load.chunk = fail(ErrorCode::cancelled, internal::name_of(key) + " was given up");
        }
        finished.push_back(
            {key, std::move(load.chunk), to_seconds(load.end - load.begin), load.bytes_read});
    }
    std::stable_sort(finished.begin(), finished.end(),
                     [](const FinishedLoad& a, const FinishedLoad& b) { return a.key < b.key; });
    return finished;
}

int ThreadLoader::slots() const { return static_cast<int>(state_->worker_count); }

void ThreadLoader::wait() {
    std::unique_lock lock(state_->mutex);
    for (;;) {
        State::replace_hung(state_);
        if (!state_->finished.empty() || !state_->is_busy()) return;
        state_->changed.wait_until(lock, state_->next_timeout());
    }
}

}  // namespace terrane
