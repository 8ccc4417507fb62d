// SPDX-License-Identifier: MIT
//
// The planning half of the pager: clients, their needs, and the fades of what they see.
#include "paging/pager_state.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::ChunkTree;
using internal::LoadCandidate;
using internal::NeedClass;
using internal::SetEntry;

// Rounding of times that are sums of frames.
constexpr double kSlack_s = 1e-6;
// Contact is predicted ahead for the time of this many consecutive loads, at least for kContactAhead_s.
constexpr double kContactLoads = 4.0;
constexpr double kContactAhead_s = 1.0;

bool is_good(const CameraNeed& camera) {
    const bool has_good_trajectory = std::all_of(
        camera.trajectory.begin(), camera.trajectory.end(), [](const CameraMoment& moment) {
            return std::isfinite(moment.time_s) && moment.eye_world.allFinite() &&
                   moment.forward.allFinite() && moment.up.allFinite();
        });
    return check(camera.view) && camera.velocity.allFinite() && camera.threshold_px > 0.0 &&
           has_good_trajectory;
}

bool is_good(const BodyNeed& body) {
    const bool has_good_trajectory =
        std::all_of(body.trajectory.begin(), body.trajectory.end(), [](const BodyMoment& moment) {
            return std::isfinite(moment.time_s) && moment.centre_world.allFinite();
        });
    return body.centre_world.allFinite() && body.velocity.allFinite() && body.radius >= 0.0 &&
           std::isfinite(body.radius) && has_good_trajectory;
}

}  // namespace

// Refuses and counts needs that are not finite. Returns whether a plan is due.
bool Pager::State::take_clients(std::span<const CameraNeed> cameras,
                                std::span<const BodyNeed> all_bodies, double now_s) {
    const double before_s = time_s;
    if (std::isfinite(now_s)) time_s = std::max(time_s, now_s);
    const double passed_s = time_s - planned_s;
    is_clock_stalled = time_s == before_s;  // no clock, or several updates at one time
    bool is_due =
        is_inline || must_plan || is_clock_stalled || !(passed_s < internal::kTick_s - kSlack_s);
    is_due = is_due || views.size() != cameras.size() || body_count != all_bodies.size();
    must_plan = false;
    body_count = all_bodies.size();
    observers.clear();
    views.resize(cameras.size());
    motions.resize(cameras.size());
    std::vector<std::size_t> good;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const CameraNeed& camera = cameras[i];
        if (!is_good(camera)) {
            ++stats.refused_needs;
            views[i].reset();
            motions[i].reset();
            continue;
        }
        good.push_back(i);
        const Frustum frustum = make_frustum(camera.view);
        is_due = is_due || !views[i];
        observers.push_back({camera.view, frustum, camera.threshold_px, views[i]});
        views[i] = {camera.view.eye_world, frustum};
        is_due = motions[i].observe(camera, time_s) || is_due;
    }
    if (is_due) {
        planned_s = time_s;
        predicted_views.clear();
        for (const std::size_t i : good) {
            predicted_views.push_back(motions[i].predict(cameras[i], time_s, settings.horizon));
        }
    }
    bodies.clear();
    trajectory_moments.clear();
    for (const BodyNeed& body : all_bodies) {
        if (is_good(body)) {
            bodies.push_back(body);
            trajectory_moments.insert(trajectory_moments.end(), body.trajectory.begin(),
                                      body.trajectory.end());
            // a rising body falls again: its upward velocity is not followed
            if (body.trajectory.empty())
                bodies.back().velocity.z() = std::min(0.0, body.velocity.z());
        } else {
            ++stats.refused_needs;
        }
    }
    // Point into our copies: finish() plans again, when the caller's data may be gone.
    std::size_t first = 0;
    for (BodyNeed& body : bodies) {
        body.trajectory =
            std::span<const BodyMoment>(trajectory_moments).subspan(first, body.trajectory.size());
        first += body.trajectory.size();
    }
    return is_due;
}

// Contact has priority over drawing, so it is predicted no further than its loading takes.
double Pager::State::contact_horizon() const {
    if (settings.policy == PagingPolicy::distance) return 0.0;
    if (is_inline) return settings.horizon;
    return std::min(settings.horizon,
                    std::max(kContactAhead_s, kContactLoads * times.expected_s(contact_level)));
}

void Pager::State::plan() {
    std::vector<internal::RegionNeed> regions;
    for (const auto& [ticket, region] : tickets) regions.push_back(region);
    contact.find(bodies, regions, time_s, contact_horizon());
    const internal::NeedFinder::Bytes found =
        needs.find(tree, predicted_views, contact, times, time_s, !waits_for_all());
    stats.bytes_used += found.used;
    stats.bytes_awaited = found.awaited;
    std::vector<LoadCandidate>& candidates = needs.candidates();
    if (next_window != tree.window()) {
        constexpr double kForever = std::numeric_limits<double>::infinity();
        for (const ChunkKey& key : absent_next_roots()) {
            // those in both windows are candidates already
            if (tree.window().contains(key)) continue;
            // The frame does not need it until the window has moved: it is not late, however long it takes.
            candidates.push_back(
                {key, {NeedClass::root, kForever, kForever, 0.0}, -times.expected_s(0)});
        }
    }
    std::sort(candidates.begin(), candidates.end(), internal::has_priority_over);
    count_late();
    count_groundless();
    count_waits();
    budget.begin_plan(predicted_views, !bodies.empty() || !tickets.empty(), stats);
    if (wanted_replacement_bytes > 0) budget.make_room(wanted_replacement_bytes);
}

void Pager::State::count_late() {
    stats.late_chunks = 0;
    for (const LoadCandidate& candidate : needs.candidates()) {
        stats.late_chunks +=
            candidate.need.is_needed_now() && candidate.need.why != NeedClass::speculation ? 1u
                                                                                           : 0u;
    }
}

void Pager::State::count_groundless() {
    stats.groundless_bodies = 0;
    std::size_t last = bodies.size();
    for (const internal::ContactNeeds::CurrentContact& touched : contact.current_contacts()) {
        if (touched.body == last || tree.find(touched.key) != ChunkTree::kNone) continue;
        last = touched.body;  // ordered by body
        ++stats.groundless_bodies;
    }
    stats.cut_needs += contact.is_cut() ? 1u : 0u;
}

// A need for absent contact lasts as long again as it has lasted already: the body may be parked there.
void Pager::State::count_waits() {
    std::map<ChunkKey, double> missed;
    for (LoadCandidate& candidate : needs.candidates()) {
        if (candidate.need.why != NeedClass::contact || !candidate.need.is_needed_now()) continue;
        const auto before = missing_since_s.find(candidate.key);
        const double since_s = before == missing_since_s.end() ? time_s : before->second;
        missed[candidate.key] = since_s;
        candidate.need.end_s = std::max(candidate.need.end_s, time_s - since_s);
    }
    missing_since_s = std::move(missed);
}

// Advances every fade by one step.
void Pager::State::fade() {
    stats.fading_chunks = 0;
    for (ChunkTree::Index i = 0; i < tree.capacity(); ++i) {
        ChunkTree::Node& node = tree[i];
        if (!node.chunk) continue;
        const bool is_new = std::exchange(node.is_new, false);
        if (node.inverse_fade == 1.0 && !is_new && !node.is_fading_out) continue;
        if (skips_fades || node.parent == ChunkTree::kNone) {
            node.inverse_fade = 1.0;
        } else {
            node.inverse_fade =
                internal::next_inverse_fade(budget.visibility_of(node), is_new, node.is_fading_out);
        }
        stats.fading_chunks += node.inverse_fade > 1.0 ? 1u : 0u;
    }
}

void Pager::State::publish() {
    std::vector<ChunkKey> evicted = budget.take_evicted();
    for (const ChunkKey& key : evicted) eviction_times_s[key] = time_s;
    if (skips_fades) evicted_in_finish.insert(evicted.begin(), evicted.end());
    std::erase_if(eviction_times_s,
                  [this](const auto& entry) { return time_s - entry.second > settings.horizon; });
    evicted.insert(evicted.end(), replaced_keys.begin(), replaced_keys.end());
    replaced_keys.clear();
    // drops chunks that were inserted and evicted since the last set
    std::erase_if(arrived, [this](const std::shared_ptr<const Chunk>& chunk) {
        const ChunkTree::Index index = tree.find(chunk->key);
        return index == ChunkTree::kNone || tree[index].chunk != chunk;
    });
    std::sort(evicted.begin(), evicted.end(), ResidentSet::Order());
    evicted.erase(std::unique(evicted.begin(), evicted.end()), evicted.end());
    std::erase_if(evicted,
                  [this](const ChunkKey& key) { return set->find(key) == ResidentSet::kNone; });

    const auto is_before = [](const SetEntry& a, const SetEntry& b) {
        return ResidentSet::Order()(a.key, b.key);
    };
    std::erase_if(order, [&](const SetEntry& placed) {
        return std::binary_search(evicted.begin(), evicted.end(), placed.key, ResidentSet::Order());
    });
    const auto middle = static_cast<std::ptrdiff_t>(order.size());
    for (const auto& chunk : arrived) order.push_back({chunk->key, tree.find(chunk->key)});
    std::sort(order.begin() + middle, order.end(), is_before);
    std::inplace_merge(order.begin(), order.begin() + middle, order.end(), is_before);

    std::vector<float> fades;
    fades.reserve(order.size());
    for (const SetEntry& placed : order) {
        fades.push_back(internal::fade_of(tree[placed.index].inverse_fade));
    }
    if (!evicted.empty() || !arrived.empty()) {
        set = std::make_shared<const ResidentSet>(*set, evicted, std::move(arrived),
                                                  std::move(fades), ++epoch, tree.window());
        arrived.clear();
    } else if (!std::equal(fades.begin(), fades.end(), set->fades().begin())) {
        set = std::make_shared<const ResidentSet>(*set, std::move(fades), ++epoch);
    }
}

}  // namespace terrane
