// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/camera_motion.h"
#include "paging/chunk_tree.h"
#include "paging/demand/contact_needs.h"
#include "paging/load_times.h"
#include "paging/need_finder.h"
#include "paging/retries.h"
#include "paging/memory_budget.h"

#include <terrane/terrain/pager.h>

#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace terrane {
namespace internal {

/// A load under way, or finished and not taken.
struct Begun {
    bool is_needed = true;
    double unneeded_since_s = 0.0;
    bool is_cancelled = false;
    bool is_speculation = false;
};

/// A chunk that arrived before its parent.
struct Orphan {
    std::shared_ptr<const Chunk> chunk;
    std::size_t bytes_read = 0;
    double arrived_s = 0.0;
};

/// Where the pager keeps a chunk of the set.
struct Placed {
    ChunkKey key;
    ChunkTree::Index index = ChunkTree::kNone;
};

}  // namespace internal

/// What a pager knows. An update takes clients in, takes what has arrived, plans (pager_plan.cpp), loads
/// (pager_loads.cpp), and publishes a set.
struct Pager::State {
    State(std::shared_ptr<const HeightSource> ground, const PagerSettings& chosen, int level,
          std::unique_ptr<ChunkLoader> chosen_loader)
        : source(std::move(ground)),
          settings(chosen),
          contact_level(level),
          tree(source->lattice()),
          needs(chosen, level),
          contact(*source, level),
          room(tree, bytes, chosen),
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
    internal::Room room;

    // clients
    double time_s = 0.0;
    double planned_s = -std::numeric_limits<double>::infinity();  // when needs were looked at last
    bool must_plan = false;                                       // a ticket came or went
    bool clock_stands = false;                                    // since the update before
    std::size_t body_count = 0;
    std::vector<internal::CameraMotion> motions;                  // by place in the list
    std::vector<std::optional<internal::Watcher::Before>> views;  // of the last update, by place
    std::vector<internal::Watcher> watchers;
    std::vector<internal::Outlook> outlooks;
    std::vector<BodyNeed> bodies;
    std::vector<BodyMoment> trajectory_moments;  // of all bodies, one after the other
    std::map<Ticket, internal::RegionNeed> tickets;
    Ticket next_ticket = 1;

    // loads
    std::map<ChunkKey, internal::Begun> begun;  // under way, or finished and not taken
    std::map<ChunkKey, internal::Orphan> orphans;
    std::map<ChunkKey, double> evicted_s;       // when, within the last horizon
    std::map<ChunkKey, double> missed_since_s;  // contact that is touched and absent
    bool is_inline = false;                     // loads inside update()
    bool may_jump = false;                      // in finish(): nobody looks
    std::set<ChunkKey> gone_in_finish;          // or two might take turns for ever

    // the set
    std::uint64_t epoch = 0;
    std::shared_ptr<const ResidentSet> set;
    std::vector<internal::Placed> order;  // of the set's chunks
    std::vector<std::shared_ptr<const Chunk>> come;
    PagerStats stats;
    std::string last_failure;             // message of the last load that failed
    std::unique_ptr<ChunkLoader> loader;  // last: stopped first

    bool take_clients(std::span<const CameraNeed> cameras, std::span<const BodyNeed> all_bodies,
                      double now_s);
    bool take_finished();
    void take_in(FinishedLoad& load);
    bool insert(std::shared_ptr<const Chunk> chunk, std::size_t bytes_read);
    void adopt_orphans();
    /// Everything is loaded that is needed, whatever that takes.
    bool waits_for_all() const { return is_inline || may_jump; }
    double contact_horizon() const;
    void plan();
    void count_late();
    void count_groundless();
    void count_waits();
    void give_up();
    bool may_begin(const internal::Wish& wish, double arrival_s) const;
    void postpone();
    bool may_speculate(std::size_t under_way) const;
    bool queue_loads();
    void fade();
    void publish();
    void settle();
};

}  // namespace terrane
