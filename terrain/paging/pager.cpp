// SPDX-License-Identifier: MIT
//
// Sources:
//   P. Cozzi, K. Ring. 3D Engine Design for Virtual Globes, 2011, ch. 12. (replacement by need, parents
//   stay while children are resident)
// Deviations: the ceiling is enforced before a load is begun, not after it has arrived; contact asks
// in its own name and goes first; motion is followed ahead over a horizon; chunks fade in and out.
#include "loader.h"
#include "need.h"

#include <terrane/terrain/pager.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace terrane {
namespace {

using internal::Clients;
using internal::Need;
using internal::NeedClass;

// A load must be wanted this much more than what it evicts, or the two would take turns.
constexpr double kEvictionGain = 1.25;
constexpr double kFirstRetry =
    0.1;  // seconds after the first failure, doubled with each further one
constexpr double kLastRetry = 10.0;
// Loads handed to each worker at a time: enough to keep it busy between two updates.
constexpr std::size_t kQueuePerWorker = 8;
// Chunks that fade out at the same time, to make room.
constexpr std::size_t kMostLeaving = 16;
// An evicted chunk that somebody holds longer, in updates, is not waited for.
constexpr std::uint64_t kHeldUpdates = 4;

struct Resident {
    std::shared_ptr<const Chunk> chunk;
    Need need;
    int children = 0;
    double inverse_fade = 1.0;
    bool is_new = true;                    // not in a set yet
    std::optional<internal::Watch> watch;  // of this update, once somebody asked
};

// A chunk that was let go of: its bytes come free when nobody holds an old set any more.
struct Evicted {
    std::weak_ptr<const Chunk> chunk;
    std::size_t bytes = 0;
    std::uint64_t update = 0;
};

enum class Room {
    free,
    later,  // enough is about to come free
    none,
};

struct Failure {
    int count = 0;
    double retry_s = 0.0;
};

struct Wanted {
    ChunkKey key;
    Need need;
};

bool goes_before(const Wanted& a, const Wanted& b) {
    if (a.need.goes_before(b.need)) return true;
    if (b.need.goes_before(a.need)) return false;
    return a.key < b.key;
}

// Whether a load for `wanted` may push out something that is needed as `held`.
bool outweighs(const Need& wanted, const Need& held) {
    if (!held.is_wanted()) return true;
    if (wanted.why != held.why) return wanted.why < held.why;
    return wanted.why != NeedClass::contact && wanted.value > kEvictionGain * held.value;
}

float fade_of(const Resident& entry) {
    const auto fade = static_cast<float>(1.0 / entry.inverse_fade);
    return static_cast<double>(fade) * entry.inverse_fade > 1.0 ? std::nextafter(fade, 0.0f) : fade;
}

}  // namespace

struct Pager::State {
    std::shared_ptr<const HeightSource> source;
    PagerSettings settings;
    int contact_level = 0;
    std::shared_ptr<internal::ByteCount> bytes = std::make_shared<internal::ByteCount>(0);

    std::map<ChunkKey, Resident> resident;
    std::map<ChunkKey, Failure> failures;
    std::map<Ticket, internal::RegionNeed> tickets;
    Ticket next_ticket = 1;
    Clients clients;
    std::vector<std::optional<internal::Camera::Before>> views;  // of the last update, by place
    std::vector<Wanted> absent;                                  // best first
    std::vector<ChunkKey> leaving;         // they fade out, for loads that wait for their bytes
    std::vector<ChunkKey> leaving_before;  // ... in the last update
    std::vector<Evicted> evicted;
    std::uint64_t update = 0;
    bool may_jump = false;  // in finish(): nobody looks
    std::shared_ptr<const ResidentSet> set;
    std::vector<const Resident*> order;  // of the set's chunks
    std::uint64_t epoch = 0;
    bool changed = false;  // chunks came or went since the last set
    bool faded = false;
    PagerStats stats;
    std::unique_ptr<internal::Loader> loader;  // last: stopped first

    void take_clients(std::span<const CameraNeed> cameras, std::span<const BodyNeed> bodies,
                      double time_s);
    void take_in(const ChunkKey& key, Result<std::shared_ptr<const Chunk>> chunk);
    void take_finished();
    void find_wanted();
    void descend(Resident& parent);
    bool is_waiting_to_retry(const ChunkKey& key) const;
    const internal::Watch& watch(Resident& entry);
    bool is_visible(Resident& entry);
    std::size_t soon_free_bytes();
    std::map<ChunkKey, Resident>::iterator find_victim(const Need& need);
    void evict(std::map<ChunkKey, Resident>::iterator victim);
    Room make_room(const Need& need, std::size_t claim_count);
    bool load_batch();
    bool queue_loads();
    void fade();
    void publish();
    void count_bytes();
};

// Needs that are not finite are refused, and counted; the other ones go on.
void Pager::State::take_clients(std::span<const CameraNeed> cameras,
                                std::span<const BodyNeed> bodies, double time_s) {
    clients.cameras.clear();
    clients.bodies.clear();
    clients.regions.clear();
    if (std::isfinite(time_s)) clients.time_s = std::max(clients.time_s, time_s);
    views.resize(cameras.size());
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const CameraNeed& camera = cameras[i];
        if (check(camera.view) && camera.velocity.allFinite() && camera.threshold_px > 0.0) {
            internal::Camera& taken = clients.cameras.emplace_back(camera);
            taken.before = views[i];
            views[i] = {camera.view.eye_world, taken.frustum};
        } else {
            ++stats.refused_needs;
            views[i].reset();
        }
    }
    for (const BodyNeed& body : bodies) {
        if (body.centre_world.allFinite() && body.velocity.allFinite() && body.radius >= 0.0 &&
            std::isfinite(body.radius)) {
            clients.bodies.push_back(body);
        } else {
            ++stats.refused_needs;
        }
    }
    for (const auto& [ticket, region] : tickets) clients.regions.push_back(region);
}

void Pager::State::take_in(const ChunkKey& key, Result<std::shared_ptr<const Chunk>> chunk) {
    if (!chunk) {
        ++stats.failed;
        Failure& failure = failures[key];
        failure.retry_s =
            clients.time_s +
            std::min(kLastRetry,
                     kFirstRetry * static_cast<double>(1 << std::min(failure.count, 10)));
        ++failure.count;
        return;
    }
    failures.erase(key);
    if (key.level > 0) {
        const auto parent = resident.find(key.parent());
        // evicted meanwhile: without it the chunk cannot be drawn or found
        if (parent == resident.end()) {
            ++stats.cancelled;
            return;
        }
        ++parent->second.children;
    }
    ++stats.loaded;
    resident[key].chunk = std::move(*chunk);
    changed = true;
}

void Pager::State::take_finished() {
    if (!loader) return;
    for (internal::Loaded& loaded : loader->take_finished()) {
        take_in(loaded.key, std::move(loaded.chunk));
    }
}

bool Pager::State::is_waiting_to_retry(const ChunkKey& key) const {
    const auto failure = failures.find(key);
    return failure != failures.end() && clients.time_s < failure->second.retry_s;
}

// A parent is needed as much as what hangs below it, absent chunks too: or it would be evicted to
// make room for its own child.
void Pager::State::descend(Resident& parent) {
    const Lattice& lattice = source->lattice();
    const ChunkKey& key = parent.chunk->key;
    if (key.level == lattice.finest_level) return;
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const ChunkKey child = key.child(quadrant);
        Need need = internal::child_need(lattice, *parent.chunk, quadrant, clients, contact_level,
                                         settings.horizon);
        const auto found = resident.find(child);
        if (found != resident.end()) {
            found->second.need = need;
            if (need.is_wanted()) descend(found->second);
            need = found->second.need;
        } else if (need.is_wanted()) {
            absent.push_back({child, need});
        }
        if (need.goes_before(parent.need)) parent.need = need;
    }
}

// Walks down from the roots as far as anybody wants to go.
void Pager::State::find_wanted() {
    const Lattice& lattice = source->lattice();
    absent.clear();
    for (auto& [key, entry] : resident) {
        entry.need = {};
        entry.watch.reset();
    }
    for (std::int32_t y = 0; y < lattice.root_count_y; ++y) {
        for (std::int32_t x = 0; x < lattice.root_count_x; ++x) {
            const ChunkKey root{lattice.first_root_x + x, lattice.first_root_y + y, 0};
            const auto found = resident.find(root);
            if (found == resident.end()) {
                absent.push_back({root, {NeedClass::root, 0.0}});
            } else {
                found->second.need = {NeedClass::root, 0.0};
                descend(found->second);
            }
        }
    }
    std::sort(absent.begin(), absent.end(), goes_before);
    stats.late_chunks = static_cast<std::size_t>(std::count_if(
        absent.begin(), absent.end(),
        [](const Wanted& wanted) { return wanted.need.why != NeedClass::predicted; }));
}

const internal::Watch& Pager::State::watch(Resident& entry) {
    if (!entry.watch) {
        const Chunk& chunk = *entry.chunk;
        entry.watch = internal::watch(source->lattice(), chunk, clients,
                                      entry.inverse_fade);
    }
    return *entry.watch;
}

// Whether somebody would see it go.
bool Pager::State::is_visible(Resident& entry) {
    return !entry.is_new && watch(entry).ratio > entry.inverse_fade;
}

std::size_t Pager::State::soon_free_bytes() {
    std::erase_if(evicted, [this](const Evicted& gone) {
        return gone.chunk.expired() || update > gone.update + kHeldUpdates;
    });
    std::size_t sum = 0;
    for (const Evicted& gone : evicted) sum += gone.bytes;
    for (const ChunkKey& key : leaving) {
        const auto found = resident.find(key);
        if (found != resident.end()) sum += found->second.chunk->bytes();
    }
    return sum;
}

// What is needed least: of what nobody would see go, else of what fades out already, else of all.
// Children go before their parents.
std::map<ChunkKey, Resident>::iterator Pager::State::find_victim(const Need& need) {
    const auto is_in = [](const std::vector<ChunkKey>& keys, const ChunkKey& key) {
        return std::find(keys.begin(), keys.end(), key) != keys.end();
    };
    auto victim = resident.end();
    int victim_rank = 0;
    for (auto candidate = resident.begin(); candidate != resident.end(); ++candidate) {
        Resident& entry = candidate->second;
        if (entry.children > 0 || !outweighs(need, entry.need)) continue;
        if (is_in(leaving, candidate->first)) continue;
        int rank = 0;
        if (is_visible(entry)) rank = is_in(leaving_before, candidate->first) ? 1 : 2;
        if (victim == resident.end() || rank < victim_rank ||
            (rank == victim_rank && victim->second.need.goes_before(entry.need))) {
            victim = candidate;
            victim_rank = rank;
        }
    }
    return victim;
}

void Pager::State::evict(std::map<ChunkKey, Resident>::iterator victim) {
    const ChunkKey key = victim->first;
    evicted.push_back({victim->second.chunk, victim->second.chunk->bytes(), update});
    if (key.level > 0) --resident.find(key.parent())->second.children;
    resident.erase(victim);
    std::erase(leaving, key);
    ++stats.evicted;
    changed = true;
    // the bytes come free when nobody holds the old set any more
    set.reset();
}

// Evicts until one more chunk fits; what is seen fades out first, unless ground is waiting for it.
//
// @param claim_count loads that were let in before and have not begun, and those that wait
Room Pager::State::make_room(const Need& need, std::size_t claim_count) {
    const bool is_urgent = need.why <= NeedClass::contact;
    for (;;) {
        const std::size_t soon_free = soon_free_bytes();
        const std::size_t wanted = bytes->load() + (claim_count + 1) * Chunk::max_bytes();
        if (wanted <= settings.memory_bytes) return Room::free;
        if (wanted <= settings.memory_bytes + soon_free) {
            ++stats.over_ceiling;
            return Room::later;
        }
        const auto victim = find_victim(need);
        const bool has_victim = victim != resident.end();
        const bool is_seen = has_victim && !may_jump && is_visible(victim->second);
        const bool must_fade = is_seen && !is_urgent;
        if (!has_victim || (must_fade && leaving.size() == kMostLeaving)) {
            ++stats.over_ceiling;
            return Room::none;
        }
        if (must_fade) {
            leaving.push_back(victim->first);
        } else {
            stats.hard_evictions += is_seen ? 1u : 0u;
            evict(victim);
        }
    }
}

// Synchronous: reads everything that is wanted and absent now. False where nothing was read.
bool Pager::State::load_batch() {
    bool any = false;
    std::size_t waiting_count = 0;
    leaving.clear();
    for (const Wanted& wanted : std::vector<Wanted>(absent)) {
        if (is_waiting_to_retry(wanted.key)) continue;
        // making room for a better one may have evicted its parent
        if (wanted.key.level > 0 && !resident.contains(wanted.key.parent())) continue;
        const Room room = make_room(wanted.need, waiting_count);
        if (room == Room::none) break;
        if (room == Room::later) {
            ++waiting_count;
            continue;
        }
        bytes->fetch_add(Chunk::max_bytes());
        count_bytes();
        auto loaded = internal::load_counted(*source, wanted.key, bytes);
        internal::settle(*bytes, loaded);
        take_in(wanted.key, std::move(loaded));
        // or the next one of the batch would take it for unwanted
        if (const auto here = resident.find(wanted.key); here != resident.end()) {
            here->second.need = wanted.need;
        }
        any = true;
    }
    return any;
}

// False where nothing is under way any more, and nothing more can be.
bool Pager::State::queue_loads() {
    // nothing begins between here and the new queue: what is admitted below stays within the ceiling
    const std::vector<ChunkKey> old = loader->clear_queue();
    const std::vector<ChunkKey> begun = loader->begun();
    const auto is_in = [](const std::vector<ChunkKey>& keys, const ChunkKey& key) {
        return std::find(keys.begin(), keys.end(), key) != keys.end();
    };
    const std::size_t most = kQueuePerWorker * static_cast<std::size_t>(settings.worker_count);
    std::vector<ChunkKey> keys;
    std::size_t waiting_count = 0;
    leaving.clear();
    for (const Wanted& wanted : absent) {
        if (keys.size() + waiting_count == most) break;
        if (is_waiting_to_retry(wanted.key) || is_in(begun, wanted.key)) continue;
        if (wanted.key.level > 0 && !resident.contains(wanted.key.parent())) continue;
        const Room room = make_room(wanted.need, keys.size() + waiting_count);
        if (room == Room::none) break;
        if (room == Room::later) {
            ++waiting_count;
        } else {
            keys.push_back(wanted.key);
        }
    }
    for (const ChunkKey& key : old) stats.cancelled += is_in(keys, key) ? 0u : 1u;
    const bool is_busy = !begun.empty() || !keys.empty();
    loader->queue(std::move(keys));
    count_bytes();
    return is_busy;
}

// Takes every fade one step on.
void Pager::State::fade() {
    stats.fading_chunks = 0;
    for (auto& [key, entry] : resident) {
        const bool is_leaving = std::find(leaving.begin(), leaving.end(), key) != leaving.end();
        const bool is_new = std::exchange(entry.is_new, false);
        if (entry.inverse_fade == 1.0 && !is_new && !is_leaving) continue;
        const double before = entry.inverse_fade;
        if (may_jump || key.level == 0) {
            entry.inverse_fade = 1.0;
        } else {
            const internal::Watch& seen = watch(entry);
            if (is_new) {
                entry.inverse_fade = std::max(1.0, seen.ratio);
            } else if (is_leaving) {
                entry.inverse_fade = std::max(before, std::min(before + seen.step, seen.ratio));
            } else {
                // below what hides it nothing is seen
                entry.inverse_fade = std::max(1.0, std::min(before, seen.ratio) - seen.step);
            }
        }
        faded = faded || entry.inverse_fade != before;
        stats.fading_chunks += entry.inverse_fade > 1.0 ? 1u : 0u;
    }
}

void Pager::State::count_bytes() {
    if (loader) {
        const internal::Loader::Load load = loader->load();
        stats.in_flight_bytes = (load.queued + load.reading) * Chunk::max_bytes();
        stats.peak_bytes = std::max(stats.peak_bytes, load.bytes);
    } else {
        stats.peak_bytes = std::max(stats.peak_bytes, bytes->load());
    }
}

void Pager::State::publish() {
    if (set && !changed && !faded) return;
    std::vector<float> fades;
    fades.reserve(resident.size());
    if (set && !changed) {
        for (const Resident* entry : order) fades.push_back(fade_of(*entry));
        set = std::make_shared<const ResidentSet>(*set, std::move(fades), ++epoch);
    } else {
        std::vector<std::shared_ptr<const Chunk>> chunks;
        chunks.reserve(resident.size());
        for (const auto& [key, entry] : resident) {
            chunks.push_back(entry.chunk);
            fades.push_back(fade_of(entry));
        }
        set = std::make_shared<const ResidentSet>(source->lattice(), source->extent(),
                                                  std::move(chunks), fades, ++epoch);
        order.clear();
        for (const auto& chunk : set->chunks()) {
            order.push_back(&resident.find(chunk->key)->second);
        }
    }
    changed = false;
    faded = false;
}

Result<Pager> Pager::create(std::shared_ptr<const HeightSource> source,
                            const PagerSettings& settings) {
    if (!source) return fail(ErrorCode::invalid_argument, "a pager needs a source");
    if (const Result<void> good = check(source->lattice()); !good)
        return tl::unexpected(good.error());
    if (settings.worker_count < 0 || settings.worker_count > 256) {
        return fail(ErrorCode::invalid_argument,
                    "worker_count must be 0 to 256, got " + std::to_string(settings.worker_count));
    }
    if (!(settings.horizon >= 0.0) || !std::isfinite(settings.horizon)) {
        return fail(ErrorCode::invalid_argument,
                    "horizon must be >= 0 s, got " + std::to_string(settings.horizon));
    }
    if (!(settings.contact_spacing >= 0.0)) {
        return fail(ErrorCode::invalid_argument, "contact_spacing must be >= 0 m, got " +
                                                     std::to_string(settings.contact_spacing));
    }
    const Lattice& lattice = source->lattice();
    const std::size_t least = Chunk::max_bytes() * static_cast<std::size_t>(lattice.root_count_x) *
                              static_cast<std::size_t>(lattice.root_count_y);
    if (settings.memory_bytes < least) {
        return fail(ErrorCode::out_of_memory, "memory_bytes must hold the root squares, " +
                                                  std::to_string(least) + ", got " +
                                                  std::to_string(settings.memory_bytes));
    }
    auto state = std::make_unique<State>();
    state->settings = settings;
    state->contact_level = settings.contact_spacing > 0.0
                               ? lattice.level_for_spacing(settings.contact_spacing)
                               : lattice.finest_level;
    if (settings.worker_count > 0) {
        state->loader =
            std::make_unique<internal::Loader>(source, state->bytes, settings.worker_count);
    }
    state->source = std::move(source);
    state->publish();
    return Pager(std::move(state));
}

Pager::Pager(std::unique_ptr<State> state) : state_(std::move(state)) {}
Pager::Pager(Pager&&) noexcept = default;
Pager& Pager::operator=(Pager&&) noexcept = default;
Pager::~Pager() = default;

void Pager::update(std::span<const CameraNeed> cameras, std::span<const BodyNeed> bodies,
                   double time_s) {
    State& state = *state_;
    ++state.update;
    state.leaving_before = std::exchange(state.leaving, {});
    state.take_clients(cameras, bodies, time_s);
    state.take_finished();
    state.find_wanted();
    if (state.loader) {
        state.queue_loads();
    } else {
        while (!state.absent.empty() && state.load_batch()) state.find_wanted();
    }
    state.fade();
    state.publish();
    if (!state.loader) state.count_bytes();
}

void Pager::finish() {
    State& state = *state_;
    state.may_jump = true;
    if (state.loader) {
        for (;;) {
            state.loader->wait();
            state.take_finished();
            state.find_wanted();
            if (!state.queue_loads()) break;
        }
    } else {
        while (!state.absent.empty() && state.load_batch()) state.find_wanted();
    }
    state.leaving.clear();
    state.fade();
    state.publish();
    state.may_jump = false;
}

Pager::Ticket Pager::require(const WorldRect& region, double deadline_s) {
    const Ticket ticket = state_->next_ticket++;
    const bool is_finite = std::isfinite(region.west) && std::isfinite(region.south) &&
                           std::isfinite(region.east) && std::isfinite(region.north);
    if (!is_finite || std::isnan(deadline_s)) {
        ++state_->stats.refused_needs;
        return ticket;
    }
    state_->tickets[ticket] = {region, deadline_s};
    return ticket;
}

bool Pager::is_ready(Ticket ticket) const {
    const auto found = state_->tickets.find(ticket);
    if (found == state_->tickets.end()) return false;
    // down from the roots: each chunk of a level over the region must be there
    const Lattice& lattice = state_->source->lattice();
    std::vector<ChunkKey> open;
    for (std::int32_t y = 0; y < lattice.root_count_y; ++y) {
        for (std::int32_t x = 0; x < lattice.root_count_x; ++x) {
            open.push_back({lattice.first_root_x + x, lattice.first_root_y + y, 0});
        }
    }
    while (!open.empty()) {
        const ChunkKey key = open.back();
        open.pop_back();
        if (!internal::overlaps(lattice, key, found->second.region)) continue;
        if (!state_->resident.contains(key)) return false;
        if (key.level == state_->contact_level) continue;
        for (int quadrant = 0; quadrant < 4; ++quadrant) open.push_back(key.child(quadrant));
    }
    return true;
}

void Pager::release(Ticket ticket) { state_->tickets.erase(ticket); }

std::shared_ptr<const ResidentSet> Pager::resident() const { return state_->set; }

int Pager::contact_level() const { return state_->contact_level; }

PagerStats Pager::stats() const {
    PagerStats stats = state_->stats;
    stats.resident_bytes = state_->bytes->load();
    if (state_->loader) {
        const internal::Loader::Load load = state_->loader->load();
        stats.resident_bytes = load.bytes - (load.queued + load.reading) * Chunk::max_bytes();
    }
    stats.resident_chunks = state_->resident.size();
    return stats;
}

}  // namespace terrane
