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
bool Pager::State::insert(std::shared_ptr<const Chunk> chunk, std::size_t bytes_read,
                          bool is_to_be_drawn) {
    const ChunkKey key = chunk->key;
    if (key.level > 0) {
        const ChunkTree::Index parent = tree.find(key.parent());
        if (parent == ChunkTree::kNone) return false;
        needs.learn_decay(*chunk, tree[parent].quadrant_bound(key.quadrant()));
    }
    if (const ChunkTree::Index held = tree.find(key);
        held != ChunkTree::kNone && tree[held].chunk != nullptr) {
        ++stats.outdated;  // the outline that it was to replace has been replaced meanwhile
        return true;
    }
    const ChunkTree::Index index = tree.insert(std::move(chunk));
    tree[index].bytes_read = bytes_read;
    tree[index].was_needed = false;
    if (!is_to_be_drawn) budget.outline(index);
    ++stats.loaded;
    return true;
}

void Pager::State::accept(FinishedLoad& load) {
    if (skips_fades) load.bytes_read = 0;
    stats.bytes_read += load.bytes_read;
    const auto begun = loads.in_flight.find(load.key);
    const std::size_t claimed_bytes = begun == loads.in_flight.end() ? 0 : begun->second.bytes;
    const bool is_to_be_drawn = begun == loads.in_flight.end() || begun->second.is_to_be_drawn;
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
            next_window.roots[load.key] = {std::move(*load.chunk), load.bytes_read, true, time_s};
        return;
    }
    if (!insert(*load.chunk, load.bytes_read, is_to_be_drawn)) {
        loads.orphans[load.key] = {std::move(*load.chunk), load.bytes_read, is_to_be_drawn, time_s};
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
        if (insert(orphan.chunk, orphan.bytes_read, orphan.is_to_be_drawn) ||
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
            found->second.is_to_be_drawn = candidate.is_to_be_drawn;
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

// Sorts the candidates by priority up to an index. What comes first is determined by a total order, so that it does not
// depend on how far the candidates are sorted at a time.
void Pager::State::sort_candidates_up_to(std::size_t index) {
    std::vector<LoadCandidate>& candidates = needs.candidates();
    while (sorted_count <= index && sorted_count < candidates.size()) {
        constexpr std::size_t kLeastAtOnce = 256;
        const std::size_t end =
            std::min(candidates.size(), sorted_count + std::max(kLeastAtOnce, sorted_count));
        const auto at = [&](std::size_t i) {
            return candidates.begin() + static_cast<std::ptrdiff_t>(i);
        };
        if (end < candidates.size()) {
            std::nth_element(at(sorted_count), at(end), candidates.end(),
                             internal::has_priority_over);
        }
        std::sort(at(sorted_count), at(end), internal::has_priority_over);
        sorted_count = end;
    }
}

// Postpones loads of chunks to be drawn with more slack than kDrawnAhead_s, provided that all of them can still be
// loaded in time. Predictions for a nearer time are more often right, so that fewer bytes are wasted.
void Pager::State::postpone() {
    if (settings.policy == PagingPolicy::distance) return;
    double least_s = std::numeric_limits<double>::infinity();
    std::vector<LoadCandidate>& candidates = needs.candidates();
    const bool has_drawn = std::ranges::any_of(candidates, [](const LoadCandidate& candidate) {
        return candidate.need.why == NeedClass::drawn;
    });
    if (!has_drawn) return;
    sort_candidates_up_to(candidates.size());
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
    for (std::size_t i = 0; i < needs.candidates().size(); ++i) {
        if (requests.size() + pending_count >= most) break;
        sort_candidates_up_to(i);
        const LoadCandidate& candidate = needs.candidates()[i];
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
        queued[candidate.key] = {.bytes = needed_bytes,
                                 .unneeded_since_s = time_s,
                                 .is_speculation = is_speculation,
                                 .is_to_be_drawn = candidate.is_to_be_drawn};
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
    sorted_count = 0;
    ++schedule.count;
    count_late();
    count_groundless();
    count_waits();
    budget.begin_plan(clients.predicted_views, needs.needed(),
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
    std::size_t missing_count = 0;
    for (LoadCandidate& candidate : needs.candidates()) {
        if (candidate.need.why != NeedClass::contact || !candidate.need.is_needed_now()) continue;
        ++missing_count;
        internal::Loads::Missing& missing = loads.missing[candidate.key];
        if (missing.plan + 1 != schedule.count) missing.since_s = time_s;
        missing.plan = schedule.count;
        candidate.need.end_s = std::max(candidate.need.end_s, time_s - missing.since_s);
    }
    if (loads.missing.size() <= 2 * missing_count) return;
    std::erase_if(loads.missing,
                  [this](const auto& entry) { return entry.second.plan != schedule.count; });
}

// Advances every fade by one step.
void Pager::State::fade() {
    std::vector<ChunkTree::Index>& fading = set.fading;
    // nodes that were freed meanwhile, even if they hold other chunks now
    std::erase_if(fading, [this](ChunkTree::Index index) { return !tree[index].is_fading; });
    const auto add = [&](ChunkTree::Index index) {
        if (!tree[index].is_drawn || tree[index].is_fading) return;
        tree[index].is_fading = true;
        fading.push_back(index);
    };
    for (const ChunkTree::Index index : tree.take_shown()) add(index);
    for (const ChunkTree::Index index : budget.fading_out()) {
        if (tree[index].is_fading_out) add(index);
    }
    stats.fading_chunks = 0;
    for (const ChunkTree::Index index : fading) {
        ChunkTree::Node& node = tree[index];
        const bool is_new = std::exchange(node.is_new, false);
        const double before = node.inverse_fade;
        if (skips_fades || node.parent == ChunkTree::kNone || !node.is_drawn) {
            node.inverse_fade = 1.0;
        } else {
            node.inverse_fade = internal::next_inverse_fade(budget.visibility_of(index), is_new,
                                                            node.is_fading_out);
        }
        set.has_new_fades = set.has_new_fades || node.inverse_fade != before;
        stats.fading_chunks += node.inverse_fade > 1.0 ? 1u : 0u;
        node.is_fading = node.inverse_fade != 1.0 || node.is_fading_out;
    }
    std::erase_if(fading, [this](ChunkTree::Index index) { return !tree[index].is_fading; });
}

void Pager::State::record_evictions() {
    const std::vector<ChunkKey> evicted = budget.take_evicted();
    for (const ChunkKey& key : evicted) evictions.times_s[key] = time_s;
    if (skips_fades) evictions.in_finish.insert(evicted.begin(), evicted.end());
    std::erase_if(evictions.times_s,
                  [this](const auto& entry) { return time_s - entry.second > settings.horizon; });
}

std::vector<float> Pager::State::fades_in_order() const {
    std::vector<float> fades;
    fades.reserve(set.order.size());
    for (const SetEntry& placed : set.order) {
        fades.push_back(internal::fade_of(tree[placed.index].inverse_fade));
    }
    return fades;
}

// Makes a new set of what has changed since the last one.
void Pager::State::publish() {
    record_evictions();
    std::vector<ChunkKey> changes = tree.take_changes();
    std::sort(changes.begin(), changes.end(), ResidentSet::Order());
    changes.erase(std::unique(changes.begin(), changes.end()), changes.end());
    const auto is_same = [](const auto& a, const auto& b) {
        return !a.owner_before(b) && !b.owner_before(a);
    };
    std::vector<ChunkKey> evicted, removed;
    std::vector<SetEntry> placed;
    std::vector<std::shared_ptr<const Chunk>> arrived;
    std::vector<UndrawnChunk> undrawn;
    const ChunkTree::Node none{};
    for (const ChunkKey& key : changes) {
        const ChunkTree::Index index = tree.find(key);
        const ChunkTree::Node& node = index == ChunkTree::kNone ? none : tree[index];
        const std::int32_t drawn_before = set.chunks->find(key);
        std::shared_ptr<const Chunk> chunk;
        if (drawn_before != ResidentSet::kNone)
            chunk = set.chunks->chunks()[static_cast<std::size_t>(drawn_before)];
        const bool is_kept = node.is_drawn && chunk != nullptr && is_same(chunk, node.chunk);
        if (chunk != nullptr && !is_kept) evicted.push_back(key);
        if (node.is_drawn && !is_kept) {
            arrived.push_back(node.chunk);
            placed.push_back({key, index});
        }
        const UndrawnChunk* const before = set.chunks->find_undrawn(key);
        if (node.is_free() || node.is_drawn) {
            if (before != nullptr) removed.push_back(key);
        } else if (before == nullptr || !is_same(before->chunk, node.chunk) ||
                   !is_same(before->outline, node.outline)) {
            undrawn.push_back({key, node.chunk, node.outline});
        }
    }
    const std::uint64_t epoch = set.chunks->epoch() + 1;
    if (!evicted.empty() || !arrived.empty()) {
        const auto is_before = [](const SetEntry& a, const SetEntry& b) {
            return ResidentSet::Order()(a.key, b.key);
        };
        std::erase_if(set.order, [&](const SetEntry& entry) {
            return std::binary_search(evicted.begin(), evicted.end(), entry.key,
                                      ResidentSet::Order());
        });
        const auto middle = static_cast<std::ptrdiff_t>(set.order.size());
        set.order.insert(set.order.end(), placed.begin(), placed.end());
        std::inplace_merge(set.order.begin(), set.order.begin() + middle, set.order.end(),
                           is_before);
        set.chunks = std::make_shared<const ResidentSet>(*set.chunks, evicted, std::move(arrived),
                                                         fades_in_order(), epoch, tree.window());
    } else if (set.has_new_fades) {
        std::vector<float> fades = fades_in_order();
        if (!std::equal(fades.begin(), fades.end(), set.chunks->fades().begin())) {
            set.chunks = std::make_shared<const ResidentSet>(*set.chunks, std::move(fades), epoch);
        }
    }
    set.has_new_fades = false;
    if (!removed.empty() || !undrawn.empty()) {
        set.chunks = std::make_shared<const ResidentSet>(*set.chunks, removed, undrawn, epoch);
    }
}

}  // namespace terrane
