// SPDX-License-Identifier: MIT
#include "edit/edit_files.h"
#include "edit/edited_volumes.h"

#include <terrane/base/text.h>
#include <terrane/volume/volume_editor.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

namespace terrane {

/// A change passes through three queues, in order: `submitted` until update() finds the resident chunks that it
/// touches; `queue` until the worker, or update() if there is none, prepares it; `prepared` until it takes effect in
/// update(). A chunk that is loaded in the meantime is made again for the last change that touches it: a *completion*.
struct VolumeEditor::State {
    State(std::shared_ptr<VolumeHeights> ground, const VolumeEditorSettings& chosen);
    ~State();

    // Constant, or used by the owner only.
    const std::shared_ptr<VolumeHeights> source;
    const VolumeEditorSettings settings;
    const Volumes volumes;
    internal::EditedVolumes& edited;
    std::shared_ptr<internal::ChunkFiles> files;  // null without a folder
    std::optional<internal::DigLog> log;
    std::vector<std::shared_ptr<const internal::Edit>> done;  // not undone; includes waiting ones
    std::uint32_t last_number = 0;
    std::map<ChunkKey, std::uint32_t> unsaved;  // chunks to save, and their last change

    std::deque<internal::Change> submitted;

    struct Start {
        internal::Change change;
        std::vector<std::shared_ptr<const Chunk>> chunks;  // resident chunks that it touches
    };
    struct Completion {
        std::shared_ptr<internal::PreparedChange> change;
        std::vector<std::shared_ptr<const Chunk>> chunks;
    };
    struct Snapshot {
        std::shared_ptr<const internal::Edit> edit;
        std::map<ChunkKey, internal::ChunkVersion> before;
    };
    mutable std::mutex mutex;  // guards all below
    std::condition_variable_any changed;
    std::deque<Start> queue;
    std::deque<std::shared_ptr<internal::PreparedChange>> prepared;
    std::deque<Completion> completions;
    bool is_working = false;
    std::deque<Snapshot> snapshots;
    /// Last change of the current batch. A batch is the changes that waited when it started; each chunk is made only
    /// for the last change of the batch that touches it.
    std::uint32_t batch_end = 0;
    /// Replaced chunks, megabytes each; the worker frees them when it holds the last reference.
    std::vector<std::shared_ptr<const Chunk>> old_chunks;
    std::vector<std::shared_ptr<const internal::ChunkTiles>> old_tiles;
    std::vector<std::shared_ptr<internal::PreparedChange>> old_changes;
    VolumeEditorStats counts;
    std::string last_failure;
    std::jthread worker;  // last member: stopped first

    using Lock = std::unique_lock<std::mutex>;
    bool is_idle() const { return queue.empty() && completions.empty() && !is_working; }
    /// Makes the first completion or change, if there is one.
    bool work(Lock& lock);
    void prepare(Lock& lock);
    void complete(Lock& lock);
    void use_latest_tiles(internal::PreparedChange& change, const ChunkKey& key) const;
    bool has_free_chunks() const;
    bool free_old(Lock& lock);
    void run(const std::stop_token& stop);

    /// Queues the submitted changes for the worker.
    void start(const ResidentSet& set);
    /// Returns the number n <= `most` such that the first n prepared changes can take effect together now. Queues a
    /// completion for chunks that are still missing.
    ///
    /// @param splits_batches changes may take effect before the rest of their batch: also requests chunks that were
    ///                       left to later changes of the batch
    std::size_t ready_count(std::size_t most, const ResidentSet& set, bool splits_batches);
    /// Lets the first `count` prepared changes take effect; false if their chunks do not fit below the pager's ceiling.
    bool switch_to(std::size_t count, Pager* pager, const ResidentSet& set);
    std::uint32_t update(Pager* pager);
    Result<void> replay();
    std::uint32_t submit(internal::Change change);
};

// Worker side: prepares changes and the chunks that they touch.

using internal::Change;
using internal::ChunkVersion;
using internal::PreparedChange;

namespace {
/// Largest number of changes in a batch: a larger batch would delay its first change too long.
constexpr std::size_t kMostOfBatch = 32;
}  // namespace

void VolumeEditor::State::run(const std::stop_token& stop) {
    Lock lock(mutex);
    while (!stop.stop_requested()) {
        if (free_old(lock) || work(lock)) continue;
        changed.wait(lock, stop, [this] {
            return !queue.empty() || !completions.empty() || has_free_chunks();
        });
    }
}

// Requires the lock.
bool VolumeEditor::State::has_free_chunks() const {
    return !old_tiles.empty() || !old_changes.empty() ||
           std::ranges::any_of(old_chunks,
                               [](const auto& chunk) { return chunk.use_count() == 1; });
}

bool VolumeEditor::State::free_old(Lock& lock) {
    if (!has_free_chunks()) return false;
    std::vector<std::shared_ptr<const Chunk>> chunks, held;
    for (auto& chunk : old_chunks)
        (chunk.use_count() == 1 ? chunks : held).push_back(std::move(chunk));
    old_chunks = std::move(held);
    auto tiles = std::exchange(old_tiles, {});
    auto changes = std::exchange(old_changes, {});
    lock.unlock();
    chunks.clear();
    tiles.clear();
    changes.clear();
    lock.lock();
    return true;
}

bool VolumeEditor::State::work(Lock& lock) {
    if (completions.empty() && queue.empty()) return false;
    is_working = true;
    if (!completions.empty()) {
        complete(lock);
    } else {
        prepare(lock);
    }
    is_working = false;
    changed.notify_all();
    return true;
}

// Releases the lock while tiles are made.
void VolumeEditor::State::prepare(Lock& lock) {
    auto made = std::make_shared<PreparedChange>();
    made->change = std::move(queue.front().change);
    auto chunks = std::move(queue.front().chunks);
    queue.pop_front();
    const Change& change = made->change;
    if (change.number > batch_end) {
        const std::size_t others = std::min(queue.size(), kMostOfBatch - 1);
        batch_end = others == 0 ? change.number : queue[others - 1].change.number;
    }
    std::erase_if(chunks, [&](const auto& chunk) {
        const bool is_later = std::ranges::any_of(queue, [&](const Start& later) {
            return later.change.number <= batch_end &&
                   std::ranges::any_of(later.chunks,
                                       [&](const auto& other) { return other->key == chunk->key; });
        });
        if (is_later) made->deferred.push_back(chunk->key);
        return is_later;
    });
    made->touched = change.edit->chunks(volumes.level());
    std::map<ChunkKey, ChunkVersion> before;
    for (const ChunkKey& key : made->touched) {
        ChunkVersion& version = before[key];
        auto last = prepared.rbegin();
        while (last != prepared.rend() && !(*last)->versions.contains(key)) ++last;
        version = last != prepared.rend() ? (*last)->versions.at(key) : edited.version_of(key);
    }
    std::map<ChunkKey, ChunkVersion> earlier;
    const bool has_snapshot =
        change.is_undo && !snapshots.empty() && snapshots.back().edit == change.edit;
    if (has_snapshot) {
        earlier = std::move(snapshots.back().before);
        snapshots.pop_back();
    }
    lock.unlock();
    begin(*made, source->heights(), volumes, edited, std::move(before),
          has_snapshot ? &earlier : nullptr);
    for (const auto& chunk : chunks) {
        make_chunk_of(*made, volumes, *chunk);
        if (!made->failure.empty()) break;  // update() queues a completion
    }
    chunks.clear();
    lock.lock();
    if (!made->failure.empty()) {
        ++counts.failed;
        last_failure = made->failure;
    }
    std::deque<Snapshot> old;  // freed without the lock
    if (!change.is_undo) {
        snapshots.push_back({change.edit, std::move(made->before)});
        while (snapshots.size() > static_cast<std::size_t>(settings.undo_depth)) {
            old.push_back(std::move(snapshots.front()));
            snapshots.pop_front();
        }
    }
    made->before.clear();
    prepared.push_back(std::move(made));
    lock.unlock();
    old.clear();
    earlier.clear();
    lock.lock();
}

void VolumeEditor::State::complete(Lock& lock) {
    const Completion wanted = std::move(completions.front());
    completions.pop_front();
    PreparedChange& change = *wanted.change;
    for (const auto& chunk : wanted.chunks) use_latest_tiles(change, chunk->key);
    lock.unlock();
    for (const auto& chunk : wanted.chunks) {
        make_chunk_of(change, volumes, *chunk);
        if (!change.failure.empty()) break;
    }
    lock.lock();
    change.is_completing = false;
    if (change.failure.empty()) {
        counts.completed += wanted.chunks.size();
    } else {
        ++counts.failed;
        last_failure = change.failure;
    }
}

// Gives the change's version of a chunk the most recent tiles whose edits are a prefix of the version's edits.
void VolumeEditor::State::use_latest_tiles(PreparedChange& change, const ChunkKey& key) const {
    ChunkVersion& version = change.versions.at(key);
    const auto consider = [&version](const ChunkVersion& other) {
        if (other.is_made() && begins_with(version.list(), other.list()) &&
            (!version.tiles || other.tile_edits > version.tile_edits)) {
            version.tiles = other.tiles;
            version.tile_edits = other.tile_edits;
        }
    };
    consider(edited.version_of(key));
    for (const auto& earlier : prepared) {
        const auto found = earlier->versions.find(key);
        if (earlier->change.number < change.change.number && found != earlier->versions.end())
            consider(found->second);
    }
}

// Owner side: lets changes take effect.

using internal::EditedVolumes;
using internal::PreparedChange;

// Requires the lock.
void VolumeEditor::State::start(const ResidentSet& set) {
    for (internal::Change& change : submitted) {
        Start begun{std::move(change), {}};
        for (const ChunkKey& key : begun.change.edit->chunks(volumes.level())) {
            if (auto chunk = set.share_ground(key)) begun.chunks.push_back(std::move(chunk));
        }
        queue.push_back(std::move(begun));
    }
    submitted.clear();
}

// Requires the lock.
std::size_t VolumeEditor::State::ready_count(std::size_t most, const ResidentSet& set,
                                             bool splits_batches) {
    std::size_t count = most;
    for (std::size_t i = 0; i < count; ++i) {
        if (prepared[i]->is_completing) count = i;
    }
    for (bool is_cut = true; is_cut;) {
        is_cut = false;
        std::map<ChunkKey, std::pair<std::size_t, std::size_t>> touches;  // first and last change
        for (std::size_t i = 0; i < count; ++i) {
            for (const ChunkKey& key : prepared[i]->touched) {
                touches.try_emplace(key, i, i).first->second.second = i;
            }
        }
        const PreparedChange* incomplete = nullptr;
        Completion completion;
        for (const auto& [key, of] : touches) {
            const auto& [first, last] = of;
            PreparedChange& change = *prepared[last];
            std::shared_ptr<const Chunk> chunk = set.share_ground(key);
            if (chunk == nullptr || change.chunks.contains(key)) continue;
            const bool comes_later =
                !splits_batches && change.change.number < batch_end &&
                std::ranges::find(change.deferred, key) != change.deferred.end();
            if (incomplete == nullptr && !change.is_completing && !comes_later) {
                incomplete = &change;
                completion.change = prepared[last];
            }
            if (incomplete == &change) {
                completion.chunks.push_back(std::move(chunk));
            }
            count = std::min(count, first);
            is_cut = true;
        }
        if (incomplete != nullptr) {
            completion.change->is_completing = true;
            completions.push_back(std::move(completion));
        }
    }
    return count;
}

// Call without the lock: nothing else uses the first prepared changes unless they are being completed.
bool VolumeEditor::State::switch_to(std::size_t count, Pager* pager, const ResidentSet& set) {
    std::vector<std::shared_ptr<PreparedChange>> changes;
    {
        const Lock lock(mutex);
        changes.assign(prepared.begin(), prepared.begin() + static_cast<std::ptrdiff_t>(count));
    }
    std::map<ChunkKey, PreparedChange*> last;
    for (const auto& change : changes) {
        for (const ChunkKey& key : change->touched) last[key] = change.get();
    }
    std::vector<ChunkKey> touched;
    std::vector<std::shared_ptr<const Chunk>> chunks;
    std::vector<std::shared_ptr<const Chunk>> old;
    std::vector<EditedVolumes::NewVersion> versions;
    for (const auto& [key, change] : last) {
        touched.push_back(key);
        versions.push_back({key, change->versions.at(key), 0});
        const auto chunk = change->chunks.find(key);
        if (chunk == change->chunks.end()) continue;
        chunks.push_back(chunk->second);
        if (auto held = set.share_ground(key)) old.push_back(std::move(held));
        versions.back().chunk_bytes = chunk->second->bytes();
    }
    const std::uint32_t number = changes.back()->change.number;
    std::vector<std::shared_ptr<const internal::ChunkTiles>> tiles;
    const auto bring_up_to_date = [&] { tiles = edited.switch_to(versions, number); };
    if (pager == nullptr) {
        bring_up_to_date();
    } else if (!replace_chunks(*pager, {chunks, touched, bring_up_to_date})) {
        return false;
    }
    for (const auto& change : changes) {
        const internal::Change& of = change->change;
        for (const ChunkKey& key : change->touched) unsaved[key] = of.number;
        if (!log) continue;
        internal::LogRecord record{of.number, 0, std::nullopt};
        if (of.is_undo) {
            record.undone = of.edit->number;
        } else {
            record.operation = of.edit->operation;
        }
        files->add_position(of.number, log->add(std::move(record)));
    }
    const Lock lock(mutex);
    prepared.erase(prepared.begin(), prepared.begin() + static_cast<std::ptrdiff_t>(count));
    if (settings.worker_count > 0) {
        old_chunks.insert(old_chunks.end(), old.begin(), old.end());
        old_tiles.insert(old_tiles.end(), tiles.begin(), tiles.end());
        old_changes.insert(old_changes.end(), changes.begin(), changes.end());
    }
    return true;
}

std::uint32_t VolumeEditor::State::update(Pager* pager) {
    static const ResidentSet kNothing({}, {}, {}, 0);
    const std::shared_ptr<const ResidentSet> set = pager ? pager->resident() : nullptr;
    const ResidentSet& chunks = set ? *set : kNothing;
    Lock lock(mutex);
    start(chunks);
    const auto make_all = [&] {
        while (settings.worker_count == 0 && work(lock)) {
        }
    };
    make_all();
    if (pager == nullptr) {
        changed.notify_all();
        changed.wait(lock, [this] { return is_idle(); });
    }
    std::size_t count = ready_count(prepared.size(), chunks, false);
    const std::uint64_t failed = counts.failed;
    while (settings.worker_count == 0 && !completions.empty() && counts.failed == failed) {
        make_all();
        count = ready_count(prepared.size(), chunks, false);
    }
    while (count > 0) {
        lock.unlock();
        const bool fits = switch_to(count, pager, chunks);
        lock.lock();
        if (fits) break;
        ++counts.postponed;
        // If the changes do not fit together, the first alone may.
        count = count == 1 ? 0 : ready_count(1, chunks, true);
    }
    if (!is_idle() || has_free_chunks()) changed.notify_all();
    return edited.number();
}

using internal::Edit;

namespace {

constexpr const char* kNoEdit =
    "a dig or fill is a sphere, capsule, box or tube, not a mesh or file";

bool can_be_edit(const VolumeShape& shape) {
    return !std::holds_alternative<VolumeMesh>(shape) && !std::holds_alternative<VolumeFile>(shape);
}

}  // namespace

VolumeEditor::State::State(std::shared_ptr<VolumeHeights> ground,
                           const VolumeEditorSettings& chosen)
    : source(std::move(ground)),
      settings(chosen),
      volumes(source->volumes()),
      edited(source->edited()) {}

VolumeEditor::State::~State() {
    worker.request_stop();
    if (worker.joinable()) worker.join();
    edited.keep_tiles(0, nullptr);
}

VolumeEditor::VolumeEditor(std::unique_ptr<State> state) : state_(std::move(state)) {}
VolumeEditor::VolumeEditor(VolumeEditor&&) noexcept = default;
VolumeEditor& VolumeEditor::operator=(VolumeEditor&&) noexcept = default;
VolumeEditor::~VolumeEditor() = default;

Result<VolumeEditor> VolumeEditor::create(std::shared_ptr<VolumeHeights> source,
                                          const VolumeEditorSettings& settings) {
    if (!source) return fail(ErrorCode::invalid_argument, "an editor needs a source");
    if (settings.worker_count < 0 || settings.worker_count > 1) {
        return fail(ErrorCode::invalid_argument,
                    "worker_count must be 0 or 1, got " + number_text(settings.worker_count));
    }
    if (settings.undo_depth < 0 || settings.undo_depth > 1024) {
        return fail(ErrorCode::invalid_argument,
                    "undo_depth must be 0 to 1024, got " + number_text(settings.undo_depth));
    }
    auto state = std::make_unique<State>(std::move(source), settings);
    if (!settings.folder.empty()) {
        std::error_code status;
        std::filesystem::create_directories(settings.folder, status);
        if (status) {
            return fail(ErrorCode::io,
                        "cannot make \"" + settings.folder + "\": " + status.message());
        }
        TERRANE_TRY(auto log, internal::DigLog::open(settings.folder + "/digs.log",
                                                     state->volumes.fingerprint()));
        state->log = std::move(log);
        state->files = std::make_shared<internal::ChunkFiles>(settings.folder, state->volumes);
        TERRANE_TRY(state->replay());
    }
    state->edited.keep_tiles(settings.memory_bytes, state->files);
    if (settings.worker_count == 1) {
        State* const shared = state.get();
        state->worker = std::jthread([shared](const std::stop_token& stop) { shared->run(stop); });
    }
    return VolumeEditor(std::move(state));
}

// Puts the changes of the log into effect; builds each chunk's list of edits once.
Result<void> VolumeEditor::State::replay() {
    std::map<ChunkKey, internal::ChunkEdits> chunks;
    for (std::size_t i = 0; i < log->records().size(); ++i) {
        const internal::LogRecord& record = log->records()[i];
        const auto bad = [&](const std::string& why) {
            return fail(ErrorCode::bad_data,
                        "change " + number_text(record.number) + " of the log: " + why);
        };
        if (record.operation) {
            if (!can_be_edit(record.operation->shape)) return bad(kNoEdit);
            auto placed =
                PlacedVolume::create(volumes.lattice(), volumes.level(), *record.operation);
            if (!placed) return bad(placed.error().message);
            done.push_back(
                std::make_shared<const Edit>(record.number, *record.operation, std::move(*placed)));
        } else if (done.empty() || done.back()->number != record.undone) {
            return bad("it undoes " + number_text(record.undone) + ", which is not the last edit");
        }
        for (const ChunkKey& key : done.back()->chunks(volumes.level())) {
            internal::ChunkEdits& edits = chunks[key];
            edits.changed = record.number;
            if (record.operation) {
                edits.edits.push_back(done.back());
            } else {
                edits.edits.pop_back();
                edits.undone.push_back({record.undone, record.number});
            }
        }
        if (!record.operation) done.pop_back();
        files->add_position(record.number, log->hashes()[i]);
        last_number = record.number;
    }
    std::vector<internal::EditedVolumes::NewVersion> versions;
    for (auto& [key, edits] : chunks) {
        edits.base_extent = edited.extent_of(key);
        edits.extent = internal::extent_with(source->heights(), volumes, key, edits);
        versions.push_back(
            {key, {std::make_shared<const internal::ChunkEdits>(std::move(edits)), nullptr, 0}, 0});
    }
    edited.switch_to(versions, last_number);
    counts.torn_bytes = log->torn_bytes();
    return {};
}

Result<std::uint32_t> VolumeEditor::dig(const VolumeShape& shape, const Pose& world_from_shape) {
    return edit(VolumeOp::remove, shape, world_from_shape);
}

Result<std::uint32_t> VolumeEditor::fill(const VolumeShape& shape, const Pose& world_from_shape) {
    return edit(VolumeOp::add, shape, world_from_shape);
}

Result<std::uint32_t> VolumeEditor::edit(VolumeOp op, const VolumeShape& shape,
                                         const Pose& world_from_shape) {
    State& state = *state_;
    if (!can_be_edit(shape)) return fail(ErrorCode::invalid_argument, kNoEdit);
    VolumeOperation operation{op, shape, world_from_shape, state.volumes.spacing()};
    TERRANE_TRY(auto placed,
                PlacedVolume::create(state.volumes.lattice(), state.volumes.level(), operation));
    auto made = std::make_shared<const Edit>(state.last_number + 1, std::move(operation),
                                             std::move(placed));
    state.done.push_back(made);
    return state.submit({made->number, std::move(made), false});
}

Result<std::uint32_t> VolumeEditor::undo() {
    State& state = *state_;
    if (state.done.empty())
        return fail(ErrorCode::invalid_argument, "there is no dig or fill to undo");
    auto last = std::move(state.done.back());
    state.done.pop_back();
    return state.submit({state.last_number + 1, std::move(last), true});
}

std::uint32_t VolumeEditor::State::submit(internal::Change change) {
    last_number = change.number;
    submitted.push_back(std::move(change));
    return last_number;
}

std::uint32_t VolumeEditor::update(Pager& pager) { return state_->update(&pager); }
std::uint32_t VolumeEditor::update() { return state_->update(nullptr); }

void VolumeEditor::wait() {
    State& state = *state_;
    State::Lock lock(state.mutex);
    state.changed.wait(lock, [&] { return state.is_idle(); });
}

Result<void> VolumeEditor::save() {
    State& state = *state_;
    if (!state.log)
        return fail(ErrorCode::invalid_argument, "this editor has no folder to save to");
    TERRANE_TRY(state.log->save());
    for (auto chunk = state.unsaved.begin(); chunk != state.unsaved.end();) {
        const internal::ChunkVersion version = state.edited.version_of(chunk->first);
        if (!version.is_made()) {
            ++chunk;
            continue;
        }
        TERRANE_TRY(state.files->write(chunk->first, *version.tiles, version.edits->changed));
        chunk = state.unsaved.erase(chunk);
    }
    return {};
}

VolumeEditorStats VolumeEditor::stats() const {
    const State& state = *state_;
    const State::Lock lock(state.mutex);
    VolumeEditorStats stats = state.counts;
    stats.waiting = state.submitted.size() + state.queue.size() + state.prepared.size() +
                    (state.is_working ? 1u : 0u);
    stats.in_force = state.edited.number();
    if (state.files) {
        const internal::ChunkFiles::Counts files = state.files->counts();
        stats.files_read = files.read;
        stats.files_refused = files.refused;
        stats.files_written = files.written;
    }
    return stats;
}

std::string VolumeEditor::last_failure() const {
    const State::Lock lock(state_->mutex);
    const std::string refusal = state_->files ? state_->files->counts().last_refusal : "";
    return state_->last_failure.empty() ? refusal : state_->last_failure;
}

}  // namespace terrane
