// SPDX-License-Identifier: MIT
#pragma once

#include "block_cache.h"
#include "http_exchange.h"

#include <curl/curl.h>

#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

namespace terrane::internal {

using SharedBytes = std::shared_ptr<const std::vector<std::uint8_t>>;

/// Reads blocks of files over HTTP, on a thread of its own, and keeps the last ones in memory.
///
/// Concurrent calls for one block share its request. Neighbouring blocks in the queue are merged into one request. A
/// failed request is repeated after a delay. A request is stopped when no call waits for its blocks, and none of them
/// is expected. Threads: any number at once
class BlockFetcher {
public:
    /// Starts the thread.
    explicit BlockFetcher(HttpClient client);
    /// Stops all transfers. No call may be running.
    ~BlockFetcher();

    struct Fetched {
        SharedBytes bytes;
        bool is_first = false;  ///< whether no other call had this block after its request
    };
    /// A block that is in memory; null if it is not.
    Fetched find(const BlockKey& key);
    /// Keeps a block in memory.
    void keep(const BlockKey& key, SharedBytes bytes);
    /// Forgets a block.
    void discard(const BlockKey& key);

    /// Reads the blocks `soon` while connections are free, the first ones first, unless they are in memory; the blocks
    /// `later` only in requests for their neighbours, while at most a quarter of the connections are busy. Replaces
    /// what was expected: of those that are expected no more, requests that have delivered no block, and for which no
    /// call waits, are stopped.
    void expect(std::span<const BlockKey> soon, std::span<const BlockKey> later);
    /// Reads blocks, and waits for them.
    /// Fails: io, bad_data; timed_out at the deadline; cancelled after a request to stop
    Result<std::vector<Fetched>> fetch(std::span<const BlockKey> keys, Clock::time_point deadline,
                                       const std::stop_token& stop);
    /// Reads a whole file, which is neither shared nor kept.
    /// Fails: io; timed_out; bad_data if it has more than `most_bytes`
    Result<std::vector<std::uint8_t>> fetch_whole(const std::string& name, std::uint64_t most_bytes,
                                                  Clock::time_point deadline);

    /// Statistics of requests and of blocks in memory.
    HttpStatistics statistics() const;

private:
    struct Wait;
    struct Piece;
    struct Transfer;
    using Pieces = std::vector<std::shared_ptr<Piece>>;

    std::optional<Error> wait_for(Wait& wait, const Pieces& pieces,
                                  std::unique_lock<std::mutex>& lock, const std::stop_token& stop);
    std::shared_ptr<Piece> add_piece(HttpRequest request);
    void leave(const Wait& wait, const Pieces& pieces);
    void remember(const BlockKey& key, const SharedBytes& bytes, bool is_first);
    std::string cannot_read(const Piece& piece, const std::string& cause) const;
    std::string paused(const std::string& name) const;

    // of the thread of the transfers
    void run();
    void start_transfers(Clock::time_point now);
    Pieces merge_neighbours(const std::shared_ptr<Piece>& first, Clock::time_point now) const;
    void stop_unwanted();
    void take(Transfer& transfer, std::span<const std::uint8_t> bytes);
    void complete(Piece& piece);
    void finish(std::list<Transfer>::iterator transfer, const std::optional<HttpFault>& fault);
    void retry_or_fail(const std::shared_ptr<Piece>& piece, const HttpFault& fault,
                       Clock::time_point due);
    void end_slow_transfers(Clock::time_point now);
    void update_counts(Clock::time_point now);
    void count_reply(Transfer& transfer);
    double retry_delay(std::span<const std::shared_ptr<Piece>> pieces, const HttpFault& fault);

    const HttpClient client_;
    CURLM* const multi_;
    mutable std::mutex mutex_;  // of all below, but for transfers_, which is the thread's
    bool is_ending_ = false;
    std::list<std::shared_ptr<Piece>> queue_;            // not requested, in order of arrival
    std::map<BlockKey, std::shared_ptr<Piece>> blocks_;  // pieces that are blocks, requested or not
    std::list<Transfer> transfers_;
    Clock::time_point paused_until_{};    // the server wants no request before
    Clock::time_point expecting_from_{};  // a request failed: none for expected blocks before
    // blocks in memory, the last used one in front
    std::list<std::pair<BlockKey, Fetched>> memory_;
    std::map<BlockKey, std::list<std::pair<BlockKey, Fetched>>::iterator> in_memory_;
    std::uint64_t memory_bytes_ = 0;

    HttpStatistics counts_;
    double busy_seconds_ = 0.0, busy_bytes_ = 0.0;  // of the last seconds in which a transfer ran
    std::optional<Clock::time_point> busy_since_;
    std::minstd_rand random_;
    std::thread thread_;
};

}  // namespace terrane::internal
