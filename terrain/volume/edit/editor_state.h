// SPDX-License-Identifier: MIT
#pragma once

#include "edit/change.h"
#include "edit/chunk_files.h"
#include "edit/dig_log.h"

#include <terrane/volume/volume_editor.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

namespace terrane {

/// Changes wait in `submitted` for update(), which finds the resident chunks that they touch, go from `queue` to
/// `prepared` on the worker, or in update() where there is none, and from there into force in update(). All keep their
/// order. A chunk that arrives between is made again for the last change that touches it: a
/// *completion*.
struct VolumeEditor::State {
    State(std::shared_ptr<VolumeHeights> ground, const VolumeEditorSettings& chosen);
    ~State();

    // Constant, or of the owner.
    const std::shared_ptr<VolumeHeights> source;
    const VolumeEditorSettings settings;
    const Volumes volumes;
    internal::EditedVolumes& edited;
    std::shared_ptr<internal::ChunkFiles> files;  // null without a folder
    std::optional<internal::DigLog> log;
    std::vector<std::shared_ptr<const internal::Edit>>
        done;  // edits not taken back, waiting ones too
    std::uint32_t last_number = 0;
    std::map<ChunkKey, std::uint32_t> unsaved;  // chunks and their last change

    std::deque<internal::Change> submitted;

    struct Start {
        internal::Change change;
        std::vector<std::shared_ptr<const Chunk>> chunks;  // resident ones that it touches
    };
    struct Completion {
        std::shared_ptr<internal::PreparedChange> change;
        std::vector<std::shared_ptr<const Chunk>> chunks;
    };
    struct Snapshot {
        std::shared_ptr<const internal::Edit> edit;
        std::map<ChunkKey, internal::ChunkVersion> before;
    };
    mutable std::mutex mutex;  // of all below
    std::condition_variable_any changed;
    std::deque<Start> queue;
    std::deque<std::shared_ptr<internal::PreparedChange>> prepared;
    std::deque<Completion> completions;
    bool is_working = false;
    std::deque<Snapshot> snapshots;
    /// The last change of a batch: of some changes that waited when it began, each chunk is made for the last one only.
    std::uint32_t batch_end = 0;
    /// Replaced chunks, which the worker frees when nobody else holds them: megabytes each.
    std::vector<std::shared_ptr<const Chunk>> old_chunks;
    std::vector<std::shared_ptr<const internal::ChunkTiles>> old_tiles;
    std::vector<std::shared_ptr<internal::PreparedChange>> old_changes;
    VolumeEditorStats counts;
    std::string last_failure;
    std::jthread worker;  // last: stopped first

    using Lock = std::unique_lock<std::mutex>;
    bool is_idle() const { return queue.empty() && completions.empty() && !is_working; }
    /// Makes the first change or completion, if there is one.
    bool work(Lock& lock);
    void prepare(Lock& lock);
    void complete(Lock& lock);
    void use_latest_tiles(internal::PreparedChange& change, const ChunkKey& key) const;
    bool has_free_chunks() const;
    bool free_old(Lock& lock);
    void run(const std::stop_token& stop);

    /// Hands the submitted changes to the worker.
    void start(const ResidentSet& set);
    /// How many of the first `most` prepared changes can come into force now; asks for chunks that are missing.
    ///
    /// @param splits_batches also for those that later changes of a batch will make
    std::size_t ready_count(std::size_t most, const ResidentSet& set, bool splits_batches);
    /// Brings the first changes into force; whether they fit.
    bool switch_to(std::size_t count, Pager* pager, const ResidentSet& set);
    std::uint32_t update(Pager* pager);
    Result<void> replay();
    std::uint32_t submit(internal::Change change);
};

}  // namespace terrane
