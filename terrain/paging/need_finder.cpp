// SPDX-License-Identifier: MIT
//
// Sources:
//   P. Cozzi, K. Ring. 3D Engine Design for Virtual Globes, 2011, ch. 12. (replacement by need; parents stay resident
//   with their children)
//   C. L. Liu, J. W. Layland. Scheduling algorithms for multiprogramming in a hard-real-time environment.
//   Journal of the ACM 20(1), 1973. (earliest deadline first)
// Deviations: the predicted motion of the clients determines when needs start and end. An absent chunk and its urgent
// descendants are requested at the same time; bounds of the descendants are estimated from the mean ratios between
// levels.
#include "paging/need_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane::internal {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Hysteresis against varying predictions: a resident chunk is kept while its ratio is at least 1 / kAlmost. A chunk
// with predicted contact is kept until the contact's predicted end, at most kContactHeld_s after its predicted start.
constexpr double kAlmost = 1.1;
constexpr double kContactHeld_s = 1.0;

// PagingPolicy::distance: everything nearer than `radius` times the distance at which its error equals the threshold.
Need near_need(const PredictedView& predicted, const WorldBox& box, double bound, double radius) {
    const double reach = radius * predicted.distance_per_bound * bound;
    const double from =
        std::max(predicted.near_distance,
                 std::sqrt(square_distance(box, predicted.states.front().eye_world)));
    if (from >= reach) return {};
    return {NeedClass::drawn, 0.0, kNever, 1.0 / from};
}

}  // namespace

std::array<double, 32> NeedFinder::filled_decays() {
    std::array<double, 32> decays{};
    decays.fill(0.5);
    return decays;
}

void NeedFinder::learn_decay(const Chunk& chunk, double bound) {
    if (!(bound > 0.0)) return;
    const double own = static_cast<double>(
        *std::max_element(chunk.quadrant_bound.begin(), chunk.quadrant_bound.end()));
    double& decay = decays_[chunk.key.level];
    constexpr double kShare = 0.1;
    decay += kShare * (std::clamp(own / bound, 0.05, 1.0) - decay);
}

Need NeedFinder::camera_need(const WorldBox& box, double bound, double arrival_s,
                             bool is_resident) const {
    Need need;
    for (const PredictedView& predicted : predicted_views_) {
        need = combine(need, settings_.policy == PagingPolicy::distance
                                 ? near_need(predicted, box, bound, settings_.distance_radius)
                                 : predicted.find_need(box, bound, arrival_s, is_resident));
    }
    return need;
}

// Hysteresis: the need, if any, that still keeps a resident chunk for which camera_need() finds none.
Need NeedFinder::retention_need(const ChunkTree::Node& node, const WorldBox& box, double bound,
                                double arrival_s) const {
    if (settings_.policy == PagingPolicy::distance) return {};
    Need need = camera_need(box, kAlmost * bound, arrival_s, true);
    need.ratio /= kAlmost;
    if (node.contact_until_s > time_s_) need = combine(need, {NeedClass::contact, 0.0, 0.0, 0.0});
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
    // a drawn chunk counts as used only if it is visible: PagingPolicy::distance loads chunks in all directions
    bool is_used = node.need.is_needed_now() && node.need.why <= NeedClass::contact;
    if (node.parent != ChunkTree::kNone && node.need.is_needed_now()) {
        const ChunkTree::Node& parent = (*tree_)[node.parent];
        const auto at = static_cast<std::size_t>(node.chunk->key.quadrant());
        for (const PredictedView& predicted : predicted_views_) {
            is_used = is_used || predicted.visible_ratio(parent.boxes[at], parent.bounds[at]) > 0.0;
        }
    }
    node.was_needed = is_used;
    (is_used ? bytes_.used : bytes_.awaited) += node.bytes_read;
}

// Sets the needs of a node's descendants, and returns the combined needs of the node and its descendants.
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
        // the arrival time does not depend on residence: otherwise chunks would alternate between resident and absent
        const double arrival_s = times_->expected_s(child_key.level);
        Need own =
            camera_need(node.boxes[at], node.bounds[at], arrival_s, child != ChunkTree::kNone);
        if (need.why <= NeedClass::contact) own = combine(own, contact_need(child_key));
        if (child != ChunkTree::kNone) {
            ChunkTree::Node& held = tree[child];
            if (own.why == NeedClass::contact) {
                held.contact_until_s = time_s_ + std::min(own.end_s, own.begin_s + kContactHeld_s);
            } else if (!own.is_needed()) {
                own = retention_need(held, node.boxes[at], node.bounds[at], arrival_s);
            }
            held.need = own;
            if (own.is_needed()) own = visit(tree, child);
        } else if (own.is_needed()) {
            visit_absent(child_key, node.boxes[at], node.bounds[at], arrival_s, own);
        }
        need = combine(need, own);
    }
    tree[index].need = need;
    count_used(tree[index]);
    return need;
}

// Lists an absent chunk and its urgent descendants. Returns the chunk's slack, reduced for the descendants.
double NeedFinder::visit_absent(const ChunkKey& key, const WorldBox& box, double bound,
                                double arrival_s, const Need& need) {
    const std::size_t index = candidates_.size();
    candidates_.push_back({key, need});
    const double own_s = times_->expected_s(key.level);
    double slack_s = need.begin_s - own_s;
    if (settings_.policy == PagingPolicy::distance) {
        if (need.why == NeedClass::drawn) slack_s = 1.0 / need.ratio;  // nearest first
    } else if (may_guess_ && key.level < lattice_->finest_level) {
        double below_s = kNever;
        visit_below_absent(key, box, bound, arrival_s, need.why, below_s);
        slack_s = std::min(slack_s, below_s - own_s);
    }
    candidates_[index].slack_s = slack_s;
    return slack_s;
}

void NeedFinder::visit_below_absent(const ChunkKey& key, const WorldBox& box, double bound,
                                    double arrival_s, NeedClass why, double& slack_s) {
    const double own_bound = decay(key.level) * bound;
    const double margin = lattice_->level_spacing(key.level + 1);
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const ChunkKey child = key.child(quadrant);
        const double arrives_s = arrival_s + times_->expected_s(child.level);
        const WorldRect rect = rect_of(*lattice_, child);
        const WorldBox child_box{{rect.west - margin, rect.south - margin, box.low.z()},
                                 {rect.east + margin, rect.north + margin, box.high.z()}};
        Need need = camera_need(child_box, own_bound, arrives_s, false);
        // A child that is not urgent is requested after its parent's arrival.
        const bool is_urgent = need.why == NeedClass::drawn && need.begin_s < arrives_s;
        if (!is_urgent) need = {};
        need = combine(need, contact_need(child));
        if (!need.is_needed()) continue;
        const double child_slack_s = visit_absent(child, child_box, own_bound, arrives_s, need);
        // descendants of a lower class do not reduce the slack: that of a contact chunk depends on contact only
        if (need.why <= why) slack_s = std::min(slack_s, child_slack_s);
    }
}

NeedFinder::Bytes NeedFinder::find(ChunkTree& tree, std::span<const PredictedView> predicted_views,
                                   const ContactNeeds& contact, const LoadTimes& times,
                                   double time_s, bool may_guess) {
    predicted_views_ = predicted_views;
    contact_ = &contact;
    times_ = &times;
    time_s_ = time_s;
    may_guess_ = may_guess;
    tree_ = &tree;
    lattice_ = &tree.lattice();
    candidates_.clear();
    bytes_ = {};
    for (ChunkTree::Index i = 0; i < tree.capacity(); ++i) tree[i].need = {};
    for (const ChunkKey& key : tree.roots()) {
        const Need root{NeedClass::root, 0.0, kNever, 0.0};
        const ChunkTree::Index index = tree.find(key);
        if (index == ChunkTree::kNone) {
            candidates_.push_back({key, root, -times.expected_s(0), false});
        } else {
            tree[index].need = root;
            visit(tree, index);
        }
    }
    return bytes_;
}

}  // namespace terrane::internal
