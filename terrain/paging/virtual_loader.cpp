// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "paging/chunk_loader.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/chunk_loader.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Outcome of a request to the simulated storage.
enum class StorageOutcome {
    delivered,
    failed,
    timed_out,
    cancelled,
};

/// A completed request.
struct EndedRequest {
    LoadRequest load;
    StorageOutcome outcome = StorageOutcome::delivered;
    double seconds = 0.0;  ///< from start to end
    std::size_t bytes_moved = 0;
};

/// Discrete-event simulation of storage on a virtual clock. The events are the end of a latency, the end of a transfer,
/// and the timeout of a hanging request. Nothing is computed between events, so that results are bit-identical for any
/// step size of the clock. Simultaneous events are processed in the order in which their requests started.
///
/// Each delivered request moves Chunk::max_bytes(). Threads: one at a time.
class StorageSimulation {
public:
    /// Requires settings in their ranges.
    explicit StorageSimulation(const VirtualStorage& storage) : storage_(storage) {}

    const VirtualStorage& settings() const { return storage_; }
    double now() const { return now_s_; }
    bool is_idle() const { return requests_.empty(); }
    bool has_free_slot() const {
        return requests_.size() < static_cast<std::size_t>(storage_.slots);
    }

    /// Starts a request now. Requires a free slot.
    void begin(LoadRequest load);
    /// Advances to the next completion of a request, or to `until_s` if none completes by then; the clock never goes
    /// back. Requires a pending request if `until_s` is infinite.
    std::optional<EndedRequest> run_until(double until_s);
    /// Cancels the first request for a key now; returns nothing if there is none.
    std::optional<EndedRequest> cancel(const ChunkKey& key);

private:
    struct Request {
        LoadRequest load;
        StorageOutcome fate = StorageOutcome::delivered;
        double begin_s = 0.0;
        double wait_end_s = 0.0;  // end of its latency, or its timeout
        bool is_moving = false;
        double bytes_left = 0.0;
    };
    /// Summary of the transfers in progress.
    struct Transfers {
        double count = 0.0;
        double least_bytes_left = 0.0;
    };
    using RequestIterator = std::vector<Request>::iterator;

    Transfers find_transfers() const;
    double event_s(const Request& request, const Transfers& transfers) const;
    double bytes_since(double time_s, const Transfers& transfers) const;
    void move_bytes(double until_s, double bytes_each);
    EndedRequest end(RequestIterator request, StorageOutcome outcome);

    VirtualStorage storage_;
    double now_s_ = 0.0;
    double moved_s_ = 0.0;                     // time to which bytes_left refers
    std::vector<Request> requests_;            // in order of begin()
    std::map<ChunkKey, std::uint64_t> begun_;  // number of starts per key
};

// All requests past their latency share the bandwidth evenly (fluid model). The hash is the finaliser of Steele, Lea
// and Flood. Fast Splittable Pseudorandom Number Generators. OOPSLA 2014 (Stafford's mix 13).

namespace {

double full_bytes() { return static_cast<double>(Chunk::max_bytes()); }

std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

// Random numbers of one request, in [0, 1).
class Chance {
public:
    Chance(std::uint64_t seed, const ChunkKey& key, std::uint64_t times_begun) : state_(seed) {
        for (const std::uint64_t part : {std::uint64_t{static_cast<std::uint32_t>(key.x)},
                                         std::uint64_t{static_cast<std::uint32_t>(key.y)},
                                         std::uint64_t{key.level}, times_begun}) {
            state_ = mix(state_ + part + kOdd);
        }
    }
    double next() {
        state_ += kOdd;
        return static_cast<double>(mix(state_) >> 11) * 0x1p-53;
    }

private:
    static constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15u;
    std::uint64_t state_;
};

// 2^x, bit-identical on every machine: the integer part is the exponent; bit k of the fraction is a factor 2^(2^-k).
double power_of_two(double x) {
    const double whole = std::floor(x);
    double rest = x - whole, root = 2.0, power = 1.0;
    for (int bit = 0; bit < 53; ++bit) {
        root = std::sqrt(root);
        rest *= 2.0;
        if (rest >= 1.0) {
            power *= root;
            rest -= 1.0;
        }
    }
    return std::ldexp(power, static_cast<int>(whole));
}

}  // namespace

void StorageSimulation::begin(LoadRequest load) {
    TERRANE_ASSERT(has_free_slot(), "a request needs a free slot");
    Chance chance(storage_.seed, load.key, begun_[load.key]++);
    const double shift = storage_.latency_spread * (2.0 * chance.next() - 1.0);
    const double fate = chance.next();
    Request& request = requests_.emplace_back();
    request.load = std::move(load);
    request.begin_s = now_s_;
    request.wait_end_s = now_s_ + storage_.latency * power_of_two(shift);
    request.bytes_left = full_bytes();
    if (fate < storage_.hang_share) {
        request.fate = StorageOutcome::timed_out;
        request.wait_end_s = now_s_ + storage_.timeout;
    } else if (fate < storage_.hang_share + storage_.failure_share) {
        request.fate = StorageOutcome::failed;
    }
}

StorageSimulation::Transfers StorageSimulation::find_transfers() const {
    Transfers transfers{0.0, full_bytes()};
    for (const Request& request : requests_) {
        if (!request.is_moving) continue;
        transfers.count += 1.0;
        transfers.least_bytes_left = std::min(transfers.least_bytes_left, request.bytes_left);
    }
    return transfers;
}

double StorageSimulation::event_s(const Request& request, const Transfers& transfers) const {
    if (!request.is_moving) return request.wait_end_s;
    return moved_s_ + request.bytes_left * transfers.count / storage_.bandwidth;
}

// Bytes moved by each transfer since moved_s_.
double StorageSimulation::bytes_since(double time_s, const Transfers& transfers) const {
    if (transfers.count == 0.0 || time_s <= moved_s_) return 0.0;
    const double bytes = (time_s - moved_s_) * storage_.bandwidth / transfers.count;
    return std::min(bytes, transfers.least_bytes_left);
}

void StorageSimulation::move_bytes(double until_s, double bytes_each) {
    for (Request& request : requests_) {
        if (request.is_moving) request.bytes_left = std::max(0.0, request.bytes_left - bytes_each);
    }
    moved_s_ = until_s;
}

EndedRequest StorageSimulation::end(RequestIterator request, StorageOutcome outcome) {
    EndedRequest ended{std::move(request->load), outcome, now_s_ - request->begin_s,
                       static_cast<std::size_t>(full_bytes() - request->bytes_left)};
    requests_.erase(request);
    return ended;
}

std::optional<EndedRequest> StorageSimulation::run_until(double until_s) {
    TERRANE_ASSERT(std::isfinite(until_s) || !is_idle(), "nothing would end");
    for (;;) {
        const Transfers transfers = find_transfers();
        // of simultaneous events, the one of the request that started first
        const auto next = std::min_element(requests_.begin(), requests_.end(),
                                           [&](const Request& a, const Request& b) {
                                               return event_s(a, transfers) < event_s(b, transfers);
                                           });
        const double time_s = next == requests_.end() ? until_s : event_s(*next, transfers);
        if (next == requests_.end() || time_s > until_s) {
            now_s_ = std::max(now_s_, until_s);
            return std::nullopt;
        }
        now_s_ = time_s;
        if (next->is_moving) {
            move_bytes(time_s, next->bytes_left);  // exactly what is left, despite rounding
            return end(next, StorageOutcome::delivered);
        }
        if (next->fate != StorageOutcome::delivered) return end(next, next->fate);
        move_bytes(time_s, bytes_since(time_s, transfers));
        next->is_moving = true;
    }
}

std::optional<EndedRequest> StorageSimulation::cancel(const ChunkKey& key) {
    const auto cancelled =
        std::find_if(requests_.begin(), requests_.end(),
                     [&](const Request& request) { return request.load.key == key; });
    if (cancelled == requests_.end()) return std::nullopt;
    if (cancelled->is_moving) move_bytes(now_s_, bytes_since(now_s_, find_transfers()));
    return end(cancelled, StorageOutcome::cancelled);
}

}  // namespace terrane::internal

namespace terrane {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kLongest = 1e9;  // seconds
constexpr double kWidestSpread = 16.0;
constexpr int kMostSlots = 1024;

Result<void> check(const VirtualStorage& storage) {
    TERRANE_TRY(check_range("latency", storage.latency, 0.0, kLongest));
    TERRANE_TRY(check_range("latency_spread", storage.latency_spread, 0.0, kWidestSpread));
    if (!(storage.bandwidth >= 1.0)) {
        return fail(
            ErrorCode::invalid_argument,
            "bandwidth must be at least 1 byte a second, got " + number_text(storage.bandwidth));
    }
    TERRANE_TRY(check_range("slots", storage.slots, 1, kMostSlots));
    TERRANE_TRY(check_range("failure_share", storage.failure_share, 0.0, 1.0));
    TERRANE_TRY(check_range("hang_share", storage.hang_share, 0.0, 1.0));
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
    double ahead_s = 0.0;  // by how much wait() has advanced the storage beyond the owner's clock

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
    TERRANE_TRY(check(storage));
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
