// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "paging/loaders/claimed_load.h"
#include "paging/loaders/thread_loader_state.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

namespace terrane {
namespace {

constexpr int kMostWorkers = 256;
constexpr std::chrono::seconds kJoinTimeout{1};  // of the destructor, for all threads

double to_seconds(std::chrono::steady_clock::duration duration) {
    return std::chrono::duration<double>(duration).count();
}

}  // namespace

Result<std::unique_ptr<ThreadLoader>> ThreadLoader::create(
    std::shared_ptr<const HeightSource> source, const ThreadLoaderSettings& settings) {
    if (!source) return fail(ErrorCode::invalid_argument, "a loader needs a source");
    if (auto ok = check_range("worker_count", settings.worker_count, 1, kMostWorkers); !ok) {
        return tl::unexpected(ok.error());
    }
    if (!(settings.timeout > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "timeout must be > 0 s, got " + number_text(settings.timeout));
    }
    const auto state = std::make_shared<State>(std::move(source), settings);
    std::unique_ptr<ThreadLoader> loader(new ThreadLoader(state));
    const std::lock_guard lock(state->mutex);
    while (state->active_count() < state->worker_count) {
        if (auto started = State::start_worker(state); !started) {
            return tl::unexpected(started.error());
        }
    }
    return loader;
}

ThreadLoader::ThreadLoader(std::shared_ptr<State> state) : state_(std::move(state)) {}

ThreadLoader::~ThreadLoader() {
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
    for (LoadRequest& request : requests) loads.emplace_back().request = std::move(request);
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
