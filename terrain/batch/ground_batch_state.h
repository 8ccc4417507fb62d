// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "batch/chunk_order.h"
#include "batch/chunk_table.h"

#include <terrane/terrain/ground_batch.h>
#include <terrane/terrain/ray_fan.h>

#include <algorithm>
#include <vector>

namespace terrane {

struct GroundBatch::State {
    explicit State(int worker_count)
        : team(worker_count), workers(static_cast<std::size_t>(worker_count)) {}

    struct Worker {
        internal::ChunkTable table;
        internal::ChunkOrder order;
    };

    /// Calls job(begin, end, worker) for slices of the items below count, of `least` items or more where there are as
    /// many.
    template <class Job>
    void run_slices(std::size_t count, std::size_t least, const Job& job) {
        // several for each worker, so that all end at about the same time
        const std::size_t share = count / (4 * workers.size()) + 1;
        const std::size_t side = std::clamp(share, least, internal::ChunkOrder::kMost);
        team.run(count / side + (count % side != 0 ? 1 : 0), [&](std::size_t slice, int worker) {
            const std::size_t begin = slice * side;
            job(begin, begin + std::min(side, count - begin),
                workers[static_cast<std::size_t>(worker)]);
        });
    }

    internal::WorkerTeam team;
    std::vector<Worker> workers;
    std::uint64_t call = 0;  // number of the call, for the tables
    RayFan fan;              // of rays with a common start
};

}  // namespace terrane
