// SPDX-License-Identifier: MIT
//
// Loading: queues and cancels loads, and inserts arriving chunks.
#include "paging/pager_state.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::ChunkTree;
using internal::LoadCandidate;
using internal::MemoryBudget;
using internal::NeedClass;
using internal::Orphan;

// Length of the loader's queue, in time and in loads per slot: long enough to keep the slots busy between two updates,
// short enough for priorities to change.
constexpr double kQueued_s = 0.1;
constexpr std::size_t kLeastQueued = 2;
constexpr std::size_t kMostQueued = 32;
// Chunks to be drawn are loaded once their slack is at most this, or earlier if slots would otherwise be short.
constexpr double kDrawnAhead_s = 0.8;
// Speculative loads may leave at most this share of all bytes read unused.
constexpr double kSpeculationShare = 0.14;
// Time after which an unneeded load is cancelled and an orphan is dropped.
constexpr double kStaleLoad_s = 0.2;

}  // namespace

// Returns false if the chunk's parent is not resident.
bool Pager::State::insert(std::shared_ptr<const Chunk> chunk, std::size_t bytes_read) {
    const ChunkKey key = chunk->key;
    if (key.level > 0) {
        const ChunkTree::Index parent = tree.find(key.parent());
        if (parent == ChunkTree::kNone) return false;
        const Chunk& above = *tree[parent].chunk;
        const auto quadrant = static_cast<std::size_t>(key.quadrant());
        needs.learn_decay(*chunk, static_cast<double>(above.quadrant_bound[quadrant]));
    }
    set.arrived.push_back(chunk);
    tree[tree.insert(std::move(chunk))].bytes_read = bytes_read;
    ++stats.loaded;
    return true;
}

void Pager::State::accept(FinishedLoad& load) {
    if (skips_fades) load.bytes_read = 0;
    stats.bytes_read += load.bytes_read;
    const auto begun = loads.in_flight.find(load.key);
    const std::size_t claimed_bytes = begun == loads.in_flight.end() ? 0 : begun->second.bytes;
    loads.in_flight.erase(load.key);
    if (!load.chunk) {
        if (load.chunk.error().code == ErrorCode::out_of_memory &&
            claimed_bytes < chunk_source.max_chunk_bytes(load.key)) {
            // The source or its size estimate has changed since the load started.
            ++stats.outdated;
            schedule.must_plan = true;
            return;
        }
        switch (load.chunk.error().code) {
            case ErrorCode::cancelled:
                break;
            case ErrorCode::timed_out:
                ++stats.timed_out;
                [[fallthrough]];
            default:
                ++stats.failed;
                loads.last_failure = load.chunk.error().message;
                loads.retries.failed(load.key, time_s);
        }
        return;
    }
    if (!chunk_source.is_current(**load.chunk)) {
        ++stats.outdated;
        schedule.must_plan = true;
        return;
    }
    loads.retries.succeeded(load.key);
    loads.times.add(load.key.level, load.seconds);
    if (load.key.level == 0 && !tree.window().contains(load.key)) {
        if (next_window.lattice.contains(load.key))
            next_window.roots[load.key] = {std::move(*load.chunk), load.bytes_read, time_s};
        return;
    }
    if (!insert(*load.chunk, load.bytes_read)) {
        loads.orphans[load.key] = {std::move(*load.chunk), load.bytes_read, time_s};
    }
}

bool Pager::State::take_finished() {
    std::vector<FinishedLoad> finished = loader->take_finished();
    std::stable_sort(
        finished.begin(), finished.end(),
        [](const FinishedLoad& a, const FinishedLoad& b) { return a.key.level < b.key.level; });
    for (FinishedLoad& load : finished) accept(load);
    adopt_orphans();
    return !finished.empty();
}

// Inserts orphans from coarse to fine, because one may be the parent of another.
void Pager::State::adopt_orphans() {
    if (loads.orphans.empty()) return;
    std::vector<ChunkKey> keys;
    for (const auto& [key, orphan] : loads.orphans) keys.push_back(key);
    std::stable_sort(keys.begin(), keys.end(),
                     [](const ChunkKey& a, const ChunkKey& b) { return a.level < b.level; });
    for (const ChunkKey& key : keys) {
        const Orphan& orphan = loads.orphans[key];
        if (insert(orphan.chunk, orphan.bytes_read) ||
            (!loads.has(key.parent()) && time_s - orphan.arrived_s > kStaleLoad_s)) {
            loads.orphans.erase(key);
        }
    }
}

// Cancels loads that have not been needed for kStaleLoad_s.
void Pager::State::cancel_stale_loads() {
    for (auto& [key, load] : loads.in_flight) load.is_needed = false;
    for (const LoadCandidate& candidate : needs.candidates()) {
        if (const auto found = loads.in_flight.find(candidate.key);
            found != loads.in_flight.end()) {
            found->second.is_needed = true;
            found->second.is_speculation = candidate.need.why == NeedClass::speculation;
        }
    }
    for (auto& [key, load] : loads.in_flight) {
        if (load.is_needed) {
            load.unneeded_since_s = time_s;
        } else if (!load.is_cancelled && time_s - load.unneeded_since_s > kStaleLoad_s) {
            load.is_cancelled = true;
            ++stats.cancelled;
            loader->cancel(key);
        }
    }
}

bool Pager::State::may_begin(const LoadCandidate& candidate, double arrival_s) const {
    const ChunkKey& key = candidate.key;
    if (loads.has(key) || evictions.in_finish.contains(key)) return false;
    if (loads.retries.must_wait(key, time_s)) return false;
    if (settings.policy == PagingPolicy::distance || waits_for_all() || schedule.is_clock_stalled)
        return true;
    return candidate.need.end_s >= arrival_s;
}

// Postpones loads of chunks to be drawn with more slack than kDrawnAhead_s, provided that all of them can still be
// loaded in time. Predictions for a nearer time are more often right, so that fewer bytes are wasted.
void Pager::State::postpone() {
    if (settings.policy == PagingPolicy::distance) return;
    double least_s = std::numeric_limits<double>::infinity();
    std::vector<LoadCandidate>& candidates = needs.candidates();
    for (auto candidate = candidates.rbegin(); candidate != candidates.rend(); ++candidate) {
        if (candidate->need.why != NeedClass::drawn) continue;
        const double each_s = loads.times.expected_s(candidate->key.level) / loader->slots();
        least_s = std::min(candidate->slack_s, least_s - each_s);
        candidate->can_wait = least_s > kDrawnAhead_s;
    }
}

// Whether the share of unused bytes stays within its limit if one more speculative load starts.
bool Pager::State::may_speculate(std::size_t in_flight_count) const {
    const std::uint64_t idle = stats.bytes_read - stats.bytes_used -
                               std::min(stats.bytes_awaited, stats.bytes_read - stats.bytes_used);
    const auto may_be_idle = static_cast<double>(idle + (in_flight_count + 1) * Chunk::max_bytes());
    return may_be_idle <= kSpeculationShare * static_cast<double>(stats.bytes_read);
}

// Returns whether any load is in flight.
bool Pager::State::queue_loads() {
    // no load starts before queue() below, so admitted loads stay within the ceiling
    std::vector<LoadRequest> old = loader->take_queue();
    std::vector<ChunkKey> old_keys;
    for (const LoadRequest& request : old) {
        old_keys.push_back(request.key);
        loads.in_flight.erase(request.key);
    }
    cancel_stale_loads();

    const auto slots = static_cast<std::size_t>(loader->slots());
    const double load_s = loads.times.expected_s(contact_level);
    const auto for_slot = static_cast<std::size_t>(std::clamp(kQueued_s / std::max(load_s, 1e-6),
                                                              static_cast<double>(kLeastQueued),
                                                              static_cast<double>(kMostQueued)));
    const std::size_t most = std::max<std::size_t>(slots * for_slot, 1);
    std::size_t speculation_count = 0;
    for (const auto& [key, load] : loads.in_flight)
        speculation_count += load.is_speculation ? 1u : 0u;
    std::size_t needed_count = loads.in_flight.size() - speculation_count;

    postpone();
    std::vector<LoadRequest> requests;
    std::map<ChunkKey, internal::LoadInProgress> queued;
    std::size_t pending_count = 0;
    for (const LoadCandidate& candidate : needs.candidates()) {
        if (requests.size() + pending_count >= most) break;
        const bool is_speculation = candidate.need.why == NeedClass::speculation;
        // speculation uses idle slots only
        if (is_speculation && !waits_for_all() &&
            (2 * needed_count >= slots || !may_speculate(speculation_count))) {
            break;
        }
        if (candidate.can_wait && !waits_for_all()) continue;
        // loads ahead, including this one
        const std::size_t ahead = requests.size() + loads.in_flight.size() + 1;
        const double turns =
            static_cast<double>(std::max(ahead, slots)) / static_cast<double>(slots);
        if (!may_begin(candidate, turns * loads.times.expected_s(candidate.key.level))) continue;
        if (candidate.key.level > 0) {
            const ChunkKey parent = candidate.key.parent();
            if (tree.find(parent) == ChunkTree::kNone && !loads.has(parent) &&
                !queued.contains(parent)) {
                continue;
            }
        }
        const std::size_t needed_bytes = chunk_source.max_chunk_bytes(candidate.key);
        ByteClaim claim;
        MemoryBudget::Admission admission = MemoryBudget::Admission::granted;
        if (!old.empty() && old.back().claim.bytes() == needed_bytes &&
            budget.may_keep_claim(candidate.need)) {
            claim = std::move(old.back().claim);
            old.pop_back();
        } else {
            admission = budget.admit(candidate.need, needed_bytes, candidate.slack_s, claim);
        }
        if (admission == MemoryBudget::Admission::refused) break;
        if (admission == MemoryBudget::Admission::pending) {
            ++pending_count;
            continue;
        }
        ++(is_speculation ? speculation_count : needed_count);
        queued[candidate.key] = {
            .bytes = needed_bytes, .unneeded_since_s = time_s, .is_speculation = is_speculation};
        requests.push_back({candidate.key, std::move(claim)});
    }
    for (const auto& [key, load] : queued) {
        loads.in_flight[key] = load;
        const auto evicted = evictions.times_s.find(key);
        if (evicted != evictions.times_s.end() && time_s - evicted->second < settings.horizon)
            ++stats.reloaded;
        if (evicted != evictions.times_s.end()) evictions.times_s.erase(evicted);
    }
    for (const ChunkKey& key : old_keys) stats.cancelled += queued.contains(key) ? 0u : 1u;
    old.clear();
    stats.peak_bytes = std::max(stats.peak_bytes, budget.bytes());
    const bool is_busy = !loads.in_flight.empty();
    loader->queue(std::move(requests));
    return is_busy;
}

// Planning: clients, their needs, and the fades of chunks in view.

namespace {

using internal::ChunkTree;
using internal::LoadCandidate;
using internal::NeedClass;
using internal::SetEntry;

// Tolerance for times that are sums of frame times.
constexpr double kSlack_s = 1e-6;
// Contact is predicted for the time of this many consecutive loads, and at least kContactAhead_s.
constexpr double kContactLoads = 4.0;
constexpr double kContactAhead_s = 1.0;

bool is_good(const CameraNeed& camera) {
    const bool has_good_trajectory = std::all_of(
        camera.trajectory.begin(), camera.trajectory.end(), [](const CameraMoment& moment) {
            return std::isfinite(moment.time_s) && moment.eye_world.allFinite() &&
                   moment.forward.allFinite() && moment.up.allFinite();
        });
    return camera.view.validate() && camera.velocity.allFinite() && camera.threshold_px > 0.0 &&
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

std::uint64_t internal::Clients::take_bodies(std::span<const BodyNeed> all_bodies) {
    body_count = all_bodies.size();
    bodies.clear();
    trajectory_moments.clear();
    for (const BodyNeed& body : all_bodies) {
        if (!is_good(body)) continue;
        bodies.push_back(body);
        trajectory_moments.insert(trajectory_moments.end(), body.trajectory.begin(),
                                  body.trajectory.end());
        // a rising body falls again: its upward velocity is ignored
        if (body.trajectory.empty()) bodies.back().velocity.z() = std::min(0.0, body.velocity.z());
    }
    // The spans refer to the copies, because finish() plans again when the caller's data may be gone.
    std::size_t first = 0;
    for (BodyNeed& body : bodies) {
        body.trajectory =
            std::span<const BodyMoment>(trajectory_moments).subspan(first, body.trajectory.size());
        first += body.trajectory.size();
    }
    return body_count - bodies.size();
}

// Records cameras and bodies, and refuses and counts invalid ones. Returns whether a plan is due.
bool Pager::State::update_clients(std::span<const CameraNeed> cameras,
                                  std::span<const BodyNeed> all_bodies, double now_s) {
    const double before_s = time_s;
    if (std::isfinite(now_s)) time_s = std::max(time_s, now_s);
    const double passed_s = time_s - schedule.planned_s;
    // the caller has no clock, or updates several times at the same time
    schedule.is_clock_stalled = time_s == before_s;
    bool is_due = is_inline || schedule.must_plan || schedule.is_clock_stalled ||
                  !(passed_s < internal::kTick_s - kSlack_s);
    is_due =
        is_due || clients.views.size() != cameras.size() || clients.body_count != all_bodies.size();
    schedule.must_plan = false;
    clients.observers.clear();
    clients.views.resize(cameras.size());
    clients.motions.resize(cameras.size());
    std::vector<std::size_t> good;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const CameraNeed& camera = cameras[i];
        if (!is_good(camera)) {
            ++stats.refused_needs;
            clients.views[i].reset();
            clients.motions[i].reset();
            continue;
        }
        good.push_back(i);
        const Frustum frustum = make_frustum(camera.view);
        is_due = is_due || !clients.views[i];
        clients.observers.push_back({camera.view, frustum, camera.threshold_px, clients.views[i]});
        clients.views[i] = {camera.view.eye_world, frustum};
        is_due = clients.motions[i].observe(camera, time_s) || is_due;
    }
    if (is_due) {
        schedule.planned_s = time_s;
        clients.predicted_views.clear();
        for (const std::size_t i : good) {
            clients.predicted_views.push_back(
                clients.motions[i].predict(cameras[i], time_s, settings.horizon));
        }
    }
    stats.refused_needs += clients.take_bodies(all_bodies);
    return is_due;
}

// Contact has priority over drawing, so it is predicted no further ahead than loading takes.
double Pager::State::contact_horizon() const {
    if (settings.policy == PagingPolicy::distance) return 0.0;
    if (is_inline) return settings.horizon;
    return std::min(
        settings.horizon,
        std::max(kContactAhead_s, kContactLoads * loads.times.expected_s(contact_level)));
}

void Pager::State::plan() {
    std::vector<internal::RegionNeed> regions;
    for (const auto& [id, region] : required_regions.by_id) regions.push_back(region);
    contact.find(clients.bodies, regions, time_s, contact_horizon());
    const internal::NeedFinder::Bytes found =
        needs.find(tree, clients.predicted_views, contact, loads.times, time_s, !waits_for_all());
    stats.bytes_used += found.used;
    stats.bytes_awaited = found.awaited;
    std::vector<LoadCandidate>& candidates = needs.candidates();
    if (next_window.lattice != tree.window()) {
        constexpr double kForever = std::numeric_limits<double>::infinity();
        for (const ChunkKey& key : absent_next_roots()) {
            // roots in both windows are already candidates
            if (tree.window().contains(key)) continue;
            // Never late: frames need these root squares only after the window has moved.
            candidates.push_back(
                {key, {NeedClass::root, kForever, kForever, 0.0}, -loads.times.expected_s(0)});
        }
    }
    std::sort(candidates.begin(), candidates.end(), internal::has_priority_over);
    count_late();
    count_groundless();
    count_waits();
    budget.begin_plan(clients.predicted_views,
                      !clients.bodies.empty() || !required_regions.by_id.empty(), stats);
    budget.keep_ceiling();
    if (replacements.wanted_bytes > 0) budget.make_room(replacements.wanted_bytes);
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
    std::size_t last = clients.bodies.size();
    for (const internal::ContactNeeds::CurrentContact& touched : contact.current_contacts()) {
        if (touched.body == last || tree.find(touched.key) != ChunkTree::kNone) continue;
        last = touched.body;  // ordered by body
        ++stats.groundless_bodies;
    }
    stats.cut_needs += contact.is_cut() ? 1u : 0u;
}

// Assumes that contact with an absent chunk will last as long as it has lasted so far: the body may be parked there.
void Pager::State::count_waits() {
    std::map<ChunkKey, double> missed;
    for (LoadCandidate& candidate : needs.candidates()) {
        if (candidate.need.why != NeedClass::contact || !candidate.need.is_needed_now()) continue;
        const auto before = loads.missing_since_s.find(candidate.key);
        const double since_s = before == loads.missing_since_s.end() ? time_s : before->second;
        missed[candidate.key] = since_s;
        candidate.need.end_s = std::max(candidate.need.end_s, time_s - since_s);
    }
    loads.missing_since_s = std::move(missed);
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
    for (const ChunkKey& key : evicted) evictions.times_s[key] = time_s;
    if (skips_fades) evictions.in_finish.insert(evicted.begin(), evicted.end());
    std::erase_if(evictions.times_s,
                  [this](const auto& entry) { return time_s - entry.second > settings.horizon; });
    evicted.insert(evicted.end(), replacements.keys.begin(), replacements.keys.end());
    replacements.keys.clear();
    // drop chunks that were inserted and evicted since the last set
    std::erase_if(set.arrived, [this](const std::shared_ptr<const Chunk>& chunk) {
        const ChunkTree::Index index = tree.find(chunk->key);
        return index == ChunkTree::kNone || tree[index].chunk != chunk;
    });
    std::sort(evicted.begin(), evicted.end(), ResidentSet::Order());
    evicted.erase(std::unique(evicted.begin(), evicted.end()), evicted.end());
    std::erase_if(evicted, [this](const ChunkKey& key) {
        return set.chunks->find(key) == ResidentSet::kNone;
    });

    const auto is_before = [](const SetEntry& a, const SetEntry& b) {
        return ResidentSet::Order()(a.key, b.key);
    };
    std::erase_if(set.order, [&](const SetEntry& placed) {
        return std::binary_search(evicted.begin(), evicted.end(), placed.key, ResidentSet::Order());
    });
    const auto middle = static_cast<std::ptrdiff_t>(set.order.size());
    for (const auto& chunk : set.arrived) set.order.push_back({chunk->key, tree.find(chunk->key)});
    std::sort(set.order.begin() + middle, set.order.end(), is_before);
    std::inplace_merge(set.order.begin(), set.order.begin() + middle, set.order.end(), is_before);

    std::vector<float> fades;
    fades.reserve(set.order.size());
    for (const SetEntry& placed : set.order) {
        fades.push_back(internal::fade_of(tree[placed.index].inverse_fade));
    }
    if (!evicted.empty() || !set.arrived.empty()) {
        set.chunks = std::make_shared<const ResidentSet>(*set.chunks, evicted,
                                                         std::move(set.arrived), std::move(fades),
                                                         set.chunks->epoch() + 1, tree.window());
        set.arrived.clear();
    } else if (!std::equal(fades.begin(), fades.end(), set.chunks->fades().begin())) {
        set.chunks = std::make_shared<const ResidentSet>(*set.chunks, std::move(fades),
                                                         set.chunks->epoch() + 1);
    }
}

}  // namespace terrane
