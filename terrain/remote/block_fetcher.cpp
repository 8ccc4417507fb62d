// SPDX-License-Identifier: MIT
#include "block_fetcher.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <new>
#include <utility>

namespace terrane::internal {
namespace {

/// Longest time for which a server can hold back all requests: its wish may be an error of a proxy.
constexpr double kLongestPause = 300.0;
/// Longest sleep of the thread while transfers run, because it looks for stalls.
constexpr double kLongestSleep = 0.1;
/// Seconds of transfers over which the bandwidth is measured.
constexpr double kBandwidthSeconds = 2.0;

CURLM* make_multi(int connection_count) {
    CURLM* const multi = curl_multi_init();
    if (multi == nullptr) throw std::bad_alloc();
    curl_multi_setopt(multi, CURLMOPT_MAXCONNECTS, static_cast<long>(connection_count));
    return multi;
}

double seconds_between(Clock::time_point begin, Clock::time_point end) {
    return std::chrono::duration<double>(end - begin).count();
}

}  // namespace

/// A call that waits.
struct BlockFetcher::Wait {
    Clock::time_point deadline;
    std::size_t missing = 0;  // pieces that are not complete
    std::optional<Error> error;
    std::condition_variable_any changed;
};

/// A block, or a whole file, that is wanted.
struct BlockFetcher::Piece {
    HttpRequest request;
    bool is_block = false;
    std::vector<std::uint8_t> bytes;  // received so far; of the thread of the transfers
    SharedBytes result;               // when complete
    std::vector<Wait*> waits;         // calls that want it
    Clock::time_point due{};          // not requested before
    int tries = 0;                    // failed requests
    std::string last_cause;           // of the last one
    bool is_requested = false;
    bool is_expected = false;
    bool is_later = false;  // if no call waits, requested only with a neighbour

    bool is_unwanted() const { return waits.empty() && !is_expected; }

    BlockKey key() const {
        return {request.name, *request.file_bytes, request.offset, request.bytes};
    }
    std::uint64_t end() const { return request.offset + request.bytes; }
};

/// A request that is running.
struct BlockFetcher::Transfer {
    Pieces pieces;              // neighbours, in order
    std::size_t next = 0;       // the piece to which the next byte belongs
    std::uint64_t counted = 0;  // bytes that statistics include
    bool is_counted = false;    // whether statistics include its reply
    std::unique_ptr<HttpExchange> exchange;
};

BlockFetcher::BlockFetcher(HttpClient client)
    : client_(std::move(client)),
      multi_(make_multi(client_.settings().connection_count)),
      random_(std::random_device{}()),
      thread_([this] { run(); }) {}

BlockFetcher::~BlockFetcher() {
    {
        const std::lock_guard lock(mutex_);
        is_ending_ = true;
        curl_multi_wakeup(multi_);
    }
    thread_.join();
}

BlockFetcher::Fetched BlockFetcher::find(const BlockKey& key) {
    const std::lock_guard lock(mutex_);
    const auto found = in_memory_.find(key);
    if (found == in_memory_.end()) return {};
    ++counts_.memory_hits;
    memory_.splice(memory_.begin(), memory_, found->second);
    Fetched& block = memory_.front().second;
    return {block.bytes, std::exchange(block.is_first, false)};
}

void BlockFetcher::keep(const BlockKey& key, SharedBytes bytes) {
    const std::lock_guard lock(mutex_);
    remember(key, bytes, false);
}

void BlockFetcher::discard(const BlockKey& key) {
    const std::lock_guard lock(mutex_);
    const auto found = in_memory_.find(key);
    if (found == in_memory_.end()) return;
    memory_bytes_ -= found->second->second.bytes->size();
    memory_.erase(found->second);
    in_memory_.erase(found);
}

void BlockFetcher::remember(const BlockKey& key, const SharedBytes& bytes, bool is_first) {
    if (in_memory_.contains(key)) return;
    memory_.emplace_front(key, Fetched{bytes, is_first});
    in_memory_.emplace(key, memory_.begin());
    memory_bytes_ += bytes->size();
    while (memory_bytes_ > client_.settings().memory_bytes) {
        memory_bytes_ -= memory_.back().second.bytes->size();
        in_memory_.erase(memory_.back().first);
        memory_.pop_back();
    }
}

std::string BlockFetcher::cannot_read(const Piece& piece, const std::string& cause) const {
    std::string text = "cannot read " + client_.shown(piece.request.name) + ": " + cause;
    if (piece.tries > 1) text += " (" + std::to_string(piece.tries) + " tries)";
    return text;
}

std::string BlockFetcher::paused(const std::string& name) const {
    const double seconds = seconds_between(Clock::now(), paused_until_);
    return "cannot read " + client_.shown(name) +
           ": the server is busy, and wants no request for " + number_text(std::ceil(seconds)) +
           " s";
}

std::shared_ptr<BlockFetcher::Piece> BlockFetcher::add_piece(HttpRequest request) {
    auto piece = std::make_shared<Piece>();
    piece->is_block = request.file_bytes.has_value();
    piece->request = std::move(request);
    queue_.push_back(piece);
    if (piece->is_block) blocks_.emplace(piece->key(), piece);
    return piece;
}

void BlockFetcher::leave(const Wait& wait, const Pieces& pieces) {
    bool is_unwanted = false;
    for (const std::shared_ptr<Piece>& piece : pieces) {
        std::erase(piece->waits, &wait);
        is_unwanted = is_unwanted || (piece->is_unwanted() && !piece->result);
    }
    if (is_unwanted) curl_multi_wakeup(multi_);
}

std::optional<Error> BlockFetcher::wait_for(Wait& wait, const Pieces& pieces,
                                            std::unique_lock<std::mutex>& lock,
                                            const std::stop_token& stop) {
    curl_multi_wakeup(multi_);
    wait.changed.wait_until(lock, stop, wait.deadline,
                            [&] { return wait.missing == 0 || wait.error.has_value(); });
    leave(wait, pieces);
    if (wait.error) return std::move(wait.error);
    if (wait.missing == 0) return std::nullopt;
    const auto late =
        std::ranges::find_if(pieces, [](const auto& piece) { return piece->result == nullptr; });
    const Piece& piece = **late;
    if (stop.stop_requested()) {
        return Error{ErrorCode::cancelled,
                     "reading " + client_.shown(piece.request.name) + " was cancelled"};
    }
    std::string cause =
        "no complete answer within " + number_text(client_.settings().read_timeout) + " s";
    if (!piece.last_cause.empty()) cause += ", last: " + piece.last_cause;
    return Error{ErrorCode::timed_out, cannot_read(piece, cause)};
}

Result<std::vector<BlockFetcher::Fetched>> BlockFetcher::fetch(std::span<const BlockKey> keys,
                                                               Clock::time_point deadline,
                                                               const std::stop_token& stop) {
    std::vector<Fetched> fetched(keys.size());
    Pieces pieces;
    Wait wait;
    wait.deadline = deadline;
    std::unique_lock lock(mutex_);
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const BlockKey& key = keys[i];
        // Another call may have completed the block since this one looked for it.
        if (const auto found = in_memory_.find(key); found != in_memory_.end()) {
            Fetched& block = found->second->second;
            fetched[i] = {block.bytes, std::exchange(block.is_first, false)};
            continue;
        }
        std::shared_ptr<Piece> piece;
        if (const auto same = blocks_.find(key); same != blocks_.end()) {
            piece = same->second;
            // of a block that was only expected, this call is the first
            fetched[i].is_first = piece->waits.empty();
            ++counts_.shared_blocks;
        } else if (deadline < paused_until_) {
            leave(wait, pieces);
            return fail(ErrorCode::io, paused(key.name));
        } else {
            piece = add_piece({.name = key.name,
                               .offset = key.offset,
                               .bytes = key.bytes,
                               .file_bytes = key.file_bytes});
            fetched[i].is_first = true;
        }
        piece->waits.push_back(&wait);
        ++wait.missing;
        pieces.push_back(std::move(piece));
    }
    if (auto error = wait_for(wait, pieces, lock, stop)) return tl::unexpected(*std::move(error));
    std::size_t next = 0;
    for (Fetched& block : fetched) {
        if (block.bytes == nullptr) block.bytes = pieces[next++]->result;
    }
    return fetched;
}

void BlockFetcher::expect(std::span<const BlockKey> soon, std::span<const BlockKey> later) {
    const std::lock_guard lock(mutex_);
    bool has_changed = false;
    for (auto& [key, piece] : blocks_) piece->is_expected = false;
    // Blocks for which calls wait stay in front of the queue; expected blocks follow in the given order.
    std::list<std::shared_ptr<Piece>> expected;
    const auto add = [&](const BlockKey& key, bool is_later) {
        if (in_memory_.contains(key)) return;
        std::shared_ptr<Piece> piece;
        if (const auto same = blocks_.find(key); same != blocks_.end()) {
            piece = same->second;
        } else if (Clock::now() >= std::max(paused_until_, expecting_from_)) {
            piece = add_piece({.name = key.name,
                               .offset = key.offset,
                               .bytes = key.bytes,
                               .file_bytes = key.file_bytes});
            has_changed = true;
        } else {
            return;
        }
        has_changed = has_changed || (piece->is_later && !is_later);
        piece->is_expected = true;
        piece->is_later = is_later;
        if (piece->is_requested || !piece->waits.empty()) return;
        const auto queued = std::ranges::find(queue_, piece);
        if (queued != queue_.end()) expected.splice(expected.end(), queue_, queued);
    };
    for (const BlockKey& key : soon) add(key, false);
    for (const BlockKey& key : later) add(key, true);
    queue_.splice(queue_.end(), expected);
    const bool has_unwanted =
        std::ranges::any_of(blocks_, [](const auto& block) { return block.second->is_unwanted(); });
    if (has_changed || has_unwanted) curl_multi_wakeup(multi_);
}

Result<std::vector<std::uint8_t>> BlockFetcher::fetch_whole(const std::string& name,
                                                            std::uint64_t most_bytes,
                                                            Clock::time_point deadline) {
    Wait wait;
    wait.deadline = deadline;
    wait.missing = 1;
    std::unique_lock lock(mutex_);
    if (deadline < paused_until_) return fail(ErrorCode::io, paused(name));
    const Pieces pieces{add_piece({.name = name, .bytes = most_bytes, .file_bytes = {}})};
    pieces[0]->waits.push_back(&wait);
    if (auto error = wait_for(wait, pieces, lock, {})) return tl::unexpected(*std::move(error));
    return *pieces[0]->result;
}

HttpStatistics BlockFetcher::statistics() const {
    const std::lock_guard lock(mutex_);
    HttpStatistics statistics = counts_;
    if (busy_seconds_ > 0.0) statistics.bandwidth = busy_bytes_ / busy_seconds_;
    return statistics;
}

void BlockFetcher::run() {
    // Signals are for the program's threads. OpenSSL raises SIGPIPE where a server has closed its connection.
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
    for (;;) {
        double sleep = 3600.0;
        {
            const std::lock_guard lock(mutex_);
            if (is_ending_) break;
            const Clock::time_point now = Clock::now();
            update_counts(now);
            stop_unwanted();
            end_slow_transfers(now);
            start_transfers(now);
            update_counts(now);  // from the start of the first transfer
            for (const std::shared_ptr<Piece>& piece : queue_) {
                const Clock::time_point due = std::max(piece->due, paused_until_);
                if (due > now) sleep = std::min(sleep, seconds_between(now, due));
            }
            if (!transfers_.empty()) {
                sleep = std::min({sleep, kLongestSleep, client_.settings().stall_timeout});
            }
        }
        // rounded up, so that a piece is due when the thread wakes
        curl_multi_poll(multi_, nullptr, 0, static_cast<int>(sleep * 1000.0) + 1, nullptr);
        int running = 0;
        curl_multi_perform(multi_, &running);
        int left = 0;
        while (const CURLMsg* const message = curl_multi_info_read(multi_, &left)) {
            if (message->msg != CURLMSG_DONE) continue;
            const CURLcode code = message->data.result;
            const auto done = std::ranges::find_if(transfers_, [&](const Transfer& transfer) {
                return transfer.exchange->handle() == message->easy_handle;
            });
            const std::optional<HttpFault> fault = done->exchange->finish(code);
            const std::lock_guard lock(mutex_);
            finish(done, fault);
        }
    }
    for (Transfer& transfer : transfers_) {
        curl_multi_remove_handle(multi_, transfer.exchange->handle());
    }
    transfers_.clear();
    curl_multi_cleanup(multi_);
}

void BlockFetcher::stop_unwanted() {
    const auto is_unwanted = [](const std::shared_ptr<Piece>& piece) {
        return piece->is_unwanted();
    };
    for (auto piece = queue_.begin(); piece != queue_.end();) {
        if (is_unwanted(*piece)) {
            if ((*piece)->is_block) blocks_.erase((*piece)->key());
            piece = queue_.erase(piece);
        } else {
            ++piece;
        }
    }
    for (auto transfer = transfers_.begin(); transfer != transfers_.end();) {
        // One that has delivered a block delivers its neighbours too: another connection would cost more.
        if (transfer->next > 0 || !std::ranges::all_of(transfer->pieces, is_unwanted)) {
            ++transfer;
            continue;
        }
        for (const std::shared_ptr<Piece>& piece : transfer->pieces) {
            if (piece->is_block) blocks_.erase(piece->key());
        }
        ++counts_.cancelled;
        curl_multi_remove_handle(multi_, transfer->exchange->handle());
        transfer = transfers_.erase(transfer);
    }
}

BlockFetcher::Pieces BlockFetcher::merge_neighbours(const std::shared_ptr<Piece>& first,
                                                    Clock::time_point now) const {
    Pieces pieces{first};
    if (!first->is_block) return pieces;
    // While requests are many, the bandwidth is the limit: blocks that can wait would delay others.
    const auto quarter = static_cast<std::size_t>(client_.settings().connection_count) / 4;
    const bool may_add_later = transfers_.size() <= quarter;
    std::uint64_t bytes = first->request.bytes;
    const auto add = [&](const std::shared_ptr<Piece>& piece, bool is_neighbour, bool in_front) {
        const bool is_unasked = piece->is_later && piece->waits.empty();
        if (!is_neighbour || piece->is_requested || piece->due > now ||
            (is_unasked && !may_add_later) || piece->request.name != first->request.name ||
            piece->request.file_bytes != first->request.file_bytes ||
            bytes + piece->request.bytes > client_.settings().request_bytes) {
            return false;
        }
        bytes += piece->request.bytes;
        pieces.insert(in_front ? pieces.begin() : pieces.end(), piece);
        return true;
    };
    const auto place = blocks_.find(first->key());
    for (auto before = place; before != blocks_.begin();) {
        const std::shared_ptr<Piece>& piece = (--before)->second;
        if (!add(piece, piece->end() == pieces.front()->request.offset, true)) break;
    }
    for (auto after = std::next(place); after != blocks_.end(); ++after) {
        const std::shared_ptr<Piece>& piece = after->second;
        if (!add(piece, piece->request.offset == pieces.back()->end(), false)) break;
    }
    return pieces;
}

void BlockFetcher::start_transfers(Clock::time_point now) {
    const auto most = static_cast<std::size_t>(client_.settings().connection_count);
    if (now < paused_until_) return;
    // Blocks that are only expected leave connections for calls that wait.
    const std::size_t most_expected = std::max<std::size_t>(most - most / 4, 1);
    while (transfers_.size() < most) {
        const auto is_due = [&](const auto& piece) { return piece->due <= now; };
        auto next = std::ranges::find_if(
            queue_, [&](const auto& piece) { return is_due(piece) && !piece->waits.empty(); });
        if (next == queue_.end() && transfers_.size() < most_expected) {
            next = std::ranges::find_if(
                queue_, [&](const auto& piece) { return is_due(piece) && !piece->is_later; });
        }
        if (next == queue_.end()) return;
        Pieces pieces = merge_neighbours(*next, now);
        Transfer& transfer = transfers_.emplace_back();
        transfer.pieces = std::move(pieces);
        HttpRequest request = transfer.pieces.front()->request;
        if (request.file_bytes) request.bytes = transfer.pieces.back()->end() - request.offset;
        for (const std::shared_ptr<Piece>& piece : transfer.pieces) {
            piece->is_requested = true;
            piece->bytes.clear();
            if (piece->is_block) piece->bytes.reserve(piece->request.bytes);
        }
        std::erase_if(queue_, [](const auto& piece) { return piece->is_requested; });
        transfer.exchange = std::make_unique<HttpExchange>(
            client_, std::move(request),
            [this, &transfer](std::span<const std::uint8_t> bytes) { take(transfer, bytes); });
        ++counts_.requests;
        curl_multi_add_handle(multi_, transfer.exchange->handle());
    }
}

void BlockFetcher::take(Transfer& transfer, std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
        Piece& piece = *transfer.pieces[transfer.next];
        const std::uint64_t count =
            piece.is_block
                ? std::min<std::uint64_t>(piece.request.bytes - piece.bytes.size(), bytes.size())
                : bytes.size();
        piece.bytes.insert(piece.bytes.end(), bytes.begin(),
                           bytes.begin() + static_cast<std::ptrdiff_t>(count));
        bytes = bytes.subspan(count);
        if (!piece.is_block || piece.bytes.size() < piece.request.bytes) continue;
        // Before calls see the block, so that statistics include it.
        const std::lock_guard lock(mutex_);
        update_counts(Clock::now());
        count_reply(transfer);
        ++transfer.next;
        complete(piece);
    }
}

void BlockFetcher::complete(Piece& piece) {
    piece.result = std::make_shared<const std::vector<std::uint8_t>>(std::move(piece.bytes));
    if (piece.is_block) {
        remember(piece.key(), piece.result, piece.waits.empty());
        blocks_.erase(piece.key());
    }
    for (Wait* const wait : piece.waits) {
        if (--wait->missing == 0) wait->changed.notify_one();
    }
}

void BlockFetcher::finish(std::list<Transfer>::iterator transfer,
                          const std::optional<HttpFault>& fault) {
    const Clock::time_point now = Clock::now();
    update_counts(now);
    const auto rest = std::span(transfer->pieces).subspan(transfer->next);
    if (fault) {
        ++(counts_.failures.*(fault->kind));
        const std::size_t queued = queue_.size();
        const Clock::time_point due = now + to_duration(retry_delay(rest, *fault));
        if (fault->retry_in) paused_until_ = std::max(paused_until_, due);
        const double longest = client_.settings().longest_retry_delay;
        expecting_from_ = std::max({expecting_from_, due, now + to_duration(longest)});
        for (const std::shared_ptr<Piece>& piece : rest) retry_or_fail(piece, *fault, due);
        if (queue_.size() > queued) ++counts_.retries;
    } else {
        count_reply(*transfer);
        for (const std::shared_ptr<Piece>& piece : rest) complete(*piece);
    }
    curl_multi_remove_handle(multi_, transfer->exchange->handle());
    transfers_.erase(transfer);
}

double BlockFetcher::retry_delay(std::span<const std::shared_ptr<Piece>> pieces,
                                 const HttpFault& fault) {
    const HttpSettings& settings = client_.settings();
    int tries = 0;
    for (const std::shared_ptr<Piece>& piece : pieces) tries = std::max(tries, piece->tries);
    double delay = settings.first_retry_delay;
    for (int i = 0; i < tries && delay < settings.longest_retry_delay; ++i) delay *= 2.0;
    // Up to a quarter more or less, so that clients which failed together do not come back together.
    const double share = static_cast<double>(random_() % 1024) / 1024.0;
    delay = std::min(delay, settings.longest_retry_delay) * (0.75 + 0.5 * share);
    return std::max(delay, std::min(fault.retry_in.value_or(0.0), kLongestPause));
}

void BlockFetcher::retry_or_fail(const std::shared_ptr<Piece>& piece, const HttpFault& fault,
                                 Clock::time_point due) {
    ++piece->tries;
    piece->last_cause = fault.cause;
    if (fault.retry_in) {
        piece->last_cause += ", to be retried after " + number_text(*fault.retry_in) + " s";
    }
    piece->due = due;
    bool is_in_time = false;  // for one of the waiting calls
    for (const Wait* const wait : piece->waits) {
        is_in_time = is_in_time || due < wait->deadline;
    }
    if (fault.is_transient && piece->tries <= client_.settings().retry_count && is_in_time) {
        piece->is_requested = false;
        queue_.push_back(piece);
        return;
    }
    if (piece->is_block) blocks_.erase(piece->key());
    for (Wait* const wait : piece->waits) {
        if (!wait->error) wait->error = Error{fault.code, cannot_read(*piece, piece->last_cause)};
        wait->changed.notify_one();
    }
}

void BlockFetcher::end_slow_transfers(Clock::time_point now) {
    for (auto transfer = transfers_.begin(); transfer != transfers_.end();) {
        const auto slow = transfer++;
        if (slow->exchange->has_stalled(now)) finish(slow, slow->exchange->stall_fault());
    }
}

void BlockFetcher::count_reply(Transfer& transfer) {
    const std::optional<double> latency = transfer.exchange->latency();
    if (!latency || std::exchange(transfer.is_counted, true)) return;
    if (transfer.exchange->has_ignored_range()) ++counts_.ignored_ranges;
    constexpr double kNewest = 0.125;
    counts_.latency += (*latency - counts_.latency) * (counts_.latency > 0.0 ? kNewest : 1.0);
}

void BlockFetcher::update_counts(Clock::time_point now) {
    for (Transfer& transfer : transfers_) {
        const std::uint64_t received = transfer.exchange->received() - transfer.counted;
        transfer.counted += received;
        counts_.bytes += received;
        busy_bytes_ += static_cast<double>(received);
    }
    if (busy_since_) busy_seconds_ += seconds_between(*busy_since_, now);
    busy_since_ = transfers_.empty() ? std::nullopt : std::optional(now);
    if (busy_seconds_ > kBandwidthSeconds) {
        busy_seconds_ *= 0.5;
        busy_bytes_ *= 0.5;
    }
}

}  // namespace terrane::internal
