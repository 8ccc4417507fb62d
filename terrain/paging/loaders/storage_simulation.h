// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/virtual_loader.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace terrane::internal {

/// How a request to the simulated storage ends.
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
    double seconds = 0.0;  ///< from its beginning to its end
    std::size_t bytes_moved = 0;
};

/// Discrete-event simulation of storage on a virtual clock. Events: the end of a latency, of a transfer, and the
/// timeout of a request that hangs. Nothing is computed between events, so that the step size of the clock
/// changes no bit. Simultaneous events are processed in the order in which their requests began.
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
    /// Advances to the next completion of a request, or to `until_s` if none completes by then; the clock
    /// never goes back. Requires a pending request where `until_s` is infinite.
    std::optional<EndedRequest> run_until(double until_s);
    /// Cancels the first request for a key now; nothing if there is none.
    std::optional<EndedRequest> cancel(const ChunkKey& key);

private:
    struct Request {
        LoadRequest load;
        StorageOutcome fate = StorageOutcome::delivered;
        double begin_s = 0.0;
        double wait_end_s = 0.0;  // of its latency, or its timeout
        bool is_moving = false;
        double bytes_left = 0.0;
    };
    /// The requests whose bytes are being transferred.
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
    double moved_s_ = 0.0;                     // time that bytes_left refers to
    std::vector<Request> requests_;            // in order of begin()
    std::map<ChunkKey, std::uint64_t> begun_;  // how many times each
};

}  // namespace terrane::internal
