// SPDX-License-Identifier: MIT
//
// Bandwidth is shared evenly (fluid model) by all requests past their latency. The
// hash is the finaliser of Steele, Lea and Flood. Fast Splittable Pseudorandom Number Generators.
// OOPSLA 2014 (Stafford's mix 13).
#include "paging/loaders/storage_simulation.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace terrane::internal {
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

// 2^x with the same bits on every machine: the whole part by the exponent, the fraction bit by bit from square
// roots.
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

// Bytes that each transfer has moved since moved_s_.
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
        // the first of equal ones
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
            move_bytes(time_s, next->bytes_left);  // exactly its rest, whatever was rounded
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
