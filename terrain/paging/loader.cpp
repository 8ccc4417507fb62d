// SPDX-License-Identifier: MIT
#include "loader.h"

#include <algorithm>
#include <new>

namespace terrane::internal {

Result<std::shared_ptr<const Chunk>> load_counted(
    const HeightSource& source, const ChunkKey& key,
    std::shared_ptr<std::atomic<std::size_t>> live_bytes) {
    Result<std::shared_ptr<const Chunk>> made =
        fail(ErrorCode::out_of_memory, "no memory for a chunk");
    try {
        made = make_chunk(source, key);
        if (!made) return made;
        const std::size_t bytes = (*made)->bytes();
        live_bytes->fetch_add(bytes);
        const Chunk* chunk = made->get();
        made = std::shared_ptr<const Chunk>(
            chunk, [owner = *made, live_bytes, bytes](const Chunk*) mutable {
                owner.reset();
                live_bytes->fetch_sub(bytes);
            });
    } catch (const std::bad_alloc&) {
        made = fail(ErrorCode::out_of_memory, "no memory for a chunk");
    }
    return made;
}

Loader::Loader(std::shared_ptr<const HeightSource> source,
               std::shared_ptr<std::atomic<std::size_t>> live_bytes, int worker_count)
    : source_(std::move(source)), live_bytes_(std::move(live_bytes)) {
    for (int i = 0; i < worker_count; ++i) {
        workers_.emplace_back([this](const std::stop_token& stop) { work(stop); });
    }
}

Loader::~Loader() {
    for (std::jthread& worker : workers_) worker.request_stop();
    workers_.clear();
}

void Loader::work(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (queued_.wait(lock, stop, [this] { return !queue_.empty(); })) {
        if (stop.stop_requested()) return;
        const ChunkKey key = queue_.back();
        queue_.pop_back();
        reading_.push_back(key);
        lock.unlock();
        Loaded loaded{key, load_counted(*source_, key, live_bytes_)};
        lock.lock();
        reading_.erase(std::find(reading_.begin(), reading_.end(), key));
        finished_.push_back(std::move(loaded));
        changed_.notify_all();
    }
}

std::size_t Loader::replace_queue(std::vector<ChunkKey> keys) {
    std::size_t dropped = 0;
    {
        const std::lock_guard lock(mutex_);
        for (const ChunkKey& old : queue_) {
            if (std::find(keys.begin(), keys.end(), old) == keys.end()) ++dropped;
        }
        // what was begun since the caller looked is not read twice
        std::erase_if(keys, [this](const ChunkKey& key) {
            return std::find(reading_.begin(), reading_.end(), key) != reading_.end() ||
                   std::any_of(finished_.begin(), finished_.end(),
                               [&](const Loaded& loaded) { return loaded.key == key; });
        });
        std::reverse(keys.begin(), keys.end());
        queue_ = std::move(keys);
    }
    queued_.notify_all();
    return dropped;
}

std::vector<Loaded> Loader::take_finished() {
    std::vector<Loaded> finished;
    {
        const std::lock_guard lock(mutex_);
        finished.swap(finished_);
    }
    std::sort(finished.begin(), finished.end(),
              [](const Loaded& a, const Loaded& b) { return a.key < b.key; });
    return finished;
}

std::vector<ChunkKey> Loader::begun() const {
    const std::lock_guard lock(mutex_);
    std::vector<ChunkKey> keys = reading_;
    for (const Loaded& loaded : finished_) keys.push_back(loaded.key);
    return keys;
}

void Loader::wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock,
                  [this] { return !finished_.empty() || (queue_.empty() && reading_.empty()); });
}

}  // namespace terrane::internal
