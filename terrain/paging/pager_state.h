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
#include <unordered_map>
#include <utility>

namespace terrane {
namespace internal {

/// A load that was queued and whose result has not been taken yet.
struct LoadInProgress {
    std::size_t bytes = 0;  // claimed
    bool is_needed = true;
    double unneeded_since_s = 0.0;
    bool is_cancelled = false;
    bool is_speculation = false;
    bool is_to_be_drawn = true;  ///< otherwise the outline does, if the chunk can have one
};

/// A loaded chunk whose parent is not resident yet.
struct Orphan {
    std::shared_ptr<const Chunk> chunk;
    std::size_t bytes_read = 0;
    bool is_to_be_drawn = true;
    double arrived_s = 0.0;
};

/// Loads in flight, and the record of past ones.
struct Loads {
    std::map<ChunkKey, LoadInProgress> in_flight;  ///< queued, and the result not taken yet
    std::map<ChunkKey, Orphan> orphans;
    /// A touched contact chunk that is absent.
    struct Missing {
        double since_s = 0.0;
        /// The last plan that missed it.
        std::uint64_t plan = std::numeric_limits<std::uint64_t>::max();
    };
    std::unordered_map<ChunkKey, Missing, ChunkKeyHash> missing;  ///< never iterated, but to erase
    LoadTimes times;
    Retries retries;
    std::string last_failure;  ///< message of the last load that failed

    /// Whether a chunk is being loaded or waits as an orphan.
    bool has(const ChunkKey& key) const { return in_flight.contains(key) || orphans.contains(key); }
};

/// When plans are made.
struct PlanSchedule {
    double planned_s = -std::numeric_limits<double>::infinity();  ///< time of the last plan
    std::uint64_t count = 0;                                      ///< of plans
    bool must_plan = false;         ///< a plan is due for another reason than elapsed time
    bool is_clock_stalled = false;  ///< time has not advanced since the previous update
};

/// The cameras and bodies of the last update.
struct Clients {
    // by index in the caller's list
    std::vector<CameraMotion> motions;
    std::vector<std::optional<FadeObserver::PreviousView>> views;
    std::size_t body_count = 0;  ///< including refused bodies

    // excluding refused cameras and bodies
    std::vector<FadeObserver> observers;
    std::vector<PredictedView> predicted_views;  ///< of the last plan
    std::vector<BodyNeed> bodies;
    std::vector<BodyMoment> trajectory_moments;  ///< of all bodies, concatenated

    /// Copies valid bodies and their trajectories. Returns the number of refused bodies.
    std::uint64_t take_bodies(std::span<const BodyNeed> all_bodies);
};

/// Regions that clients require at present.
struct RequiredRegions {
    std::map<std::uint64_t, RegionNeed> by_id;
    std::uint64_t next_id = 1;
};

/// The root window to which the present one will move; equal to the present one if no move is due.
struct NextWindow {
    Lattice lattice;
    std::map<ChunkKey, Orphan> roots;  ///< its loaded root squares outside the present window
};

/// Chunks that have been evicted.
struct Evictions {
    std::map<ChunkKey, double> times_s;  ///< of evictions within the last horizon, seconds
    std::set<ChunkKey> in_finish;        ///< finish() must not reload these, or it might never end
};

/// State of replace_chunks().
struct Replacements {
    std::size_t wanted_bytes = 0;  ///< needed by a postponed call; 0: none is postponed
    bool is_wanted = false;        ///< a call was postponed since the last update()
};

/// A drawn chunk of the published set, and the index of its node.
struct SetEntry {
    ChunkKey key;
    ChunkTree::Index index = ChunkTree::kNone;
};

/// The set that clients read.
struct PublishedSet {
    std::shared_ptr<const ResidentSet> chunks;
    std::vector<SetEntry> order;           ///< drawn chunks of the set, in the set's order
    std::vector<ChunkTree::Index> fading;  ///< nodes whose fades may change
    bool has_new_fades = false;            ///< a fade has changed since the last set
};

}  // namespace internal

/// The state of a pager. An update records its clients, takes arrived chunks, plans (pager_loads.cpp), queues
/// loads (pager_loads.cpp), and publishes a set.
struct Pager::State {
    State(std::shared_ptr<const HeightSource> ground, const PagerSettings& chosen, int level,
          std::unique_ptr<ChunkLoader> chosen_loader)
        : source(std::move(ground)),
          chunk_source(chunks_of(*source)),
          settings(chosen),
          contact_level(level),
          tree(source->lattice(), chunk_source),
          needs(chosen),
          contact(*source, level),
          budget(tree, bytes, chosen, level),
          next_window{tree.window(), {}},
          set{std::make_shared<const ResidentSet>(source->lattice(), source->extent(),
                                                  std::vector<std::shared_ptr<const Chunk>>(), 0),
              {},
              {}},
          loader(std::move(chosen_loader)) {}

    std::shared_ptr<const HeightSource> source;
    const ChunkSource& chunk_source;  // of the source
    PagerSettings settings;
    int contact_level = 0;
    std::shared_ptr<ByteCount> bytes = std::make_shared<ByteCount>(0);
    internal::ChunkTree tree;
    internal::NeedFinder needs;
    internal::ContactNeeds contact;
    internal::MemoryBudget budget;

    double time_s = 0.0;
    internal::PlanSchedule schedule;
    internal::Clients clients;
    internal::RequiredRegions required_regions;
    internal::Loads loads;
    internal::NextWindow next_window;
    internal::Evictions evictions;
    std::size_t sorted_count = 0;  // of the candidates in `needs`
    internal::Replacements replacements;
    internal::PublishedSet set;
    bool is_inline = false;    // update() loads synchronously
    bool skips_fades = false;  // in finish()
    PagerStats stats;
    std::unique_ptr<ChunkLoader> loader;  // last member: destroyed first

    bool update_clients(std::span<const CameraNeed> cameras, std::span<const BodyNeed> all_bodies,
                        double now_s);
    bool take_finished();
    void accept(FinishedLoad& load);
    bool insert(std::shared_ptr<const Chunk> chunk, std::size_t bytes_read, bool is_to_be_drawn);
    void adopt_orphans();
    /// Whether all needed chunks, even speculative ones, are loaded now, but no descendants of absent chunks.
    bool waits_for_all() const { return is_inline || skips_fades; }
    double contact_horizon() const;
    void plan();
    void count_late();
    void count_groundless();
    void count_waits();
    void cancel_stale_loads();
    bool may_begin(const internal::LoadCandidate& candidate, double arrival_s) const;
    void postpone();
    void sort_candidates_up_to(std::size_t index);
    bool may_speculate(std::size_t in_flight_count) const;
    bool queue_loads();
    bool replace(const ChunkReplacement& replacement);
    void fade();
    void record_evictions();
    void publish();
    std::vector<float> fades_in_order() const;
    void load_until_stable();
    std::optional<WorldVec2> window_place() const;
    bool move_window();
    std::vector<ChunkKey> absent_next_roots() const;
};

}  // namespace terrane
