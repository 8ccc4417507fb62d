// SPDX-License-Identifier: MIT
#include "paging/loaders/thread_loader_state.h"

#include "paging/loaders/claimed_load.h"

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>

namespace terrane {
namespace {

constexpr double kLongestTimeout = 1e9;  // within the range of the clock

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

ThreadLoader::State::Clock::time_point ThreadLoader::State::next_timeout() const {
    Clock::time_point next = Clock::now() + timeout;
    for (const Worker& worker : workers) {
        if (!worker.is_lost && !worker.load.empty()) {
            next = std::min(next, worker.load.front().begin + timeout);
        }
    }
    return next;
}

// Takes one load from the queue and makes its chunk, with the lock released meanwhile. Returns false if the
// thread must end: it was replaced, or the loader is being destroyed.
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

}  // namespace terrane
