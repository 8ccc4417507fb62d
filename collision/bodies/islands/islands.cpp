// SPDX-License-Identifier: MIT
#include "bodies/islands/islands.h"

#include <algorithm>
#include <numeric>

namespace terrane::internal {
namespace {

/// Exclusive prefix sum: turns counts into the start of each group.
void accumulate(std::vector<std::uint32_t>& counts) {
    std::uint32_t start = 0;
    for (std::uint32_t& count : counts) {
        const std::uint32_t next = start + count;
        count = start;
        start = next;
    }
}

/// Restores the starts after filling has advanced each to the end of its group.
void rewind(std::vector<std::uint32_t>& starts) {
    for (std::size_t i = starts.size() - 1; i > 0; --i) starts[i] = starts[i - 1];
    starts[0] = 0;
}

}  // namespace

std::uint32_t Islands::find_root(std::uint32_t body) {
    while (parents_[body] != body) {
        parents_[body] = parents_[parents_[body]];
        body = parents_[body];
    }
    return body;
}

void Islands::build(std::span<const BodyPair> links, std::span<const std::uint8_t> moves) {
    parents_.resize(moves.size());
    std::iota(parents_.begin(), parents_.end(), 0u);
    islands_.assign(moves.size(), kNone);
    for (const BodyPair& link : links) {
        if (moves[link.a] == 0 || moves[link.b] == 0) continue;
        const std::uint32_t a = find_root(link.a), b = find_root(link.b);
        // The lowest body is the root.
        parents_[std::max(a, b)] = std::min(a, b);
    }

    body_starts_.assign(1, 0);
    std::uint32_t body_count = 0;
    for (std::uint32_t body = 0; body < moves.size(); ++body) {
        if (moves[body] == 0) continue;
        const std::uint32_t root = find_root(body);
        if (root == body) {
            islands_[body] = static_cast<std::uint32_t>(body_starts_.size() - 1);
            body_starts_.push_back(0);
        } else {
            islands_[body] = islands_[root];
        }
        ++body_starts_[islands_[body]];
        ++body_count;
    }
    accumulate(body_starts_);
    bodies_.resize(body_count);
    for (std::uint32_t body = 0; body < moves.size(); ++body) {
        if (islands_[body] != kNone) bodies_[body_starts_[islands_[body]]++] = body;
    }
    rewind(body_starts_);

    const auto island_of = [&](const BodyPair& link) {
        return islands_[moves[link.a] != 0 ? link.a : link.b];
    };
    link_starts_.assign(body_starts_.size(), 0);
    std::uint32_t link_count = 0;
    for (const BodyPair& link : links) {
        if (island_of(link) == kNone) continue;
        ++link_starts_[island_of(link)];
        ++link_count;
    }
    accumulate(link_starts_);
    links_.resize(link_count);
    for (std::uint32_t link = 0; link < links.size(); ++link) {
        const std::uint32_t island = island_of(links[link]);
        if (island != kNone) links_[link_starts_[island]++] = link;
    }
    rewind(link_starts_);
}

std::span<const std::uint32_t> Islands::bodies(std::size_t island) const {
    return std::span(bodies_).subspan(body_starts_[island],
                                      body_starts_[island + 1] - body_starts_[island]);
}

std::span<const std::uint32_t> Islands::links(std::size_t island) const {
    return std::span(links_).subspan(link_starts_[island],
                                     link_starts_[island + 1] - link_starts_[island]);
}

}  // namespace terrane::internal
