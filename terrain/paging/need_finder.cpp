// SPDX-License-Identifier: MIT
//
// Sources:
//   P. Cozzi, K. Ring. 3D Engine Design for Virtual Globes, 2011, ch. 12. (replacement by need, parents
//   stay while children are resident)
//   C. L. Liu, J. W. Layland. Scheduling algorithms for multiprogramming in a hard-real-time environment.
//   Journal of the ACM 20(1), 1973. (earliest deadline first)
// Deviations: a need begins and ends with the motion of who needs; what lies below an absent chunk is
// asked for with it, by what its level taught about bounds.
#include "paging/need_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane::internal {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Foresight wavers. What is there is held while it is almost needed, and what was foreseen to be touched
// until then, and for so long.
constexpr double kAlmost = 1.1;
constexpr double kContactHeld_s = 1.0;

// What most pagers do: all that is within a radius, the nearest first.
Need near_need(const Outlook& outlook, const Box& box, double bound, double radius) {
    const double reach = radius * outlook.distance_per_bound * bound;
    const double from = std::max(
        outlook.near_distance, std::sqrt(square_distance(box, outlook.moments.front().eye_world)));
    if (from >= reach) return {};
    return {NeedClass::drawn, 0.0, kNever, 1.0 / from};
}

}  // namespace

std::array<double, 32> NeedFinder::filled_decays() {
    std::array<double, 32> decays{};
    decays.fill(0.5);
    return decays;
}

void NeedFinder::learn(const Chunk& chunk, double bound) {
    if (!(bound > 0.0)) return;
    const double own = static_cast<double>(
        *std::max_element(chunk.quadrant_bound.begin(), chunk.quadrant_bound.end()));
    double& decay = decays_[chunk.key.level];
    constexpr double kShare = 0.1;
    decay += kShare * (std::clamp(own / bound, 0.05, 1.0) - decay);
}

Need NeedFinder::camera_need(const Box& box, double bound, double arrival_s, bool is_there) const {
    Need need;
    for (const Outlook& outlook : outlooks_) {
        need = both(need, settings_.policy == PagingPolicy::distance
                              ? near_need(outlook, box, bound, settings_.distance_radius)
                              : outlook.look(box, bound, arrival_s, is_there));
    }
    return need;
}

// Of a resident chunk that nobody needs.
Need NeedFinder::held_need(const ChunkTree::Node& node, const Box& box, double bound,
                           double arrival_s) const {
    if (settings_.policy == PagingPolicy::distance) return {};
    Need need = camera_need(box, kAlmost * bound, arrival_s, true);
    need.ratio /= kAlmost;
    if (node.contact_until_s > time_s_) need = both(need, {NeedClass::contact, 0.0, 0.0, 0.0});
    if (need.is_needed()) need.why = NeedClass::speculation;
    return need;
}

Need NeedFinder::contact_need(const ChunkKey& key) const {
    if (key.level > contact_level_) return {};
    const double time_s = contact_->time_until(key);
    if (time_s == kNever) return {};
    return {NeedClass::contact, time_s, contact_->end_of(key), 0.0};
}

void NeedFinder::count_used(ChunkTree::Node& node) {
    if (node.was_needed || node.need.why >= NeedClass::speculation) return;
    // distance alone is no need
    bool is_used = node.need.is_needed_now() && node.need.why <= NeedClass::contact;
    if (node.parent != ChunkTree::kNone && node.need.is_needed_now()) {
        const ChunkTree::Node& parent = (*tree_)[node.parent];
        const auto at = static_cast<std::size_t>(node.chunk->key.quadrant());
        for (const Outlook& outlook : outlooks_) {
            is_used = is_used || outlook.ratio_now(parent.boxes[at], parent.bounds[at]) > 0.0;
        }
    }
    node.was_needed = is_used;
    (is_used ? bytes_.used : bytes_.awaited) += node.bytes_read;
}

// A parent is needed as much as what hangs below it.
Need NeedFinder::visit(ChunkTree& tree, ChunkTree::Index index) {
    const ChunkKey key = tree[index].chunk->key;
    Need need = tree[index].need;
    if (key.level == lattice_->finest_level) {
        count_used(tree[index]);
        return need;
    }
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const auto at = static_cast<std::size_t>(quadrant);
        ChunkTree::Node& node = tree[index];
        const ChunkKey child_key = key.child(quadrant);
        const ChunkTree::Index child = node.child[at];
        // what is there is judged as if it came then, too: else the two would take turns
        const double arrival_s = times_->expected_s(child_key.level);
        Need own =
            camera_need(node.boxes[at], node.bounds[at], arrival_s, child != ChunkTree::kNone);
        if (need.why <= NeedClass::contact) own = both(own, contact_need(child_key));
        if (child != ChunkTree::kNone) {
            ChunkTree::Node& held = tree[child];
            if (own.why == NeedClass::contact) {
                held.contact_until_s = time_s_ + std::min(own.end_s, own.begin_s + kContactHeld_s);
            } else if (!own.is_needed()) {
                own = held_need(held, node.boxes[at], node.bounds[at], arrival_s);
            }
            held.need = own;
            if (own.is_needed()) own = visit(tree, child);
        } else if (own.is_needed()) {
            visit_absent(child_key, node.boxes[at], node.bounds[at], arrival_s, own);
        }
        need = both(need, own);
    }
    tree[index].need = need;
    count_used(tree[index]);
    return need;
}

// Returns the slack of the chunk, with that of what waits for it.
double NeedFinder::visit_absent(const ChunkKey& key, const Box& box, double bound, double arrival_s,
                                const Need& need) {
    const std::size_t place = wishes_.size();
    wishes_.push_back({key, need});
    const double own_s = times_->expected_s(key.level);
    double slack_s = need.begin_s - own_s;
    if (settings_.policy == PagingPolicy::distance) {
        if (need.why == NeedClass::drawn) slack_s = 1.0 / need.ratio;  // the nearest first
    } else if (may_guess_ && key.level < lattice_->finest_level) {
        double below_s = kNever;
        visit_below_absent(key, box, bound, arrival_s, need.why, below_s);
        slack_s = std::min(slack_s, below_s - own_s);
    }
    wishes_[place].slack_s = slack_s;
    return slack_s;
}

void NeedFinder::visit_below_absent(const ChunkKey& key, const Box& box, double bound,
                                    double arrival_s, NeedClass why, double& slack_s) {
    const double own_bound = decay(key.level) * bound;
    const double margin = lattice_->level_spacing(key.level + 1);
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const ChunkKey child = key.child(quadrant);
        const double arrives_s = arrival_s + times_->expected_s(child.level);
        const WorldRect rect = rect_of(*lattice_, child);
        const Box child_box{{rect.west - margin, rect.south - margin, box.low.z()},
                            {rect.east + margin, rect.north + margin, box.high.z()}};
        Need need = camera_need(child_box, own_bound, arrives_s, false);
        // what can be asked for when its parent is there is not guessed at
        const bool is_urgent = need.why == NeedClass::drawn && need.begin_s < arrives_s;
        if (!is_urgent) need = {};
        need = both(need, contact_need(child));
        if (!need.is_needed()) continue;
        const double child_slack_s = visit_absent(child, child_box, own_bound, arrives_s, need);
        // what is drawn below does not hurry contact: that goes by when it is touched
        if (need.why <= why) slack_s = std::min(slack_s, child_slack_s);
    }
}

NeedFinder::Bytes NeedFinder::find(ChunkTree& tree, std::span<const Outlook> outlooks,
                                   const ContactNeeds& contact, const LoadTimes& times,
                                   double time_s, bool may_guess) {
    outlooks_ = outlooks;
    contact_ = &contact;
    times_ = &times;
    time_s_ = time_s;
    may_guess_ = may_guess;
    tree_ = &tree;
    lattice_ = &tree.lattice();
    wishes_.clear();
    bytes_ = {};
    for (ChunkTree::Index i = 0; i < tree.capacity(); ++i) tree[i].need = {};
    for (const ChunkKey& key : tree.roots()) {
        const Need root{NeedClass::root, 0.0, kNever, 0.0};
        const ChunkTree::Index index = tree.find(key);
        if (index == ChunkTree::kNone) {
            wishes_.push_back({key, root, -times.expected_s(0), false});
        } else {
            tree[index].need = root;
            visit(tree, index);
        }
    }
    return bytes_;
}

}  // namespace terrane::internal
