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

Need NeedFinder::contact_need(ContactNeeds::Slot slot) const {
    if (slot == ContactNeeds::kNone) return {};
    return {NeedClass::contact, contact_->time_until(slot), contact_->end_of(slot), 0.0};
}

bool NeedFinder::is_of_region(ContactNeeds::Slot slot) const {
    return slot != ContactNeeds::kNone && contact_->is_of_region(slot);
}

void NeedFinder::count_used(ChunkTree::Node& node) {
    if (node.was_needed || node.need.why >= NeedClass::speculation) return;
    // a drawn chunk counts as used only if it is visible: PagingPolicy::distance loads chunks in all directions
    bool is_used = node.need.is_needed_now() && node.need.why <= NeedClass::contact;
    if (node.parent != ChunkTree::kNone && node.need.is_needed_now()) {
        const ChunkTree::Quadrants& parent = tree_->quadrants(node.parent);
        const auto at = static_cast<std::size_t>(node.key.quadrant());
        for (const PredictedView& predicted : predicted_views_) {
            is_used = is_used || predicted.visible_ratio(parent.boxes[at], parent.bounds[at]) > 0.0;
        }
    }
    node.was_needed = is_used;
    (is_used ? bytes_.used : bytes_.awaited) += node.bytes_read;
}

void NeedFinder::set_need(ChunkTree::Node& node, ChunkTree::Index index, const Need& need) {
    node.need = need;
    needed_.push_back(index);
}

double NeedFinder::slack_of(const Need& need, double load_s) const {
    // nearest first
    if (settings_.policy == PagingPolicy::distance && need.why == NeedClass::drawn)
        return 1.0 / need.ratio;
    return need.begin_s - load_s;
}

// Sets the needs of a node's descendants, and returns the combined needs of the node and its descendants. Requires the
// node's own needs.
NeedFinder::Needs NeedFinder::visit(ChunkTree& tree, ChunkTree::Index index,
                                    ContactNeeds::Slot slot) {
    Needs needs{tree[index].need, {}};
    if (tree[index].key.level < lattice_->finest_level) {
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            const ContactNeeds::Slot child_slot = contact_->child(slot, quadrant);
            // without a camera, only bodies and regions need absent chunks
            if (predicted_views_.empty() && child_slot == ContactNeeds::kNone &&
                tree[index].child[static_cast<std::size_t>(quadrant)] == ChunkTree::kNone) {
                continue;
            }
            const Needs below = visit_child(tree, index, quadrant, child_slot);
            needs = {combine(needs.all, below.all), combine(needs.of_drawing, below.of_drawing)};
        }
    }
    tree[index].need = needs.all;
    count_used(tree[index]);
    return needs;
}

// Sets the need of a child and its descendants if it is resident; lists it if it is absent and needed.
NeedFinder::Needs NeedFinder::visit_child(ChunkTree& tree, ChunkTree::Index index, int quadrant,
                                          ContactNeeds::Slot slot) {
    const auto at = static_cast<std::size_t>(quadrant);
    const ChunkTree::Node& node = tree[index];
    const WorldBox& box = tree.quadrants(index).boxes[at];
    const double bound = tree.quadrants(index).bounds[at];
    const ChunkTree::Index child = node.child[at];
    const ChunkKey key = node.key.child(quadrant);
    // the arrival time does not depend on residence: otherwise chunks would alternate between resident and absent
    const double arrival_s = times_->expected_s(key.level);
    const Need contact = contact_need(slot);
    Needs own;
    own.of_drawing = camera_need(box, bound, arrival_s, child != ChunkTree::kNone);
    own.all = combine(own.of_drawing, contact);
    if (is_of_region(slot)) own.of_drawing = own.all;
    if (child == ChunkTree::kNone) {
        if (own.all.is_needed())
            own.of_drawing = visit_absent(key, slot, box, bound, arrival_s, own).of_drawing;
        return own;
    }
    ChunkTree::Node& held = tree[child];
    bool is_retained = false;
    if (own.all.why == NeedClass::contact) {
        held.contact_until_s = time_s_ + std::min(own.all.end_s, own.all.begin_s + kContactHeld_s);
        is_retained = camera_need(box, kAlmost * bound, arrival_s, true).is_needed();
    } else if (!own.all.is_needed()) {
        own.all = retention_need(held, box, bound, arrival_s);
        is_retained = own.all.is_needed();
    }
    set_need(held, child, own.all);
    if (own.all.is_needed()) {
        const Needs below = visit(tree, child, slot);
        own = {below.all, combine(own.of_drawing, below.of_drawing)};
    }
    held.is_to_be_drawn = own.of_drawing.is_needed() || is_retained;
    if (own.of_drawing.is_needed() && held.outline != nullptr) {
        const Need& wanted = own.of_drawing;
        candidates_.push_back({key, wanted, slack_of(wanted, arrival_s)});
    }
    return own;
}

// Lists an absent chunk and its urgent descendants. The slack is reduced for the descendants.
NeedFinder::Absent NeedFinder::visit_absent(const ChunkKey& key, ContactNeeds::Slot slot,
                                            const WorldBox& box, double bound, double arrival_s,
                                            const Needs& needs) {
    const std::size_t index = candidates_.size();
    candidates_.push_back({key, needs.all});
    const double own_s = times_->expected_s(key.level);
    Absent absent{slack_of(needs.all, own_s), needs.of_drawing};
    if (settings_.policy == PagingPolicy::deadline && key.level < lattice_->finest_level) {
        const Absent below = visit_below_absent(key, slot, box, bound, arrival_s, needs.all.why);
        absent = {std::min(absent.slack_s, below.slack_s - own_s),
                  combine(absent.of_drawing, below.of_drawing)};
    }
    candidates_[index].slack_s = absent.slack_s;
    candidates_[index].is_to_be_drawn = absent.of_drawing.is_needed();
    return absent;
}

NeedFinder::Absent NeedFinder::visit_below_absent(const ChunkKey& key, ContactNeeds::Slot slot,
                                                  const WorldBox& box, double bound,
                                                  double arrival_s, NeedClass why) {
    const double own_bound = decay(key.level) * bound;
    const double margin = lattice_->level_spacing(key.level + 1);
    Absent all;
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const ContactNeeds::Slot child_slot = contact_->child(slot, quadrant);
        const bool may_be_seen = may_guess_ && !predicted_views_.empty();
        if (!may_be_seen && child_slot == ContactNeeds::kNone) continue;
        const ChunkKey child = key.child(quadrant);
        const double arrives_s = arrival_s + times_->expected_s(child.level);
        const WorldRect rect = rect_of(*lattice_, child);
        const WorldBox child_box{{rect.west - margin, rect.south - margin, box.low.z()},
                                 {rect.east + margin, rect.north + margin, box.high.z()}};
        Need seen;
        if (may_be_seen) seen = camera_need(child_box, own_bound, arrives_s, false);
        // A child that is not urgent is requested after its parent's arrival.
        const bool is_urgent = seen.why == NeedClass::drawn && seen.begin_s < arrives_s;
        if (!is_urgent) seen = {};
        const Need own = combine(seen, contact_need(child_slot));
        if (!own.is_needed()) continue;
        const Absent absent = visit_absent(child, child_slot, child_box, own_bound, arrives_s,
                                           {own, is_of_region(child_slot) ? own : seen});
        // descendants of a lower class do not reduce the slack: that of a contact chunk depends on contact only
        if (own.why <= why) all.slack_s = std::min(all.slack_s, absent.slack_s);
        all.of_drawing = combine(all.of_drawing, absent.of_drawing);
    }
    return all;
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
    for (const ChunkTree::Index i : needed_) {
        tree[i].need = {};
        tree[i].is_to_be_drawn = false;
    }
    needed_.clear();
    for (const ChunkKey& key : tree.roots()) {
        const Need root{NeedClass::root, 0.0, kNever, 0.0};
        const ChunkTree::Index index = tree.find(key);
        if (index == ChunkTree::kNone) {
            candidates_.push_back({key, root, -times.expected_s(0)});
        } else {
            set_need(tree[index], index, root);
            tree[index].is_to_be_drawn = true;
            visit(tree, index, contact.find_slot(key));
        }
    }
    return bytes_;
}

}  // namespace terrane::internal
