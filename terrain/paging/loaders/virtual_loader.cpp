// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "paging/loaders/claimed_load.h"
#include "paging/loaders/storage_simulation.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/number_text.h>
#include <terrane/terrain/virtual_loader.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

namespace terrane {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kLongest = 1e9;  // seconds
constexpr double kWidestSpread = 16.0;
constexpr int kMostSlots = 1024;

Result<void> check(const VirtualStorage& storage) {
    if (auto ok = check_range("latency", storage.latency, 0.0, kLongest); !ok) return ok;
    if (auto ok = check_range("latency_spread", storage.latency_spread, 0.0, kWidestSpread); !ok) {
        return ok;
    }
    if (!(storage.bandwidth >= 1.0)) {
        return fail(
            ErrorCode::invalid_argument,
            "bandwidth must be at least 1 byte a second, got " + number_text(storage.bandwidth));
    }
    if (auto ok = check_range("slots", storage.slots, 1, kMostSlots); !ok) return ok;
    if (auto ok = check_range("failure_share", storage.failure_share, 0.0, 1.0); !ok) return ok;
    if (auto ok = check_range("hang_share", storage.hang_share, 0.0, 1.0); !ok) return ok;
    if (storage.failure_share + storage.hang_share > 1.0) {
        return fail(ErrorCode::invalid_argument,
                    "failure_share and hang_share together must be at most 1, got " +
                        number_text(storage.failure_share + storage.hang_share));
    }
    if (!(storage.timeout > 0.0 && storage.timeout <= kLongest)) {
        return fail(ErrorCode::invalid_argument, "timeout must be above 0 and at most 1e9 s, got " +
                                                     number_text(storage.timeout));
    }
    return {};
}

}  // namespace

struct VirtualLoader::State {
    internal::StorageSimulation storage;
    MakeChunk make;
    std::deque<LoadRequest> queue;
    std::vector<FinishedLoad> finished;
    double ahead_s = 0.0;  // of the owner's clock, advanced by wait()

    void begin_queued();
    void finish(internal::EndedRequest ended);
    void run_until(double until_s);
};

void VirtualLoader::State::begin_queued() {
    while (!queue.empty() && storage.has_free_slot()) {
        LoadRequest next = std::move(queue.front());
        queue.pop_front();
        storage.begin(std::move(next));
    }
}

void VirtualLoader::State::finish(internal::EndedRequest ended) {
    using internal::StorageOutcome;
    const ChunkKey key = ended.load.key;
    Result<std::shared_ptr<const Chunk>> chunk;
    switch (ended.outcome) {
        case StorageOutcome::delivered:
            chunk =
                internal::load_claimed(key, std::move(ended.load.claim), [&] { return make(key); });
            break;
        case StorageOutcome::failed:
            chunk =
                fail(ErrorCode::io, internal::name_of(key) +
                                        " cannot be read: the storage fails as it was asked to");
            break;
        case StorageOutcome::timed_out:
            chunk = fail(ErrorCode::timed_out, internal::name_of(key) + " was not read in " +
                                                   number_text(storage.settings().timeout) + " s");
            break;
        case StorageOutcome::cancelled:
            chunk = fail(ErrorCode::cancelled, internal::name_of(key) + " was given up");
            break;
    }
    finished.push_back({key, std::move(chunk), ended.seconds, ended.bytes_moved});
    begin_queued();
}

void VirtualLoader::State::run_until(double until_s) {
    while (std::optional<internal::EndedRequest> ended = storage.run_until(until_s)) {
        finish(std::move(*ended));
    }
}

Result<std::unique_ptr<VirtualLoader>> VirtualLoader::create(const VirtualStorage& storage,
                                                             MakeChunk make) {
    if (auto ok = check(storage); !ok) return tl::unexpected(ok.error());
    if (!make)
        return fail(ErrorCode::invalid_argument, "a loader needs a function that makes chunks");
    return std::unique_ptr<VirtualLoader>(new VirtualLoader(std::make_unique<State>(
        State{internal::StorageSimulation(storage), std::move(make), {}, {}, 0.0})));
}

VirtualLoader::VirtualLoader(std::unique_ptr<State> state) : state_(std::move(state)) {}
VirtualLoader::~VirtualLoader() = default;

void VirtualLoader::advance(double time_s) {
    if (std::isfinite(time_s)) state_->run_until(time_s + state_->ahead_s);
}

std::vector<LoadRequest> VirtualLoader::take_queue() {
    std::vector<LoadRequest> requests(std::make_move_iterator(state_->queue.begin()),
                                      std::make_move_iterator(state_->queue.end()));
    state_->queue.clear();
    return requests;
}

void VirtualLoader::queue(std::vector<LoadRequest> requests) {
    TERRANE_ASSERT(state_->queue.empty(), "the queue must be taken back first");
    std::move(requests.begin(), requests.end(), std::back_inserter(state_->queue));
    state_->begin_queued();
}

void VirtualLoader::cancel(const ChunkKey& key) {
    if (auto ended = state_->storage.cancel(key)) state_->finish(std::move(*ended));
}

std::vector<FinishedLoad> VirtualLoader::take_finished() {
    std::vector<FinishedLoad> finished = std::exchange(state_->finished, {});
    std::stable_sort(finished.begin(), finished.end(),
                     [](const FinishedLoad& a, const FinishedLoad& b) { return a.key < b.key; });
    return finished;
}

int VirtualLoader::slots() const { return state_->storage.settings().slots; }

void VirtualLoader::wait() {
    State& state = *state_;
    if (!state.finished.empty() || state.storage.is_idle()) return;
    const double before_s = state.storage.now();
    std::optional<internal::EndedRequest> ended = state.storage.run_until(kInfinite);
    state.ahead_s += state.storage.now() - before_s;
    state.finish(std::move(*ended));
    state.run_until(state.storage.now());
}

}  // namespace terrane
