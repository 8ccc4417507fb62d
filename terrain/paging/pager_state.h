// SPDX-License-Identifier: MIT
#pragma once

#include "paging/chunk_loader.h"
#include "paging/chunk_tree.h"
#include "paging/demand/camera_motion.h"
#include "paging/demand/contact_needs.h"
#include "paging/memory_budget.h"
#include "paging/need_finder.h"

#include <terrane/terrain/pager.h>

#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace terrane {
namespace internal {

/// A load that has begun and is not taken yet.
struct LoadInProgress {
    std::size_t bytes = 0;  // claimed
    bool is_needed = true;
    double unneeded_since_s = 0.0;
    bool is_cancelled = false;
    bool is_speculation = false;
};

/// A loaded chunk whose parent is not resident yet.
struct Orphan {
    std::shared_ptr<const Chunk> chunk;
    std::size_t bytes_read = 0;
    double arrived_s = 0.0;
};

/// A chunk of the published set and its node.
struct SetEntry {
    ChunkKey key;
    ChunkTree::Index index = ChunkTree::kNone;
};

}  // namespace internal

/// The state of a pager. An update records its clients, takes arrived chunks, plans (pager_loads.cpp), queues
/// loads (pager_loads.cpp), and publishes a set.
struct Pager::State {
    State(std::shared_ptr<const HeightSource> ground, const PagerSettings& chosen, int level,
          std::unique_ptr<ChunkLoader> chosen_loader)
        : source(std::move(ground)),
          settings(chosen),
          contact_level(level),
          tree(*source),
          needs(chosen, level),
          contact(*source, level),
          budget(tree, bytes, chosen),
          next_window(tree.window()),
          set(std::make_shared<const ResidentSet>(source->lattice(), source->extent(),
                                                  std::vector<std::shared_ptr<const Chunk>>{},
                                                  epoch)),
          loader(std::move(chosen_loader)) {}

    std::shared_ptr<const HeightSource> source;
    PagerSettings settings;
    int contact_level = 0;
    std::shared_ptr<ByteCount> bytes = std::make_shared<ByteCount>(0);
    internal::ChunkTree tree;
    internal::NeedFinder needs;
    internal::ContactNeeds contact;
    internal::LoadTimes times;
    internal::Retries retries;
    internal::MemoryBudget budget;

    // clients
    double time_s = 0.0;
    double planned_s = -std::numeric_limits<double>::infinity();  // time of the last plan
    bool must_plan = false;                                       // required regions have changed
    bool is_clock_stalled = false;  // time has not advanced since the update before
    std::size_t body_count = 0;
    std::vector<internal::CameraMotion> motions;  // by index in the list
    std::vector<std::optional<internal::FadeObserver::PreviousView>>
        views;  // of the last update, by index
    std::vector<internal::FadeObserver> observers;
    std::vector<internal::PredictedView> predicted_views;
    std::vector<BodyNeed> bodies;
    std::vector<BodyMoment> trajectory_moments;                      // of all bodies, concatenated
    std::map<std::uint64_t, internal::RegionNeed> required_regions;  // by id
    std::uint64_t next_region_id = 1;

    // loads
    std::map<ChunkKey, internal::LoadInProgress> in_flight;  // begun and not taken
    std::map<ChunkKey, internal::Orphan> orphans;
    // The root window that the client's position asks for, and its loaded root squares outside of the present window.
    Lattice next_window;
    std::map<ChunkKey, internal::Orphan> next_roots;
    std::map<ChunkKey, double> eviction_times_s;  // within the last horizon
    std::map<ChunkKey, double> missing_since_s;   // contact chunks that are touched and absent
    bool is_inline = false;                       // update() loads synchronously
    bool skips_fades = false;                     // in finish()
    std::set<ChunkKey> evicted_in_finish;         // not reloaded: two might alternate for ever

    // the set
    std::uint64_t epoch = 0;
    std::shared_ptr<const ResidentSet> set;
    std::vector<internal::SetEntry> order;  // of the set's chunks
    std::vector<std::shared_ptr<const Chunk>> arrived;
    std::vector<ChunkKey> replaced_keys;       // since the last set
    std::size_t wanted_replacement_bytes = 0;  // of replace(), where it did not fit
    bool is_replacement_wanted = false;        // since the last update()
    PagerStats stats;
    std::string last_failure;             // message of the last load that failed
    std::unique_ptr<ChunkLoader> loader;  // last: stopped first

    bool take_clients(std::span<const CameraNeed> cameras, std::span<const BodyNeed> all_bodies,
                      double now_s);
    bool take_finished();
    void accept(FinishedLoad& load);
    bool insert(std::shared_ptr<const Chunk> chunk, std::size_t bytes_read);
    void adopt_orphans();
    /// Whether everything that is needed is loaded, without speculation or deadlines.
    bool waits_for_all() const { return is_inline || skips_fades; }
    double contact_horizon() const;
    void plan();
    void count_late();
    void count_groundless();
    void count_waits();
    void cancel_stale_loads();
    bool may_begin(const internal::LoadCandidate& candidate, double arrival_s) const;
    void postpone();
    bool may_speculate(std::size_t in_flight_count) const;
    bool queue_loads();
    bool replace(std::span<const std::shared_ptr<const Chunk>> chunks,
                 std::span<const ChunkKey> changed, const std::function<void()>& switch_source);
    void fade();
    void publish();
    void load_until_stable();
    std::optional<WorldVec2> window_place() const;
    bool move_window();
    std::vector<ChunkKey> absent_next_roots() const;
};

}  // namespace terrane
