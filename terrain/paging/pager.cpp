// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "chunk/resident_set.h"
#include "paging/chunk_loader.h"
#include "paging/pager_state.h"

#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace terrane {

namespace {

// Fails if a ceiling does not hold the root squares.
Result<void> check_ceiling(const HeightSource& source, std::size_t memory_bytes) {
    const Lattice& lattice = source.lattice();
    // While the window moves, the root squares of the old and the new window are in memory.
    const Lattice window = internal::first_root_window(lattice);
    const std::size_t windows = lattice.root_window > 0 ? 2 : 1;
    const ChunkSource& chunks = chunks_of(source);
    std::size_t least = 0;
    for (std::int32_t y = 0; y < window.root_count_y; ++y) {
        for (std::int32_t x = 0; x < window.root_count_x; ++x) {
            least += windows *
                     chunks.max_chunk_bytes({window.first_root_x + x, window.first_root_y + y, 0});
        }
    }
    if (memory_bytes >= least) return {};
    return fail(ErrorCode::out_of_memory, "memory_bytes must hold the root squares, " +
                                              std::to_string(least) + ", got " +
                                              std::to_string(memory_bytes));
}

}  // namespace

// With an inline loader: alternates loading and planning until nothing changes.
void Pager::State::load_until_stable() {
    constexpr int kMostRounds = 1000;
    for (int round = 0; round < kMostRounds; ++round) {
        queue_loads();
        const bool has_loaded = take_finished();
        move_window();
        const bool has_evicted = budget.has_evicted();
        if (!has_loaded && !has_evicted) return;
        // evicted chunks are released with the set that held them
        if (has_evicted) publish();
        plan();
    }
}

Result<Pager> Pager::create(std::shared_ptr<const HeightSource> source,
                            const PagerSettings& settings) {
    if (!source) return fail(ErrorCode::invalid_argument, "a pager needs a source");
    TERRANE_TRY(check_range("worker_count", settings.worker_count, 0, 256));
    if (settings.worker_count == 0) {
        Result<Pager> pager =
            create(source, settings, std::make_unique<internal::InlineLoader>(source));
        if (pager) pager->state_->is_inline = true;
        return pager;
    }
    TERRANE_TRY(auto loader, ThreadLoader::create(source, {.worker_count = settings.worker_count,
                                                           .timeout = settings.load_timeout}));
    return create(std::move(source), settings, std::move(loader));
}

Result<Pager> Pager::create(std::shared_ptr<const HeightSource> source,
                            const PagerSettings& settings, std::unique_ptr<ChunkLoader> loader) {
    if (!source) return fail(ErrorCode::invalid_argument, "a pager needs a source");
    if (!loader) return fail(ErrorCode::invalid_argument, "a pager needs a loader");
    TERRANE_TRY(source->lattice().validate());
    constexpr double kLongest_s = 3600.0;
    constexpr double kWidest = 1e6;
    for (const Result<void>& good :
         {check_range("horizon", settings.horizon, 0.0, kLongest_s),
          check_range("contact_spacing", settings.contact_spacing, 0.0, 1e9),
          check_range("contact_share", settings.contact_share, 0.0, 1.0),
          check_range("distance_radius", settings.distance_radius, 1.0 / kWidest, kWidest)}) {
        if (!good) return tl::unexpected(good.error());
    }
    const Lattice& lattice = source->lattice();
    TERRANE_TRY(check_ceiling(*source, settings.memory_bytes));
    const int contact_level = settings.contact_spacing > 0.0
                                  ? lattice.level_for_spacing(settings.contact_spacing)
                                  : lattice.finest_level;
    auto state =
        std::make_shared<State>(std::move(source), settings, contact_level, std::move(loader));
    return Pager(std::move(state));
}

Pager::Pager(std::shared_ptr<State> state) : state_(std::move(state)) {}
Pager::Pager(Pager&&) noexcept = default;
Pager& Pager::operator=(Pager&&) noexcept = default;
Pager::~Pager() = default;

void Pager::update(std::span<const CameraNeed> cameras, std::span<const BodyNeed> bodies,
                   double time_s) {
    State& state = *state_;
    const bool is_due = state.update_clients(cameras, bodies, time_s);
    if (!std::exchange(state.replacements.is_wanted, false)) state.replacements.wanted_bytes = 0;
    state.loader->advance(state.time_s);
    state.take_finished();
    state.budget.begin_update(state.clients.observers, state.skips_fades);
    const bool has_moved = state.move_window();
    if (is_due || has_moved) {
        state.plan();
        if (state.is_inline) {
            state.load_until_stable();
        } else {
            state.queue_loads();
        }
    }
    state.fade();
    state.publish();
}

void Pager::finish() {
    State& state = *state_;
    state.skips_fades = true;
    state.budget.begin_update(state.clients.observers, state.skips_fades);
    bool is_busy = false;
    for (;;) {
        state.loader->wait();
        // the storage hangs: no queued load can start
        if (!state.take_finished() && is_busy) break;
        state.move_window();
        state.plan();
        is_busy = state.queue_loads();
        const bool has_evicted = state.budget.has_evicted();
        if (has_evicted) state.publish();
        if (!is_busy && !has_evicted) break;
    }
    state.fade();
    state.publish();
    state.skips_fades = false;
    state.evictions.in_finish.clear();
}

Result<void> Pager::set_memory_bytes(std::size_t memory_bytes) {
    TERRANE_TRY(check_ceiling(*state_->source, memory_bytes));
    state_->settings.memory_bytes = memory_bytes;
    state_->budget.set_memory_bytes(memory_bytes);
    state_->schedule.must_plan = true;
    return {};
}

bool replace_chunks(Pager& pager, const ChunkReplacement& replacement) {
    return pager.state_->replace(replacement);
}

RequiredRegion Pager::require(const WorldRect& region, double deadline_s) {
    const bool is_finite = std::isfinite(region.west) && std::isfinite(region.south) &&
                           std::isfinite(region.east) && std::isfinite(region.north);
    if (!is_finite || std::isnan(deadline_s)) {
        ++state_->stats.refused_needs;
        return {};
    }
    const std::uint64_t id = state_->required_regions.next_id++;
    state_->required_regions.by_id[id] = {region, deadline_s};
    state_->schedule.must_plan = true;
    return {state_, id};
}

Ground Pager::ground(std::shared_ptr<const SurfaceMap> surface_map) const {
    return {state_->set.chunks, state_->contact_level, std::move(surface_map)};
}

RequiredRegion::RequiredRegion(RequiredRegion&& other) noexcept
    : pager_(std::move(other.pager_)), id_(std::exchange(other.id_, 0)) {}

RequiredRegion& RequiredRegion::operator=(RequiredRegion&& other) noexcept {
    if (this != &other) {
        release();
        pager_ = std::move(other.pager_);
        id_ = std::exchange(other.id_, 0);
    }
    return *this;
}

RequiredRegion::~RequiredRegion() { release(); }

void RequiredRegion::release() {
    if (const auto pager = pager_.lock()) {
        if (pager->required_regions.by_id.erase(id_) > 0) pager->schedule.must_plan = true;
    }
    pager_.reset();
}

RegionState RequiredRegion::state() const {
    const auto pager = pager_.lock();
    if (!pager) return RegionState::released;
    const auto found = pager->required_regions.by_id.find(id_);
    if (found == pager->required_regions.by_id.end()) return RegionState::released;
    // from the roots down: every chunk over the region must be resident
    const internal::ChunkTree& tree = pager->tree;
    const Lattice& lattice = tree.lattice();
    std::vector<ChunkKey> open = tree.roots();
    bool is_failing = false;
    bool is_ready =
        internal::is_in_window(found->second.region, pager->source->extent(), tree.window());
    while (!open.empty()) {
        const ChunkKey key = open.back();
        open.pop_back();
        if (!internal::overlaps(lattice, key, found->second.region)) continue;
        const internal::ChunkTree::Index index = tree.find(key);
        if (index == internal::ChunkTree::kNone || tree[index].chunk == nullptr) {
            is_ready = false;
            is_failing = is_failing || pager->loads.retries.count(key) > 0;
            continue;
        }
        if (key.level == pager->contact_level) continue;
        for (int quadrant = 0; quadrant < 4; ++quadrant) open.push_back(key.child(quadrant));
    }
    if (is_ready) return RegionState::ready;
    return is_failing ? RegionState::failing : RegionState::loading;
}

std::shared_ptr<const ResidentSet> Pager::resident() const { return state_->set.chunks; }

int Pager::contact_level() const { return state_->contact_level; }

std::string Pager::last_failure() const { return state_->loads.last_failure; }

PagerStats Pager::stats() const {
    PagerStats stats = state_->stats;
    const std::size_t bytes = state_->bytes->load();
    std::size_t claimed_bytes = 0;
    for (const auto& [key, load] : state_->loads.in_flight) claimed_bytes += load.bytes;
    stats.in_flight_bytes = std::min(bytes, claimed_bytes);
    stats.resident_bytes = bytes - stats.in_flight_bytes;
    stats.resident_chunks = state_->tree.size();
    return stats;
}

// Resident chunks that are swapped because their source has changed.

using internal::ChunkTree;

bool Pager::State::replace(const ChunkReplacement& replacement) {
    std::vector<std::pair<ChunkTree::Index, std::shared_ptr<const Chunk>>> resident;
    std::size_t needed_bytes = 0;
    for (const auto& chunk : replacement.chunks) {
        const ChunkTree::Index index = tree.find(chunk->key);
        if (index == ChunkTree::kNone) continue;
        resident.emplace_back(index, chunk);
        needed_bytes += chunk->bytes();
    }
    ByteClaim all;
    if (!budget.claim_replacements(needed_bytes, all)) {
        ++stats.postponed_replacements;
        replacements.wanted_bytes = needed_bytes;
        replacements.is_wanted = true;
        schedule.must_plan = true;
        return false;
    }
    replacements.wanted_bytes = 0;
    replacement.switch_source();
    contact.forget_heights();
    stats.peak_bytes = std::max(stats.peak_bytes, budget.bytes());
    for (auto& [index, chunk] : resident) {
        all.shrink(all.bytes() - chunk->bytes());  // nothing else claims meanwhile
        std::shared_ptr<const Chunk> owned = claimed(chunk, ByteClaim(bytes, chunk->bytes()));
        const bool is_outline = tree[index].chunk == nullptr;
        tree.replace(index, std::move(owned));
        if (is_outline) budget.outline(index);
        ++stats.replaced;
    }
    for (const ChunkKey& key : replacement.changed) tree.refresh_above(key);
    std::erase_if(loads.orphans, [&](const auto& entry) {
        const bool is_outdated = !chunk_source.is_current(*entry.second.chunk);
        stats.outdated += is_outdated ? 1u : 0u;
        return is_outdated;
    });
    return true;
}

// The root window of a world with more root squares than can be resident. When the client leaves the middle of the
// window, the window moves as soon as all root squares of the new window are loaded, so that frames never lack a root
// square. When the client leaves the window itself, as after a jump, the window moves at once.

using internal::ChunkTree;

// The position that the window follows; none without clients.
std::optional<WorldVec2> Pager::State::window_place() const {
    if (!clients.predicted_views.empty())
        return clients.predicted_views.front().states.front().eye_world.head<2>();
    if (!clients.bodies.empty()) return clients.bodies.front().centre_world.head<2>();
    if (required_regions.by_id.empty()) return std::nullopt;
    const WorldRect& region = required_regions.by_id.begin()->second.region;
    return WorldVec2(0.5 * (region.west + region.east), 0.5 * (region.south + region.north));
}

// Returns whether the window has moved.
bool Pager::State::move_window() {
    const Lattice& world = source->lattice();
    if (world.root_window == 0) return false;
    const std::optional<WorldVec2> place = window_place();
    if (!place) return false;
    next_window.lattice = internal::moved_root_window(world, tree.window(), *place);
    std::erase_if(next_window.roots,
                  [this](const auto& root) { return !next_window.lattice.contains(root.first); });
    if (next_window.lattice == tree.window()) return false;
    const bool is_inside = internal::rect_of_roots(tree.window()).contains(place->x(), place->y());
    if (is_inside && !absent_next_roots().empty()) return false;
    for (const ChunkKey& key : tree.roots()) {
        const ChunkTree::Index index = tree.find(key);
        if (index != ChunkTree::kNone && !next_window.lattice.contains(key))
            budget.evict_tree(index);
    }
    tree.set_window(next_window.lattice);
    for (auto& [key, root] : next_window.roots)
        insert(std::move(root.chunk), root.bytes_read, true);
    next_window.roots.clear();
    return true;
}

// Root squares of the next window that are not loaded.
std::vector<ChunkKey> Pager::State::absent_next_roots() const {
    std::vector<ChunkKey> absent;
    for (std::int32_t y = 0; y < next_window.lattice.root_count_y; ++y) {
        for (std::int32_t x = 0; x < next_window.lattice.root_count_x; ++x) {
            const ChunkKey key{next_window.lattice.first_root_x + x,
                               next_window.lattice.first_root_y + y, 0};
            if (tree.find(key) == ChunkTree::kNone && !next_window.roots.contains(key))
                absent.push_back(key);
        }
    }
    return absent;
}

}  // namespace terrane
