// SPDX-License-Identifier: MIT
//
// The owner's half of an editor: what comes into force in a frame.
#include "edit/editor_state.h"

#include <algorithm>
#include <utility>

namespace terrane {

using internal::ChunkVersion;
using internal::EditedVolumes;
using internal::PreparedChange;

// Requires the lock.
void VolumeEditor::State::start(const ResidentSet& set) {
    for (internal::Change& change : submitted) {
        Start begun{std::move(change), {}};
        for (const ChunkKey& key : begun.change.edit->chunks(volumes.level())) {
            const std::int32_t index = set.find(key);
            if (index == ResidentSet::kNone) continue;
            const std::shared_ptr<const Chunk>& chunk =
                set.chunks()[static_cast<std::size_t>(index)];
            begun.chunks.push_back(chunk);
        }
        queue.push_back(std::move(begun));
    }
    submitted.clear();
}

// Requires the lock.
std::size_t VolumeEditor::State::ready_count(std::size_t most, const ResidentSet& set,
                                             bool splits_batches) {
    std::size_t count = most;
    for (std::size_t i = 0; i < count; ++i) {
        if (prepared[i]->is_completing) count = i;
    }
    for (bool is_cut = true; is_cut;) {
        is_cut = false;
        std::map<ChunkKey, std::pair<std::size_t, std::size_t>> touches;  // first and last change
        for (std::size_t i = 0; i < count; ++i) {
            for (const ChunkKey& key : prepared[i]->touched) {
                touches.try_emplace(key, i, i).first->second.second = i;
            }
        }
        const PreparedChange* incomplete = nullptr;
        Completion completion;
        for (const auto& [key, of] : touches) {
            const auto& [first, last] = of;
            PreparedChange& change = *prepared[last];
            const std::int32_t index = set.find(key);
            if (index == ResidentSet::kNone || change.chunks.contains(key)) continue;
            const bool comes_later =
                !splits_batches && change.change.number < batch_end &&
                std::ranges::find(change.deferred, key) != change.deferred.end();
            if (incomplete == nullptr && !change.is_completing && !comes_later) {
                incomplete = &change;
                completion.change = prepared[last];
            }
            if (incomplete == &change) {
                completion.chunks.push_back(set.chunks()[static_cast<std::size_t>(index)]);
            }
            count = std::min(count, first);
            is_cut = true;
        }
        if (incomplete != nullptr) {
            completion.change->is_completing = true;
            completions.push_back(std::move(completion));
        }
    }
    return count;
}

// Called without the lock: the first prepared changes are nobody else's while they are not being completed.
bool VolumeEditor::State::switch_to(std::size_t count, Pager* pager, const ResidentSet& set) {
    std::vector<std::shared_ptr<PreparedChange>> changes;
    {
        const Lock lock(mutex);
        changes.assign(prepared.begin(), prepared.begin() + static_cast<std::ptrdiff_t>(count));
    }
    std::map<ChunkKey, PreparedChange*> last;
    for (const auto& change : changes) {
        for (const ChunkKey& key : change->touched) last[key] = change.get();
    }
    std::vector<ChunkKey> touched;
    std::vector<std::shared_ptr<const Chunk>> chunks;
    std::vector<std::shared_ptr<const Chunk>> old;
    std::vector<EditedVolumes::NewVersion> versions;
    for (const auto& [key, change] : last) {
        touched.push_back(key);
        versions.push_back({key, change->versions.at(key), 0});
        const auto chunk = change->chunks.find(key);
        if (chunk == change->chunks.end()) continue;
        chunks.push_back(chunk->second);
        if (const std::int32_t index = set.find(key); index != ResidentSet::kNone)
            old.emplace_back(set.chunks()[static_cast<std::size_t>(index)]);
        versions.back().chunk_bytes = chunk->second->bytes();
    }
    const std::uint32_t number = changes.back()->change.number;
    std::vector<std::shared_ptr<const internal::ChunkTiles>> tiles;
    const auto bring_up_to_date = [&] { tiles = edited.switch_to(versions, number); };
    if (pager == nullptr) {
        bring_up_to_date();
    } else if (!pager->replace(chunks, touched, bring_up_to_date)) {
        return false;
    }
    for (const auto& change : changes) {
        const internal::Change& of = change->change;
        for (const ChunkKey& key : change->touched) unsaved[key] = of.number;
        if (!log) continue;
        internal::LogRecord record{of.number, 0, std::nullopt};
        if (of.is_undo) {
            record.undone = of.edit->number;
        } else {
            record.operation = of.edit->operation;
        }
        files->add_position(of.number, log->add(std::move(record)));
    }
    const Lock lock(mutex);
    prepared.erase(prepared.begin(), prepared.begin() + static_cast<std::ptrdiff_t>(count));
    if (settings.worker_count > 0) {
        old_chunks.insert(old_chunks.end(), old.begin(), old.end());
        old_tiles.insert(old_tiles.end(), tiles.begin(), tiles.end());
        old_changes.insert(old_changes.end(), changes.begin(), changes.end());
    }
    return true;
}

std::uint32_t VolumeEditor::State::update(Pager* pager) {
    static const ResidentSet kNothing({}, {}, {}, 0);
    const std::shared_ptr<const ResidentSet> set = pager ? pager->resident() : nullptr;
    const ResidentSet& chunks = set ? *set : kNothing;
    Lock lock(mutex);
    start(chunks);
    const auto make_all = [&] {
        while (settings.worker_count == 0 && work(lock)) {
        }
    };
    make_all();
    if (pager == nullptr) {
        changed.notify_all();
        changed.wait(lock, [this] { return is_idle(); });
    }
    std::size_t count = ready_count(prepared.size(), chunks, false);
    const std::uint64_t failed = counts.failed;
    while (settings.worker_count == 0 && !completions.empty() && counts.failed == failed) {
        make_all();
        count = ready_count(prepared.size(), chunks, false);
    }
    while (count > 0) {
        lock.unlock();
        const bool fits = switch_to(count, pager, chunks);
        lock.lock();
        if (fits) break;
        ++counts.postponed;
        // Where all do not fit at once, the first may.
        count = count == 1 ? 0 : ready_count(1, chunks, true);
    }
    if (!is_idle() || has_free_chunks()) changed.notify_all();
    return edited.number();
}

}  // namespace terrane
