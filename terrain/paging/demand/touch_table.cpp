// SPDX-License-Identifier: MIT
#include "paging/demand/touch_table.h"

#include <algorithm>
#include <utility>

namespace terrane::internal {
namespace {

// Unused chunks that may stay cached.
constexpr std::size_t kSpareChunks = 4096;

bool is_ordered_before(const ChunkKey& a, const ChunkKey& b) {
    return a.level != b.level ? a.level < b.level : a < b;
}

}  // namespace

TouchTable::TouchTable(const HeightSource& source, int level)
    : source_(source),
      level_(static_cast<std::uint8_t>(level)),
      index_(64),
      most_chunks_(kSpareChunks) {}

void TouchTable::clear() {
    if (chunks_.size() > most_chunks_) drop_unused();
    for (const Slot slot : touched_) chunks_[slot].time_index = kNever;
    touched_.clear();
    ++round_;
}

TouchTable::Slot TouchTable::add(const ChunkKey& key) {
    Slot parent = kNone;
    if (key.level > 0) {
        parent = index_[bucket_of(key.parent())].slot;
        if (parent == kNone) parent = add(key.parent());
    }
    if (2 * (chunks_.size() + 1) > index_.size()) {
        index_.assign(2 * index_.size(), {});
        for (Slot slot = 0; slot < chunks_.size(); ++slot) {
            index_[bucket_of(chunks_[slot].key)] = {chunks_[slot].key, slot};
        }
    }
    const auto slot = static_cast<Slot>(chunks_.size());
    index_[bucket_of(key)] = {key, slot};
    chunks_.push_back({.key = key, .parent = parent});
    added_.push_back(slot);
    return slot;
}

double TouchTable::find_highest(const ChunkKey& key) const {
    const Lattice& lattice = source_.lattice();
    const LatticePoint corner = lattice.corner(key);
    const std::int64_t side = lattice.chunk_side(key.level);
    const HeightInterval heights =
        source_.interval({lattice.x(corner.x), lattice.y(corner.y), lattice.x(corner.x + side),
                          lattice.y(corner.y + side)});
    return heights.high + lattice.quantum;  // samples are rounded to quanta
}

void TouchTable::touch_ancestors() {
    const std::size_t count = touched_.size();
    for (std::size_t i = 0; i < count; ++i) {
        const TimeIndex time_index = chunks_[touched_[i]].time_index;
        const double end = chunks_[touched_[i]].end;
        Slot ancestor = chunks_[touched_[i]].parent;
        // an ancestor touched as early and as long has propagated already
        while (ancestor != kNone &&
               (chunks_[ancestor].time_index > time_index || chunks_[ancestor].end < end)) {
            touch(ancestor, time_index, end);
            ancestor = chunks_[ancestor].parent;
        }
    }
}

TouchTable::TimeIndex TouchTable::time_index(const ChunkKey& key) const {
    const Slot found = index_[bucket_of(key)].slot;
    return found == kNone ? kNever : chunks_[found].time_index;
}

// Merges from the back, so that each slot of order_ moves once.
void TouchTable::order_added() {
    const auto before = [this](Slot a, Slot b) {
        return is_ordered_before(chunks_[a].key, chunks_[b].key);
    };
    std::sort(added_.begin(), added_.end(), before);
    auto old_end = static_cast<std::ptrdiff_t>(order_.size());
    order_.resize(chunks_.size());
    auto end = static_cast<std::ptrdiff_t>(order_.size());
    for (; !added_.empty(); added_.pop_back()) {
        const auto from =
            std::upper_bound(order_.begin(), order_.begin() + old_end, added_.back(), before);
        std::move_backward(from, order_.begin() + old_end, order_.begin() + end);
        end -= old_end - (from - order_.begin()) + 1;
        old_end = from - order_.begin();
        order_[static_cast<std::size_t>(end)] = added_.back();
    }
}

// Counting sort by time index; order_ is sorted by level and key already, and the sort is stable.
void TouchTable::sort(std::size_t time_count, std::vector<Slot>& slots_out) {
    order_added();
    counts_.assign(time_count + 1, 0);
    for (const Slot slot : touched_) ++counts_[chunks_[slot].time_index + 1];
    for (std::size_t i = 0; i < time_count; ++i) counts_[i + 1] += counts_[i];
    slots_out.resize(touched_.size());
    for (const Slot slot : order_) {
        const TimeIndex time_index = chunks_[slot].time_index;
        if (time_index != kNever) slots_out[counts_[time_index]++] = slot;
    }
}

void TouchTable::drop_unused() {
    kept_.clear();
    for (const Chunk& chunk : chunks_) {
        if (chunk.last_used_round == round_) kept_.push_back(chunk);
    }
    chunks_.clear();
    touched_.clear();
    order_.clear();
    added_.clear();
    std::fill(index_.begin(), index_.end(), HashEntry{});
    for (const Chunk& chunk : kept_) chunks_[add(chunk.key)].highest = chunk.highest;
    most_chunks_ = 2 * chunks_.size() + kSpareChunks;
}

}  // namespace terrane::internal
