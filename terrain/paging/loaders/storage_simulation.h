// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/virtual_loader.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace terrane::internal {

/// How a request to imagined storage ends.
enum class StorageOutcome {
    delivered,
    failed,
    timed_out,
    cancelled,
};

/// A request that storage is done with.
struct EndedRequest {
    LoadRequest load;
    StorageOutcome outcome = StorageOutcome::delivered;
    double seconds = 0.0;  ///< from its beginning to its end
    std::size_t bytes_moved = 0;
};

/// Storage on a virtual clock, from event to event: the end of a latency, of a transfer, of patience with
/// a request that hangs. Between events nothing is computed, so that the steps in which its clock is
/// moved change no bit. Events of one moment are played in the order in which their requests began.
///
/// Each request moves Chunk::max_bytes(). Threads: one at a time.
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

    /// Begins a request now. Requires a free slot.
    void begin(LoadRequest load);
    /// Goes on to the next end of a request, or to a time where none ends up to it; never back. Requires
    /// a request where the time is infinite.
    std::optional<EndedRequest> play(double until_s);
    /// Ends the first request for a key now, where there is one.
    std::optional<EndedRequest> cancel(const ChunkKey& key);

private:
    struct Request {
        LoadRequest load;
        StorageOutcome fate = StorageOutcome::delivered;
        double begin_s = 0.0;
        double turn_s = 0.0;  // when its latency ends, or patience with it
        bool is_moving = false;
        double bytes_left = 0.0;
    };
    struct Moving {
        double count = 0.0;
        double least_bytes_left = 0.0;
    };
    using Place = std::vector<Request>::iterator;

    Moving find_moving() const;
    double event_s(const Request& request, const Moving& moving) const;
    double bytes_since(double time_s, const Moving& moving) const;
    void move_bytes(double until_s, double bytes_each);
    EndedRequest end(Place request, StorageOutcome outcome);

    VirtualStorage storage_;
    double now_s_ = 0.0;
    double moved_s_ = 0.0;                     // when bytes_left was right
    std::vector<Request> requests_;            // in the order of their beginnings
    std::map<ChunkKey, std::uint64_t> begun_;  // how many times
};

}  // namespace terrane::internal
