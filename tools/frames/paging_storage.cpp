// SPDX-License-Identifier: MIT
#include "frames/paging_storage.h"

#include <terrane/terrain/chunk.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

namespace terrane::tools {

std::vector<std::string> paging_choice_names() {
    return {name_of(PagingChoice::deadline), name_of(PagingChoice::distance),
            name_of(PagingChoice::oracle)};
}

const char* name_of(PagingChoice choice) {
    switch (choice) {
        case PagingChoice::deadline:
            return "deadline";
        case PagingChoice::distance:
            return "distance";
        case PagingChoice::oracle:
            return "oracle";
    }
    return "";
}

PagingPolicy pager_policy(PagingChoice choice) {
    return choice == PagingChoice::distance ? PagingPolicy::distance : PagingPolicy::deadline;
}

ChunkCache::ChunkCache(std::shared_ptr<const HeightSource> source, std::size_t most_bytes)
    : source_(std::move(source)), most_bytes_(most_bytes) {}

Result<std::shared_ptr<const Chunk>> ChunkCache::get(const ChunkKey& key) {
    if (std::shared_ptr<const Chunk> chunk = find(key)) return chunk;
    Result<std::shared_ptr<const Chunk>> made = make_chunk(*source_, key);
    if (made) keep(*made);
    return made;
}

std::shared_ptr<const Chunk> ChunkCache::find(const ChunkKey& key) {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(key);
    if (found == entries_.end()) return nullptr;
    turns_.splice(turns_.end(), turns_, found->second.turn);
    return found->second.chunk;
}

void ChunkCache::keep(std::shared_ptr<const Chunk> chunk) {
    const std::size_t bytes = chunk->bytes();
    const ChunkKey key = chunk->key;
    if (bytes > most_bytes_) return;
    const std::lock_guard lock(mutex_);
    if (entries_.contains(key)) return;
    while (bytes_ + bytes > most_bytes_) {
        const auto oldest = entries_.find(turns_.front());
        bytes_ -= oldest->second.chunk->bytes();
        entries_.erase(oldest);
        turns_.pop_front();
    }
    bytes_ += bytes;
    entries_.emplace(key, Entry{std::move(chunk), turns_.insert(turns_.end(), key)});
}

// Sources: A. K. Parekh, R. G. Gallager. A generalized processor sharing approach to flow control in
//          integrated services networks. 1993 (virtual time: one counter of the
//          service per transfer serves all transfers).

namespace {

using Clock = std::chrono::steady_clock;

double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

Clock::time_point time_point(double seconds) {
    return Clock::time_point(
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
}

}  // namespace

void FairPipe::advance(double now) {
    while (!ends_.empty() && next_end() <= now) {
        time_ = next_end();
        share_ = *ends_.begin();
        ends_.erase(ends_.begin());
    }
    if (!ends_.empty()) {
        share_ += (now - time_) * bandwidth_ / static_cast<double>(ends_.size());
    }
    time_ = now;
}

double FairPipe::begin(double now, double bytes) {
    advance(now);
    return *ends_.insert(share_ + bytes);
}

bool FairPipe::is_done(double now, double transfer) {
    advance(now);
    return ends_.empty() || *ends_.begin() > transfer;
}

double FairPipe::next_end() const {
    const double left = std::max(0.0, *ends_.begin() - share_);
    return time_ + left * static_cast<double>(ends_.size()) / bandwidth_;
}

void FairPipe::set_bandwidth(double now, double bandwidth) {
    advance(now);
    bandwidth_ = bandwidth;
}

SlowHeights::SlowHeights(std::shared_ptr<const HeightSource> source)
    : ForwardedHeights(std::move(source)), pipe_(speed_.bandwidth) {}

void SlowHeights::set_speed(const StorageSpeed& speed) {
    const std::lock_guard lock(mutex_);
    speed_ = speed;
    pipe_.set_bandwidth(now_s(), speed.bandwidth);
    is_slow_ = speed.is_limited();
    changed_.notify_all();
}

StorageSpeed SlowHeights::speed() const {
    const std::lock_guard lock(mutex_);
    return speed_;
}

void SlowHeights::wait_for_storage() const {
    std::unique_lock lock(mutex_);
    const double asked = now_s();
    while (now_s() < asked + speed_.latency)
        changed_.wait_until(lock, time_point(asked + speed_.latency));
    const double transfer = pipe_.begin(now_s(), static_cast<double>(Chunk::max_bytes()));
    changed_.notify_all();  // the new transfer delays all others
    while (!pipe_.is_done(now_s(), transfer))
        changed_.wait_until(lock, time_point(pipe_.next_end()));
}

Result<void> SlowHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    if (is_slow_) wait_for_storage();
    return heights().sample(grid, heights_out);
}

Result<std::shared_ptr<const Chunk>> SlowHeights::stored_chunk(const ChunkKey& key,
                                                               const std::stop_token& stop) const {
    auto chunk = ForwardedHeights::stored_chunk(key, stop);
    if (chunk && *chunk != nullptr && is_slow_) wait_for_storage();
    return chunk;
}

}  // namespace terrane::tools
