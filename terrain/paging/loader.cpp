// SPDX-License-Identifier: MIT
#include "loader.h"

#include <algorithm>
#include <new>
#include <utility>

namespace terrane::internal {

Result<std::shared_ptr<const Chunk>> load_counted(const HeightSource& source, const ChunkKey& key,
                                                  std::shared_ptr<ByteCount> bytes) {
    Result<std::shared_ptr<const Chunk>> made =
        fail(ErrorCode::out_of_memory, "no memory for a chunk");
    try {
        made = make_chunk(source, key);
        if (made) {
            const std::size_t own = (*made)->bytes();
            const Chunk* chunk = made->get();
            made = std::shared_ptr<const Chunk>(chunk,
                                                [owner = *made, bytes, own](const Chunk*) mutable {
                                                    owner.reset();
                                                    bytes->fetch_sub(own);
                                                });
        }
    } catch (const std::bad_alloc&) {
        made = fail(ErrorCode::out_of_memory, "no memory for a chunk");
    }
    return made;
}

void settle(ByteCount& bytes, const Result<std::shared_ptr<const Chunk>>& loaded) {
    bytes.fetch_sub(Chunk::max_bytes() - (loaded ? (*loaded)->bytes() : 0));
}

Loader::Loader(std::shared_ptr<const HeightSource> source, std::shared_ptr<ByteCount> bytes,
               int worker_count)
    : source_(std::move(source)), bytes_(std::move(bytes)) {
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
        bytes_->fetch_add(Chunk::max_bytes());
        lock.unlock();
        Loaded loaded{key, load_counted(*source_, key, bytes_)};
        lock.lock();
        settle(*bytes_, loaded.chunk);
        reading_.erase(std::find(reading_.begin(), reading_.end(), key));
        finished_.push_back(std::move(loaded));
        changed_.notify_all();
    }
}

std::vector<ChunkKey> Loader::clear_queue() {
    const std::lock_guard lock(mutex_);
    return std::exchange(queue_, {});
}

void Loader::queue(std::vector<ChunkKey> keys) {
    std::reverse(keys.begin(), keys.end());
    {
        const std::lock_guard lock(mutex_);
        queue_ = std::move(keys);
    }
    queued_.notify_all();
}

Loader::Load Loader::load() const {
    const std::lock_guard lock(mutex_);
    return {queue_.size(), reading_.size(), bytes_->load() + queue_.size() * Chunk::max_bytes()};
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
