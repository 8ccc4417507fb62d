// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_loader.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <utility>
#include <vector>

namespace terrane::test {

/// The drawn outcome of one request.
struct KnownRequest {
    ErrorCode fate = ErrorCode::invalid_argument;  ///< invalid_argument: delivered
    double seconds = 0.0;                          ///< until its transfer, failure or timeout
};

/// Reference of a VirtualLoader's storage: a simulation in small equal time steps.
class StorageOracle {
public:
    struct End {
        ErrorCode fate = ErrorCode::invalid_argument;
        double begin_s = 0.0;
        double end_s = 0.0;
        double bytes = 0.0;
    };
    using Known = std::function<KnownRequest(const ChunkKey&, int times_begun)>;

    StorageOracle(const VirtualStorage& storage, double step_s, Known known)
        : storage_(storage), step_s_(step_s), known_(std::move(known)) {}

    double now() const { return now_s_; }
    bool is_idle() const { return requests_.empty() && queue_.empty(); }
    /// Last completion of each key.
    const std::map<ChunkKey, End>& ends() const { return ends_; }

    void queue(const std::vector<ChunkKey>& keys) {
        queue_.assign(keys.begin(), keys.end());
        begin_queued();
    }
    void take_queue() { queue_.clear(); }
    void cancel(const ChunkKey& key) {
        for (std::size_t i = 0; i < requests_.size(); ++i) {
            if (requests_[i].key != key) continue;
            end(i, ErrorCode::cancelled);
            break;
        }
        begin_queued();
    }
    void step() {
        const double moving = static_cast<double>(
            std::count_if(requests_.begin(), requests_.end(),
                          [](const Request& request) { return request.is_moving; }));
        for (Request& request : requests_) {
            if (request.is_moving) request.bytes += storage_.bandwidth / moving * step_s_;
        }
        now_s_ += step_s_;
        for (std::size_t i = 0; i < requests_.size();) {
            Request& request = requests_[i];
            if (request.is_moving && request.bytes >= static_cast<double>(Chunk::max_bytes())) {
                end(i, request.known.fate);
            } else if (!request.is_moving && now_s_ >= request.begin_s + request.known.seconds) {
                request.is_moving = request.known.fate == ErrorCode::invalid_argument;
                if (!request.is_moving) end(i, request.known.fate);
            } else {
                ++i;
            }
        }
        begin_queued();
    }

private:
    struct Request {
        ChunkKey key;
        KnownRequest known;
        double begin_s = 0.0;
        bool is_moving = false;
        double bytes = 0.0;
    };

    void begin_queued() {
        while (!queue_.empty() && requests_.size() < static_cast<std::size_t>(storage_.slots)) {
            const ChunkKey key = queue_.front();
            queue_.pop_front();
            requests_.push_back({key, known_(key, begun_[key]++), now_s_});
        }
    }
    void end(std::size_t i, ErrorCode fate) {
        const Request& request = requests_[i];
        ends_[request.key] = {fate, request.begin_s, now_s_, request.bytes};
        requests_.erase(requests_.begin() + static_cast<std::ptrdiff_t>(i));
    }

    VirtualStorage storage_;
    double step_s_;
    Known known_;
    double now_s_ = 0.0;
    std::deque<ChunkKey> queue_;
    std::vector<Request> requests_;
    std::map<ChunkKey, int> begun_;
    std::map<ChunkKey, End> ends_;
};

}  // namespace terrane::test
