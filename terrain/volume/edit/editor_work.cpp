// SPDX-License-Identifier: MIT
//
// The worker's half of an editor: changes and the chunks that they need.
#include "edit/editor_state.h"

#include <algorithm>
#include <utility>

namespace terrane {

using internal::Change;
using internal::ChunkVersion;
using internal::PreparedChange;

namespace {
/// More would keep the first of them waiting for long.
constexpr std::size_t kMostOfBatch = 32;
}  // namespace

void VolumeEditor::State::run(const std::stop_token& stop) {
    Lock lock(mutex);
    while (!stop.stop_requested()) {
        if (free_old(lock) || work(lock)) continue;
        changed.wait(lock, stop, [this] {
            return !queue.empty() || !completions.empty() || has_free_chunks();
        });
    }
}

// Requires the lock.
bool VolumeEditor::State::has_free_chunks() const {
    return !old_tiles.empty() || !old_changes.empty() ||
           std::ranges::any_of(old_chunks,
                               [](const auto& chunk) { return chunk.use_count() == 1; });
}

bool VolumeEditor::State::free_old(Lock& lock) {
    if (!has_free_chunks()) return false;
    std::vector<std::shared_ptr<const Chunk>> chunks, held;
    for (auto& chunk : old_chunks)
        (chunk.use_count() == 1 ? chunks : held).push_back(std::move(chunk));
    old_chunks = std::move(held);
    auto tiles = std::exchange(old_tiles, {});
    auto changes = std::exchange(old_changes, {});
    lock.unlock();
    chunks.clear();
    tiles.clear();
    changes.clear();
    lock.lock();
    return true;
}

bool VolumeEditor::State::work(Lock& lock) {
    if (completions.empty() && queue.empty()) return false;
    is_working = true;
    if (!completions.empty()) {
        complete(lock);
    } else {
        prepare(lock);
    }
    is_working = false;
    changed.notify_all();
    return true;
}

// The lock is released while tiles are made.
void VolumeEditor::State::prepare(Lock& lock) {
    auto made = std::make_shared<PreparedChange>();
    made->change = std::move(queue.front().change);
    auto chunks = std::move(queue.front().chunks);
    queue.pop_front();
    const Change& change = made->change;
    if (change.number > batch_end) {
        const std::size_t others = std::min(queue.size(), kMostOfBatch - 1);
        batch_end = others == 0 ? change.number : queue[others - 1].change.number;
    }
    std::erase_if(chunks, [&](const auto& chunk) {
        const bool is_later = std::ranges::any_of(queue, [&](const Start& later) {
            return later.change.number <= batch_end &&
                   std::ranges::any_of(later.chunks,
                                       [&](const auto& other) { return other->key == chunk->key; });
        });
        if (is_later) made->deferred.push_back(chunk->key);
        return is_later;
    });
    made->touched = change.edit->chunks(volumes.level());
    std::map<ChunkKey, ChunkVersion> before;
    for (const ChunkKey& key : made->touched) {
        ChunkVersion& version = before[key];
        auto last = prepared.rbegin();
        while (last != prepared.rend() && !(*last)->versions.contains(key)) ++last;
        version = last != prepared.rend() ? (*last)->versions.at(key) : edited.version_of(key);
    }
    std::map<ChunkKey, ChunkVersion> earlier;
    const bool has_snapshot =
        change.is_undo && !snapshots.empty() && snapshots.back().edit == change.edit;
    if (has_snapshot) {
        earlier = std::move(snapshots.back().before);
        snapshots.pop_back();
    }
    lock.unlock();
    begin(*made, source->heights(), volumes, edited, std::move(before),
          has_snapshot ? &earlier : nullptr);
    for (const auto& chunk : chunks) {
        make_chunk_of(*made, volumes, *chunk);
        if (!made->failure.empty()) break;  // update() asks for it again
    }
    chunks.clear();
    lock.lock();
    if (!made->failure.empty()) {
        ++counts.failed;
        last_failure = made->failure;
    }
    std::deque<Snapshot> old;  // freed without the lock
    if (!change.is_undo) {
        snapshots.push_back({change.edit, std::move(made->before)});
        while (snapshots.size() > static_cast<std::size_t>(settings.undo_depth)) {
            old.push_back(std::move(snapshots.front()));
            snapshots.pop_front();
        }
    }
    made->before.clear();
    prepared.push_back(std::move(made));
    lock.unlock();
    old.clear();
    earlier.clear();
    lock.lock();
}

void VolumeEditor::State::complete(Lock& lock) {
    const Completion wanted = std::move(completions.front());
    completions.pop_front();
    PreparedChange& change = *wanted.change;
    for (const auto& chunk : wanted.chunks) use_latest_tiles(change, chunk->key);
    lock.unlock();
    for (const auto& chunk : wanted.chunks) {
        make_chunk_of(change, volumes, *chunk);
        if (!change.failure.empty()) break;
    }
    lock.lock();
    change.is_completing = false;
    if (change.failure.empty()) {
        counts.completed += wanted.chunks.size();
    } else {
        ++counts.failed;
        last_failure = change.failure;
    }
}

// Of those held anywhere that are a beginning of the change's own.
void VolumeEditor::State::use_latest_tiles(PreparedChange& change, const ChunkKey& key) const {
    ChunkVersion& version = change.versions.at(key);
    const auto consider = [&version](const ChunkVersion& other) {
        if (other.is_made() && begins_with(version.list(), other.list()) &&
            (!version.tiles || other.tile_edits > version.tile_edits)) {
            version.tiles = other.tiles;
            version.tile_edits = other.tile_edits;
        }
    };
    consider(edited.version_of(key));
    for (const auto& earlier : prepared) {
        const auto found = earlier->versions.find(key);
        if (earlier->change.number < change.change.number && found != earlier->versions.end())
            consider(found->second);
    }
}

}  // namespace terrane
