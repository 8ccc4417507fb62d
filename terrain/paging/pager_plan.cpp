// SPDX-License-Identifier: MIT
//
// The half of the pager that looks: at its clients, at what they need, and at what they see.
#include "paging/pager_state.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::ChunkTree;
using internal::NeedClass;
using internal::Placed;
using internal::Wish;

// Times that are sums of frames are a little off.
constexpr double kSlack_s = 1e-6;
// Bodies are followed ahead for as long as so many loads take, one after the other, and this at least.
constexpr double kContactLoads = 4.0;
constexpr double kContactAhead_s = 1.0;

bool is_good(const CameraNeed& camera) {
    const bool has_good_way =
        std::all_of(camera.trajectory.begin(), camera.trajectory.end(), [](const CameraMoment& moment) {
            return std::isfinite(moment.time_s) && moment.eye_world.allFinite() &&
                   moment.forward.allFinite() && moment.up.allFinite();
        });
    return check(camera.view) && camera.velocity.allFinite() && camera.threshold_px > 0.0 &&
           has_good_way;
}

bool is_good(const BodyNeed& body) {
    const bool has_good_way =
        std::all_of(body.trajectory.begin(), body.trajectory.end(), [](const BodyMoment& moment) {
            return std::isfinite(moment.time_s) && moment.centre_world.allFinite();
        });
    return body.centre_world.allFinite() && body.velocity.allFinite() && body.radius >= 0.0 &&
           std::isfinite(body.radius) && has_good_way;
}

}  // namespace

// Needs that are not finite are refused, and counted; the other ones go on. Whether it is time to look
// at what is needed.
bool Pager::State::take_clients(std::span<const CameraNeed> cameras,
                                std::span<const BodyNeed> all_bodies, double now_s) {
    const double before_s = time_s;
    if (std::isfinite(now_s)) time_s = std::max(time_s, now_s);
    const double passed_s = time_s - planned_s;
    clock_stands = time_s == before_s;  // it tells nothing
    bool is_due =
        is_inline || must_plan || clock_stands || !(passed_s < internal::kTick_s - kSlack_s);
    is_due = is_due || views.size() != cameras.size() || body_count != all_bodies.size();
    must_plan = false;
    body_count = all_bodies.size();
    watchers.clear();
    views.resize(cameras.size());
    motions.resize(cameras.size());
    std::vector<std::size_t> good;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const CameraNeed& camera = cameras[i];
        if (!is_good(camera)) {
            ++stats.refused_needs;
            views[i].reset();
            motions[i].forget();
            continue;
        }
        good.push_back(i);
        const Frustum frustum = make_frustum(camera.view);
        is_due = is_due || !views[i];
        watchers.push_back({camera.view, frustum, camera.threshold_px, views[i]});
        views[i] = {camera.view.eye_world, frustum};
        is_due = motions[i].observe(camera, time_s) || is_due;
    }
    if (is_due) {
        planned_s = time_s;
        outlooks.clear();
        for (const std::size_t i : good) {
            outlooks.push_back(motions[i].foresee(cameras[i], time_s, settings.horizon));
        }
    }
    bodies.clear();
    trajectory_moments.clear();
    for (const BodyNeed& body : all_bodies) {
        if (is_good(body)) {
            bodies.push_back(body);
            trajectory_moments.insert(trajectory_moments.end(), body.trajectory.begin(), body.trajectory.end());
            // who rises over ground comes down again
            if (body.trajectory.empty()) bodies.back().velocity.z() = std::min(0.0, body.velocity.z());
        } else {
            ++stats.refused_needs;
        }
    }
    // finish() looks again, when the caller's are gone
    std::size_t first = 0;
    for (BodyNeed& body : bodies) {
        body.trajectory = std::span<const BodyMoment>(trajectory_moments).subspan(first, body.trajectory.size());
        first += body.trajectory.size();
    }
    return is_due;
}

// Contact goes first: further ahead than it takes to load, a body is only guessed at.
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
        needs.find(tree, outlooks, contact, times, time_s, !waits_for_all());
    stats.bytes_used += found.used;
    stats.bytes_awaited = found.awaited;
    std::vector<Wish>& wishes = needs.wishes();
    std::sort(wishes.begin(), wishes.end(), internal::goes_before);
    count_late();
    count_groundless();
    count_waits();
    room.begin(outlooks, !bodies.empty() || !tickets.empty(), stats);
}

void Pager::State::count_late() {
    stats.late_chunks = 0;
    for (const Wish& wish : needs.wishes()) {
        stats.late_chunks +=
            wish.need.is_needed_now() && wish.need.why != NeedClass::speculation ? 1u : 0u;
    }
}

void Pager::State::count_groundless() {
    stats.groundless_bodies = 0;
    std::size_t last = bodies.size();
    for (const internal::ContactNeeds::Stand& stand : contact.stands()) {
        if (stand.body == last || tree.find(stand.key) != ChunkTree::kNone) continue;
        last = stand.body;  // they are in order of bodies
        ++stats.groundless_bodies;
    }
    stats.cut_needs += contact.is_cut() ? 1u : 0u;
}

// A chunk that has been missed for a while will be missed as long again: whoever should have passed it
// may be waiting for it.
void Pager::State::count_waits() {
    std::map<ChunkKey, double> missed;
    for (Wish& wish : needs.wishes()) {
        if (wish.need.why != NeedClass::contact || !wish.need.is_needed_now()) continue;
        const auto before = missed_since_s.find(wish.key);
        const double since_s = before == missed_since_s.end() ? time_s : before->second;
        missed[wish.key] = since_s;
        wish.need.end_s = std::max(wish.need.end_s, time_s - since_s);
    }
    missed_since_s = std::move(missed);
}

// Takes every fade one step on.
void Pager::State::fade() {
    stats.fading_chunks = 0;
    for (ChunkTree::Index i = 0; i < tree.capacity(); ++i) {
        ChunkTree::Node& node = tree[i];
        if (!node.chunk) continue;
        const bool is_new = std::exchange(node.is_new, false);
        if (node.inverse_fade == 1.0 && !is_new && !node.is_leaving) continue;
        if (may_jump || node.parent == ChunkTree::kNone) {
            node.inverse_fade = 1.0;
        } else {
            node.inverse_fade = internal::faded_on(room.watch_of(node), is_new, node.is_leaving);
        }
        stats.fading_chunks += node.inverse_fade > 1.0 ? 1u : 0u;
    }
}

void Pager::State::publish() {
    std::vector<ChunkKey> gone = room.take_gone();
    for (const ChunkKey& key : gone) evicted_s[key] = time_s;
    if (may_jump) gone_in_finish.insert(gone.begin(), gone.end());
    std::erase_if(evicted_s,
                  [this](const auto& entry) { return time_s - entry.second > settings.horizon; });
    // what came and went since the last set was in none
    std::erase_if(come, [this](const std::shared_ptr<const Chunk>& chunk) {
        const ChunkTree::Index index = tree.find(chunk->key);
        return index == ChunkTree::kNone || tree[index].chunk != chunk;
    });
    std::sort(gone.begin(), gone.end(), ResidentSet::Order());
    gone.erase(std::unique(gone.begin(), gone.end()), gone.end());
    std::erase_if(gone,
                  [this](const ChunkKey& key) { return set->find(key) == ResidentSet::kNone; });

    const auto is_before = [](const Placed& a, const Placed& b) {
        return ResidentSet::Order()(a.key, b.key);
    };
    std::erase_if(order, [&](const Placed& placed) {
        return std::binary_search(gone.begin(), gone.end(), placed.key, ResidentSet::Order());
    });
    const auto middle = static_cast<std::ptrdiff_t>(order.size());
    for (const auto& chunk : come) order.push_back({chunk->key, tree.find(chunk->key)});
    std::sort(order.begin() + middle, order.end(), is_before);
    std::inplace_merge(order.begin(), order.begin() + middle, order.end(), is_before);

    std::vector<float> fades;
    fades.reserve(order.size());
    for (const Placed& placed : order) {
        fades.push_back(internal::fade_of(tree[placed.index].inverse_fade));
    }
    if (!gone.empty() || !come.empty()) {
        set = std::make_shared<const ResidentSet>(*set, gone, std::move(come), std::move(fades),
                                                  ++epoch);
        come.clear();
    } else if (!std::equal(fades.begin(), fades.end(), set->fades().begin())) {
        set = std::make_shared<const ResidentSet>(*set, std::move(fades), ++epoch);
    }
}

}  // namespace terrane
