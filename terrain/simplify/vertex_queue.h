// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// A contraction of a vertex onto a neighbour. The order is total: cost, vertex, target.
struct Candidate {
    double cost = 0.0;         ///< square metres, >= 0
    std::uint32_t vertex = 0;  ///< that goes
    std::uint32_t target = 0;  ///< that it moves onto

    friend bool operator<(const Candidate& a, const Candidate& b) {
        if (a.cost != b.cost) return a.cost < b.cost;
        if (a.vertex != b.vertex) return a.vertex < b.vertex;
        return a.target < b.target;
    }
};

/// A binary heap with at most one candidate for each vertex, which can be replaced.
class VertexQueue {
public:
    explicit VertexQueue(std::size_t vertex_count) : places_(vertex_count, kAbsent) {}

    bool is_empty() const { return heap_.empty(); }
    const Candidate& first() const { return heap_.front(); }

    /// The candidate at a place of the heap: one of the next where the place is small. nullptr beyond the last.
    const Candidate* at(std::size_t place) const {
        return place < heap_.size() ? &heap_[place] : nullptr;
    }
    /// Asks for the memory of a vertex's place.
    void prefetch(std::uint32_t vertex) const { __builtin_prefetch(&places_[vertex]); }
    /// The candidate of a vertex; nullptr where it has none. Valid until the next change.
    const Candidate* find(std::uint32_t vertex) const {
        const std::uint32_t place = places_[vertex];
        return place == kAbsent ? nullptr : &heap_[place];
    }

    /// Adds a candidate, or replaces that of its vertex. Cost: O(log n)
    void set(const Candidate& candidate) {
        std::uint32_t place = places_[candidate.vertex];
        if (place == kAbsent) {
            place = static_cast<std::uint32_t>(heap_.size());
            heap_.push_back(candidate);
        }
        settle(place, candidate);
    }

    /// Takes a vertex's candidate out, where it has one. Cost: O(log n)
    void erase(std::uint32_t vertex) {
        const std::uint32_t place = places_[vertex];
        if (place == kAbsent) return;
        places_[vertex] = kAbsent;
        const Candidate last = heap_.back();
        heap_.pop_back();
        if (place < heap_.size()) settle(place, last);
    }

private:
    static constexpr std::uint32_t kAbsent = ~std::uint32_t{0};

    void put(std::uint32_t place, const Candidate& candidate) {
        heap_[place] = candidate;
        places_[candidate.vertex] = place;
    }

    void settle(std::uint32_t place, const Candidate candidate) {
        while (place > 0 && candidate < heap_[(place - 1) / 2]) {
            put(place, heap_[(place - 1) / 2]);
            place = (place - 1) / 2;
        }
        const auto count = static_cast<std::uint32_t>(heap_.size());
        for (;;) {
            std::uint32_t child = 2 * place + 1;
            if (child >= count) break;
            if (child + 1 < count && heap_[child + 1] < heap_[child]) ++child;
            if (!(heap_[child] < candidate)) break;
            put(place, heap_[child]);
            place = child;
        }
        put(place, candidate);
    }

    std::vector<Candidate> heap_;
    std::vector<std::uint32_t> places_;  // [vertices] in heap_
};

}  // namespace terrane::internal
